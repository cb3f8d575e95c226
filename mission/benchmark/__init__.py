"""Benchmarks that anybody's policy can enter: fixed flights over MAVLink, a table, and what fell short."""
