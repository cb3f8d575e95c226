"""Trained policies as files: saved, found, exported."""
