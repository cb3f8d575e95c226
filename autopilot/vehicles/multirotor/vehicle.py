"""The multirotor as a class of vehicles."""

from collections.abc import Sequence
from math import atan2, pi

from autopilot.interface.outputs import Output, OutputKind
from autopilot.interface.vehicle_state import Mode, VehicleState
from autopilot.ports import HEIGHT_VALID
from autopilot.vehicles.multirotor.ardupilot import COPTER
from autopilot.vehicles.multirotor.control_airframe import rotors_leaver
from autopilot.vehicles.multirotor.defaults import airframe_defaults, hover_thrust
from autopilot.vehicles.multirotor.landing_detector import LANDING_DETECTOR_PARAMETERS, LandingDetector
from autopilot.vehicles.multirotor.law import MULTIROTOR_LAW
from autopilot.vehicles.multirotor.mode_params import MODE_PARAMETERS
from autopilot.vehicles.multirotor.modes import MULTIROTOR_MODES
from autopilot.vehicles.multirotor.motor_failures import MOTOR_WATCH_PARAMETERS, MotorWatch
from autopilot.vehicles.multirotor.params import CONTROL_PARAMETERS
from autopilot.vehicles.vehicle_class import (
    DriveParts,
    GroundHandling,
    MotionLimits,
    VehicleClass,
    VerticalLimits,
)
from common.airframes.multirotor import MultirotorAirframe
from common.params import ParameterTable

_MAV_TYPES = {3: 15, 4: 2, 6: 13, 8: 14}  # MAV_TYPE_TRICOPTER, _QUADROTOR, _HEXAROTOR, _OCTOROTOR
_MAV_TYPE_QUADROTOR = 2


def _landing_detector(params: ParameterTable, airframe: MultirotorAirframe) -> LandingDetector:
    return LandingDetector(params, hover_thrust(airframe), airframe.contact.leg_z_m)


def _mav_type(airframe: MultirotorAirframe) -> int:
    return _MAV_TYPES.get(len(airframe.rotors), _MAV_TYPE_QUADROTOR)


_LIMITS = MotionLimits(
    cruise_speed="MPC_XY_CRUISE",
    speed_max="MPC_XY_VEL_MAX",
    accel_hor="MPC_ACC_HOR",
    jerk="MPC_JERK_MAX",
    jerk_auto="MPC_JERK_AUTO",
    vertical=VerticalLimits(
        climb_speed="MPC_Z_V_AUTO_UP",
        descend_speed="MPC_Z_V_AUTO_DN",
        climb_max="MPC_Z_VEL_MAX_UP",
        descend_max="MPC_Z_VEL_MAX_DN",
        accel_up="MPC_ACC_UP_MAX",
        accel_down="MPC_ACC_DOWN_MAX",
        alt_radius="NAV_MC_ALT_RAD",
    ),
    path_error="MPC_XY_ERR_MAX",
    yaw_rate="MPC_YAWRAUTO_MAX",
)
_GROUND = GroundHandling(
    detector=_landing_detector,
    lift_thrust=hover_thrust,
    takeoff_speed="MPC_TKO_SPEED",
    land_speed="MPC_LAND_SPEED",
    crawl_speed="MPC_LAND_CRWL",
    slowing_height="MPC_LAND_ALT1",
    slow_height="MPC_LAND_ALT2",
    crawl_height="MPC_LAND_ALT3",
)


def _height(state: VehicleState, _: ParameterTable) -> str:
    return "" if state.estimate.flags & HEIGHT_VALID else "estimator: no valid height"


def _outputs(airframe: MultirotorAirframe) -> Sequence[Output]:
    return [Output(f"motor {rotor + 1}", OutputKind.MOTOR) for rotor in range(len(airframe.rotors))]


def _clockwise(airframe: MultirotorAirframe) -> Sequence[int]:
    angles = [atan2(rotor.y_m, rotor.x_m) % (2.0 * pi) for rotor in airframe.rotors]
    return sorted(range(len(angles)), key=lambda rotor: round(angles[rotor], 6))


def _motor_watch(parts: DriveParts) -> MotorWatch:
    row = parts.airframe_row
    leave_out = None if row is None else rotors_leaver(row, parts.airframe)
    return MotorWatch(parts.state, parts.params, parts.announcer, parts.airframe, parts.read_speeds, leave_out)


MULTIROTOR = VehicleClass(
    name="multirotor",
    law=MULTIROTOR_LAW,
    parameters=(*CONTROL_PARAMETERS, *MODE_PARAMETERS, *LANDING_DETECTOR_PARAMETERS, *MOTOR_WATCH_PARAMETERS),
    defaults=airframe_defaults,
    modes=MULTIROTOR_MODES,
    last_resort=Mode.LAND,
    limits=_LIMITS,
    mav_type=_mav_type,
    ardupilot=COPTER,
    outputs=_outputs,
    motors=_clockwise,
    standing_height_m=lambda airframe: airframe.contact.leg_z_m,
    ground=_GROUND,
    yaw_mode_param="MPC_YAW_MODE",
    arming_checks=(_height,),
    drive_watch=_motor_watch,
)
