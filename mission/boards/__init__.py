"""Flights whose flight controller is another program: ArduPilot, PX4 or Betaflight in our bodies and worlds."""
