"""Runs chosen by the results of those before: where the boundary is, what is worst, how rare failures are."""
