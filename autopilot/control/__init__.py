"""The cascade from setpoint to motor commands: trajectory, position, velocity, attitude, rate, allocation."""
