"""Boards: who flies the bodies. The own one is the flight controller of `autopilot`."""
