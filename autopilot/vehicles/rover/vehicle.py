"""The rover as a class of vehicles."""

from collections.abc import Callable, Sequence
from math import tan

from autopilot.estimator.wheel_params import WHEEL_PARAMETERS
from autopilot.interface.outputs import Output, OutputKind
from autopilot.interface.vehicle_state import Mode, VehicleState
from autopilot.vehicles.rover.ardupilot import APM_ROVER
from autopilot.vehicles.rover.defaults import rover_defaults
from autopilot.vehicles.rover.law import ROVER_LAW
from autopilot.vehicles.rover.modes.params import MODE_PARAMETERS
from autopilot.vehicles.rover.modes.table import ROVER_MODES
from autopilot.vehicles.rover.params import ROVER_PARAMETERS
from autopilot.vehicles.rover.stuck_watch import STUCK_PARAMETERS, StuckWatch
from autopilot.vehicles.vehicle_class import DriveParts, Lane, MotionLimits, Turning, VehicleClass
from common.airframes.rover import RoverAirframe
from common.geodesy import GRAVITY_M_S2
from common.params import ParameterTable

_MAV_TYPE_GROUND_ROVER = 10
_DIFFERENTIAL = 6  # CA_AIRFRAME
_BRAKE = Output("brake", OutputKind.SERVO)


def _outputs(airframe: RoverAirframe) -> Sequence[Output]:
    if airframe.is_skid:
        left, right = (Output(f"{side} motors", OutputKind.MOTOR, is_signed=True) for side in ("left", "right"))
        return (left, right, _BRAKE)
    steering = Output("steering", OutputKind.SERVO, is_signed=True)
    return (steering, Output("motor", OutputKind.MOTOR, is_signed=True), _BRAKE)


def _motors(airframe: RoverAirframe) -> Sequence[int]:
    return [i for i, output in enumerate(_outputs(airframe)) if output.kind is OutputKind.MOTOR]


def _lane(airframe: RoverAirframe) -> Lane:
    return Lane(airframe.hull.front_m, airframe.hull.rear_m, airframe.hull.half_width_m)


def _stuck_watch(parts: DriveParts) -> StuckWatch:
    return StuckWatch(parts.state, parts.params, ROVER_MODES, tuple(_motors(parts.airframe)))


def _standing_height_m(airframe: RoverAirframe) -> float:
    wheels = airframe.wheels
    sag_m = airframe.body.mass_kg * GRAVITY_M_S2 / (4.0 * wheels.spring_n_m)
    return wheels.hub_z_m + wheels.radius_m - sag_m


def _turning_radius_m(number: Callable[[str], float]) -> float:
    if number("CA_AIRFRAME") == _DIFFERENTIAL:
        return 0.0
    return number("RA_WHEEL_BASE") / max(tan(number("RA_MAX_STR_ANG")), 0.01)


def _can_drive(_: VehicleState, params: ParameterTable) -> str:
    """PX4's rovers stand still without these."""
    needed = ["RO_SPEED_LIM", "RO_MAX_THR_SPEED"]
    needed += ["RD_WHEEL_TRACK"] if params["CA_AIRFRAME"] == _DIFFERENTIAL else ["RA_WHEEL_BASE", "RA_MAX_STR_ANG"]
    missing = [name for name in needed if params[name] <= 0.0]
    return f"{missing[0]} must be above 0 for the rover to drive" if missing else ""


ROVER = VehicleClass(
    name="rover",
    law=ROVER_LAW,
    parameters=(*ROVER_PARAMETERS, *WHEEL_PARAMETERS, *STUCK_PARAMETERS, *MODE_PARAMETERS),
    defaults=rover_defaults,
    modes=ROVER_MODES,
    last_resort=Mode.HOLD,
    limits=MotionLimits(
        cruise_speed="RO_SPEED_LIM",
        speed_max="RO_SPEED_LIM",
        accel_hor="RO_DECEL_LIM",
        accel_across="HG_RO_LAT_ACC",
        jerk="RO_JERK_LIM",
        jerk_auto="RO_JERK_LIM",
        turning=Turning(radius=_turning_radius_m, gain="RA_ACC_RAD_GAIN", largest="RA_ACC_RAD_MAX"),
        path_error="HG_RO_HOLD_RAD",
        yaw_rate="RO_YAW_RATE_LIM",
    ),
    mav_type=lambda _: _MAV_TYPE_GROUND_ROVER,
    ardupilot=APM_ROVER,
    outputs=_outputs,
    motors=_motors,
    standing_height_m=_standing_height_m,
    arming_checks=(_can_drive,),
    lane=_lane,
    drive_watch=_stuck_watch,
)
