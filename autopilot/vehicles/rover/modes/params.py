"""The numbers of the rover's modes that PX4 has no names for."""

from common.params import Parameter

_ARDUPILOT = "ArduPilot Rover 4.6 default"

MODE_PARAMETERS = [
    Parameter("HG_RO_CIRC_RAD", 20.0, 0.5, 1000.0, "m", "radius of a circle that names none", _ARDUPILOT),
    Parameter("HG_RO_CIRC_SPD", 0.0, 0.0, 10.0, "m/s", "speed of a circle that names none, 0: RO_SPEED_LIM",
              _ARDUPILOT),
    Parameter("HG_RO_CIRC_DIR", 0, 0, 1, "", "way round a circle that names none: 0 clockwise, 1 the other",
              _ARDUPILOT),
    Parameter("HG_RO_SIMPLE", 0, 0, 1, "", "mode Simple: 0 sticks by the heading at first, 1 by north", _ARDUPILOT),
    Parameter("HG_RO_DOCK_SPD", 0.5, 0.1, 10.0, "m/s", "speed of docking; ArduPilot's 0 is half of WP_SPEED",
              "guess"),
    Parameter("HG_RO_DOCK_STP", 0.3, 0.0, 2.0, "m", "distance from the docking target to stop at", _ARDUPILOT),
]  # fmt: skip
