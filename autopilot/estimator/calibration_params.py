"""What calibrations of the sensors write, or a hand: offsets, and how compass and board are turned in the vehicle."""

from common.params import Parameter

_CALIBRATED = "calibration"


def _offset(sensor: str, axis: str, bound: float, unit: str, field: str) -> Parameter:
    meaning = f"what the {field} reads too much along {axis.lower()}"
    return Parameter(
        f"CAL_{sensor}0_{axis}OFF", 0.0, -bound, bound, unit, meaning, _CALIBRATED, f"{field}_offset_{axis.lower()}"
    )


def _turn(name: str, bound_deg: float, meaning: str, field: str) -> Parameter:
    return Parameter(name, 0.0, -bound_deg, bound_deg, "deg", meaning, _CALIBRATED, field)


CALIBRATION_PARAMETERS: list[Parameter] = [
    *(_offset("GYRO", axis, 0.5, "rad/s", "gyro") for axis in "XYZ"),
    *(_offset("ACC", axis, 5.0, "m/s^2", "accel") for axis in "XYZ"),
    *(_offset("MAG", axis, 2.0, "gauss", "mag") for axis in "XYZ"),
    _turn("CAL_MAG0_YAW", 180.0, "yaw of the compass in the vehicle", "mag_yaw"),
    _turn("SENS_BOARD_X_OFF", 45.0, "roll of the board in the vehicle", "board_roll"),
    _turn("SENS_BOARD_Y_OFF", 45.0, "pitch of the board in the vehicle", "board_pitch"),
    _turn("SENS_BOARD_Z_OFF", 45.0, "yaw of the board in the vehicle", "board_yaw"),
]
