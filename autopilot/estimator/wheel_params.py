"""Parameters of wheel odometry, which a class of vehicles on wheels declares beside its own; others have none of them.

Names are in the style of PX4, whose estimator fuses no wheels.
"""

import warp as wp

from common.params import Parameter, ParameterTable

# EKF2_WHL_CTRL
WHEEL_CTRL_SPEED = wp.constant(1)
WHEEL_CTRL_SIDE = wp.constant(2)
WHEEL_CTRL_SCALE = wp.constant(4)
WHEEL_CTRL_REST = wp.constant(8)

_AIRFRAME = "airframe file"

WHEEL_PARAMETERS: list[Parameter] = [
    Parameter(
        "EKF2_WHL_CTRL",
        15,
        0,
        15,
        "",
        "wheel odometry: 1 speed along the nose, 2 none sideways or up, 4 learns the wheels' scale, 8 tells rest",
        "all that was measured to pay",
        "wheel_ctrl",
    ),
    Parameter(
        "EKF2_WHL_NOISE", 0.05, 0.005, 1.0, "m/s", "noise of a wheel's speed", "guess: encoder steps", "wheel_noise"
    ),
    Parameter(
        "EKF2_WHL_SFE",
        0.02,
        0.0,
        0.2,
        "m/m",
        "error of a wheel's scale before it is learned",
        "guess: load and wear",
        "wheel_scale_std",
    ),
    Parameter(
        "EKF2_WHL_SLIP",
        0.007,
        0.0,
        0.2,
        "s^2/m",
        "slip expected, along and across, as a fraction of the speed per specific force that the tyres bear",
        "a tyre whose force is 14 times its load per slip, as those of cars",
        "wheel_slip",
    ),
    Parameter(
        "EKF2_WHL_SIDE_N",
        0.05,
        0.005,
        1.0,
        "m/s",
        "noise of the zero speed sideways; up and down it is twice as large",
        "guess",
        "wheel_side_noise",
    ),
    Parameter("EKF2_WHL_GATE", 5.0, 1.0, 50.0, "SD", "gate of wheel odometry", "as PX4 has for GNSS", "wheel_gate"),
    Parameter(
        "EKF2_WHL_POS_X",
        0.0,
        -5.0,
        5.0,
        "m",
        "forward of the centre, the place that does not move sideways in a turn: rear axle of a car, middle of what "
        "steers by its sides",
        _AIRFRAME,
        "wheel_x",
    ),
    Parameter(
        "EKF2_WHL_TRACK", 0.4, 0.01, 5.0, "m", "distance of left and right measured wheels", _AIRFRAME, "wheel_track"
    ),
    Parameter(
        "EKF2_WHL_TOUT",
        120.0,
        0.0,
        3600.0,
        "s",
        "dead reckoning on wheels until position is invalid",
        "guess: 3 % of 120 s at 3 m/s are 11 m",
        "wheel_valid_s",
    ),
]
_DEFAULTS = ParameterTable(WHEEL_PARAMETERS)


def wheel_fields(table: ParameterTable) -> dict[str, float]:
    """Fields of `EstimatorParams` and their values in SI; the defaults if the table's vehicle has no wheels."""
    return (table if WHEEL_PARAMETERS[0].name in table else _DEFAULTS).fields(WHEEL_PARAMETERS)
