"""How fast and how well vehicles, worlds and cameras run."""
