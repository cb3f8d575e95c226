"""Flights reviewed by their logs: `honeyguide review`."""
