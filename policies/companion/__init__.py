"""The companion computer: a trained policy that flies a vehicle over MAVLink. Imports nothing of the simulator."""
