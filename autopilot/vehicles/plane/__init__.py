"""A plane: how it is flown, and what the Python part must know of it."""
