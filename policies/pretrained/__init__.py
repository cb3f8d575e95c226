"""Trained policies that ship with the project."""
