"""The camera as a MAVLink component: commands, information, settings."""
