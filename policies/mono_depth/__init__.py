"""Depth told from colours alone, by a network of its own: what the map is made of where no depth camera works."""
