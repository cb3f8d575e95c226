"""World, bodies, sensors and engines; carries the flight controller as a test rig carries the board."""
