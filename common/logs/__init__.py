"""Logs as they are written: flights, telemetry, and files that grow for days."""
