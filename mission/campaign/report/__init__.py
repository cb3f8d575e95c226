"""What a campaign has found: figures, plots, a page."""
