"""Parameters of take-off, missions, return and landing. Speed and acceleration limits are the control part's."""

from common.params import Parameter

_PX4 = "PX4 1.15 default"

NAVIGATOR_PARAMETERS: list[Parameter] = [
    Parameter("MIS_TAKEOFF_ALT", 2.5, 0.5, 80.0, "m", "default and least take-off height above home", _PX4),
    Parameter("MIS_DIST_1WP", 10_000.0, -1.0, 100_000.0, "m",
              "longest way to a mission's first waypoint, negative: any", _PX4),
    Parameter("MPC_TKO_SPEED", 1.5, 0.5, 5.0, "m/s", "climb speed of a take-off", _PX4),
    Parameter("MPC_LAND_SPEED", 0.7, 0.3, 3.0, "m/s", "descent speed from MPC_LAND_ALT2 down", _PX4),
    Parameter("MPC_LAND_CRWL", 0.3, 0.1, 3.0, "m/s", "descent speed from MPC_LAND_ALT3 down, by range finder", _PX4),
    Parameter("MPC_LAND_ALT1", 10.0, 0.0, 122.0, "m", "height above ground from which a descent slows down", _PX4),
    Parameter("MPC_LAND_ALT2", 5.0, 0.0, 122.0, "m", "height above ground at which MPC_LAND_SPEED is reached", _PX4),
    Parameter("MPC_LAND_ALT3", 1.0, 0.0, 122.0, "m", "height above ground of the slow last part", _PX4),
    Parameter("NAV_ACC_RAD", 2.0, 0.05, 200.0, "m", "radius in which a waypoint counts as reached",
              "PX4's copter airframes"),
    Parameter("NAV_MC_ALT_RAD", 0.8, 0.05, 200.0, "m", "height error at which a waypoint counts as reached", _PX4),
    Parameter("RTL_RETURN_ALT", 30.0, 0.0, 1000.0, "m", "height above home of the way back", "guess; PX4 has 60 m"),
    Parameter("RTL_DESCEND_ALT", 10.0, 0.0, 100.0, "m", "height above home to which to descend before RTL_LAND_DELAY",
              "guess; PX4 has 30 m"),
    Parameter("RTL_LAND_DELAY", 0.0, -1.0, 300.0, "s", "wait before the last descent, negative: do not land", _PX4),
    Parameter("RTL_MIN_DIST", 10.0, 0.5, 100.0, "m", "distance to home below which a return does not climb", _PX4),
]  # fmt: skip
