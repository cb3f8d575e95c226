"""Sensors: from the true state to the samples that the flight controller's drivers deliver."""
