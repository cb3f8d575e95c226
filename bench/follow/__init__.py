"""Reproduction of docs/results/follow.md."""
