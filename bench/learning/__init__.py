"""How fast and how well learning and what was learned run."""
