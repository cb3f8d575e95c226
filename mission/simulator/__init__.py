"""What the simulator adds to a flight: devices, failures, SIM_* parameters."""
