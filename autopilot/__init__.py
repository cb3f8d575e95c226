"""The flight controller: ports, estimator, control, commander, navigator and MAVLink."""
