"""Flights as Foxglove shows them: MCAP files, and a live connection."""
