"""The payload of each telemetry message, from the vehicle's state; None where there is nothing true to say yet."""
