"""A rover that parks by a learned policy, over MAVLink."""
