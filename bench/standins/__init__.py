"""Strict stand-ins for autopilots of others: their parsers, clocks and time-outs, for tests and speed rows."""
