"""The vehicle's MAVLink side: codec, links, and one file per protocol service."""
