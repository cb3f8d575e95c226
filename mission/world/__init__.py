"""Worlds of one's own: read from files, looked at and exported."""
