"""Worlds of one's own: what a world file says, and the triangles made from it."""
