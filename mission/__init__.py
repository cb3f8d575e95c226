"""Flights, scripts, reports and the command line: the composition root."""
