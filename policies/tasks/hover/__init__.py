"""Hover: a drone stays at a point by body rates and thrust."""
