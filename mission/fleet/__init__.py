"""Several vehicles in one world."""
