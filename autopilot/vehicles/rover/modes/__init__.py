"""Flight modes of the rover."""
