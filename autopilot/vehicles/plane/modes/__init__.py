"""Flight modes of the plane."""
