"""What ArduPilot has to know of our vehicle: its own parameters, from the airframe file."""

from collections.abc import Mapping

from common.airframe import Airframe
from common.airframes.multirotor import MultirotorAirframe
from common.airframes.plane import PlaneAirframe
from common.airframes.rover import RoverAirframe
from common.geodesy import GRAVITY_M_S2
from mission.boards.ardupilot_plane import plane_params

_FRAMES = {4: 1, 6: 2, 8: 3}  # ArduPilot's FRAME_CLASS by the number of motors
_FRAME_X = 1
_CRUISE_M_S = 2.0  # guess: half of what a rover of ours does on rough ground


IDS = ("MAV_SYSID", "SYSID_THISMAV", "MAV_SYS_ID")
"""Names of a vehicle's number: ArduPilot's since 4.7 and before, and PX4's."""


def check_id_free(parameters: Mapping[str, float]) -> None:
    """Refuses a number of the vehicle that is not its instance's: nobody would hear it.

    Raises:
        ValueError: one is given.
    """
    for name in IDS:
        if name in parameters:
            raise ValueError(f"--param {name}: the number of the vehicle follows from its instance, leave it out")


def value_text(value: float) -> str:
    """As a program reads it: all digits of an integer, and of what single precision holds."""
    return f"{int(value)}" if value == int(value) else f"{value:.9g}"


def ardupilot_params(airframe: Airframe) -> dict[str, float]:
    """By ArduPilot's names."""
    quiet = {f"SIM_{sensor}{k}_RND": 0.0 for sensor in ("ACC", "GYR") for k in (1, 2)}  # the IMU's noise is ours
    downward = {"RNGFND1_TYPE": 100.0, "RNGFND1_ORIENT": 25.0}
    downward |= {"RNGFND1_MAX_CM": 4000.0, "RNGFND1_MAX": 40.0}  # as it was called, and is called since 4.7
    if isinstance(airframe, MultirotorAirframe):
        return quiet | downward | _ardupilot_copter(airframe)
    if isinstance(airframe, RoverAirframe):
        return quiet | _ardupilot_rover(airframe)
    if isinstance(airframe, PlaneAirframe):
        return quiet | downward | plane_params(airframe)
    return quiet


def _ardupilot_copter(airframe: MultirotorAirframe) -> dict[str, float]:
    idle = airframe.rotor_model.idle_command
    if len(airframe.rotors) not in _FRAMES:
        raise ValueError(f"ArduPilot flies frames in X of {', '.join(map(str, _FRAMES))} motors here")
    return {
        "FRAME_CLASS": float(_FRAMES[len(airframe.rotors)]),
        "FRAME_TYPE": float(_FRAME_X),
        "MOT_THST_EXPO": thrust_curve(airframe),
        "MOT_SPIN_MIN": idle,
        "MOT_SPIN_ARM": 0.7 * idle,
        "MOT_THST_HOVER": hover_fraction(airframe),
        "AUTO_OPTIONS": 3.0,  # armed in AUTO, and off the ground without a throttle stick: there is none
        # Velocities of a companion are followed as such and quickly, as our own controller does
        "GUID_OPTIONS": 16.0,  # no position is held that they would lead to
        "WPNAV_ACCEL": 400.0,  # [cm/s²] MPC_ACC_HOR
        "PSC_JERK_XY": 20.0,  # [m/s³] MPC_JERK_MAX
    }


def _ardupilot_rover(airframe: RoverAirframe) -> dict[str, float]:
    top_m_s = airframe.drive.max_speed_m_s
    params = {"CRUISE_SPEED": _CRUISE_M_S, "CRUISE_THROTTLE": 100.0 * _CRUISE_M_S / top_m_s, "WP_SPEED": _CRUISE_M_S}
    if airframe.is_skid:
        params |= {"SERVO1_FUNCTION": 73.0, "SERVO3_FUNCTION": 74.0}
    return params


def thrust_curve(airframe: MultirotorAirframe) -> float:
    """Of thrust over command: 0 linear, 1 quadratic, as both of them count it."""
    return float(airframe.rotor_model.command_curve)


def hover_fraction(airframe: MultirotorAirframe) -> float:
    """Thrust in hover over the largest."""
    rotors = airframe.rotor_model
    largest_n = len(airframe.rotors) * rotors.thrust_n_s2 * rotors.max_speed_rad_s**2
    return round(float(airframe.body.mass_kg * GRAVITY_M_S2 / largest_n), 3)
