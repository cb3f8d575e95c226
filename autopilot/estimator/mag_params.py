"""Parameters of the magnetometer's fusion."""

from common.params import Parameter

_PX4 = "PX4 default"
_TUNED = "tuned on simulated flights: innovations inside their 95 % band"

MAG_PARAMETERS: list[Parameter] = [
    Parameter("EKF2_MAG_TYPE", 0, 0, 5, "", "magnetometer use: 0 field states and heading, 5 none", _PX4, "mag_type"),
    Parameter(
        "EKF2_MAG_NOISE", 1.5e-4, 1.0e-5, 1.0, "gauss", "magnetometer noise", "RM3100 data sheet: 15 nT", "mag_noise"
    ),
    Parameter("EKF2_MAG_GATE", 5.0, 1.0, 50.0, "SD", "magnetometer gate", "3 in PX4, whose noise is wider", "mag_gate"),
    Parameter(
        "EKF2_MAG_E_NOISE",
        1.0e-5,
        0.0,
        0.1,
        "gauss/sqrt(s)",
        "random walk of the earth field",
        "1e-5 gauss per kilometre",
        "earth_field_walk",
    ),
    Parameter(
        "EKF2_MAG_B_NOISE",
        4.0e-4,
        0.0,
        0.1,
        "gauss/sqrt(s)",
        "random walk of the body field",
        _TUNED,
        "body_field_walk",
    ),
    Parameter(
        "EKF2_MAG_B_INIT", 5.0e-3, 0.0, 0.3, "gauss", "body field left after calibration", "guess", "body_field_init"
    ),
    Parameter(
        "EKF2_MAG_CHECK",
        3,
        0,
        3,
        "",
        "a field that is not that of the place is not used, by: 1 strength, 2 inclination",
        "PX4's numbers; its default is 1",
        "mag_check",
    ),
    Parameter(
        "EKF2_MAG_CHK_STR", 0.2, 0.0, 1.0, "gauss", "largest error of the field's strength", _PX4, "mag_check_strength"
    ),
    Parameter(
        "EKF2_MAG_CHK_INC",
        20.0,
        0.0,
        90.0,
        "deg",
        "largest error of the field's inclination",
        _PX4,
        "mag_check_inclination",
    ),
]
