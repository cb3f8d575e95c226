"""Parameters of a rover's control law, their defaults, and the kernel struct they fill: PX4's names and units.

`python -m autopilot.tuning --airframe rover` designs the gains and checks them.
"""

from collections.abc import Mapping

import warp as wp

from common.params import Parameter, ParameterTable

wp.set_module_options({"enable_backward": False})


@wp.struct
class RoverParams:
    speed_limit: float  # [m/s]
    throttle_speed: float  # [m/s] at full throttle and full battery
    accel_limit: float  # [m/s²]
    decel_limit: float
    jerk_limit: float  # [m/s³]
    speed_p: float  # [1]
    speed_i: float  # [1/s]
    stop_speed: float  # [m/s]
    speed_reduction: float  # of the speed at a course error of half a turn
    yaw_p: float  # [1/s]
    yaw_rate_p: float  # [1]
    yaw_rate_i: float  # [1/s]
    yaw_rate_limit: float  # [rad/s]
    yaw_rate_correction: float
    yaw_accel_limit: float  # [rad/s²] 0 or less: none, as of the three above
    yaw_decel_limit: float
    still_yaw_rate: float  # [rad/s]
    lateral_accel: float  # [m/s²]
    lookahead_s: float
    lookahead_min: float  # [m]
    lookahead_max: float
    wheel_base: float  # [m]
    steering_max: float  # [rad]
    steering_rate: float  # [rad/s]
    wheel_track: float  # [m]
    turn_from: float  # [rad] course error at which a skid-steer rover stops to turn on the spot
    turn_until: float  # [rad] at which it drives on
    hold_radius: float  # [m]


_TUNED = "python -m autopilot.tuning --airframe rover"
_PX4 = "PX4 1.16 default"
_AIRFRAME = "airframe file"

ROVER_PARAMETERS: list[Parameter] = [
    Parameter("RO_SPEED_LIM", 5.0, -1.0, 30.0, "m/s", "greatest speed, and that of missions; 0 or less: does not drive",
              "guess", "speed_limit"),
    Parameter("RO_MAX_THR_SPEED", 8.0, 0.0, 100.0, "m/s", "speed at full throttle; 0: does not drive", _AIRFRAME,
              "throttle_speed"),
    Parameter("RO_ACCEL_LIM", 2.5, -1.0, 100.0, "m/s^2", "acceleration; 0 or less: any",
              "guess", "accel_limit"),
    Parameter("RO_DECEL_LIM", 2.5, -1.0, 100.0, "m/s^2", "deceleration; 0 or less: any", "guess", "decel_limit"),
    Parameter("RO_JERK_LIM", 20.0, -1.0, 1000.0, "m/s^3", "change of acceleration; 0 or less: any", "guess",
              "jerk_limit"),
    Parameter("RO_SPEED_P", 2.0, 0.0, 20.0, "", "speed error to speed asked of the motor", _TUNED, "speed_p"),
    Parameter("RO_SPEED_I", 3.1, 0.0, 20.0, "1/s", "its integral", _TUNED, "speed_i"),
    Parameter("RO_SPEED_TH", 0.1, 0.0, 2.0, "m/s", "slower than this counts as standing", _PX4, "stop_speed"),
    Parameter("RO_SPEED_RED", 1.0, -1.0, 1.0, "",
              "part of the speed that is taken off at a course error of half a turn, and less for less; negative: none",
              "guess", "speed_reduction"),
    Parameter("RO_YAW_P", 3.0, 0.0, 10.0, "1/s", "heading to yaw rate", _TUNED, "yaw_p"),
    Parameter("RO_YAW_RATE_P", 0.5, 0.0, 10.0, "", "yaw rate error to yaw rate asked of the steering", _TUNED,
              "yaw_rate_p"),
    Parameter("RO_YAW_RATE_I", 2.0, 0.0, 20.0, "1/s", "its integral", _TUNED, "yaw_rate_i"),
    Parameter("RO_YAW_RATE_LIM", 130.0, 0.0, 720.0, "deg/s", "greatest yaw rate", "PX4 gz_rover_ackermann",
              "yaw_rate_limit"),
    Parameter("RO_YAW_RATE_CORR", 1.0, 0.01, 100.0, "", "yaw rate without slip over the real one", _AIRFRAME,
              "yaw_rate_correction"),
    Parameter("RO_YAW_ACCEL_LIM", 400.0, -1.0, 10_000.0, "deg/s^2", "growth of the yaw rate; 0 or less: any", "guess",
              "yaw_accel_limit"),
    Parameter("RO_YAW_DECEL_LIM", 400.0, -1.0, 10_000.0, "deg/s^2", "its decline; 0 or less: any", "guess",
              "yaw_decel_limit"),
    Parameter("RO_YAW_RATE_TH", 3.0, 0.0, 100.0, "deg/s", "slower than this counts as not turning", _PX4,
              "still_yaw_rate"),
    Parameter("RO_YAW_STICK_DZ", 0.1, 0.0, 1.0, "", "part of the stick's way round the middle that steers nothing",
              _PX4),
    Parameter("HG_RO_LAT_ACC", 3.0, 0.1, 20.0, "m/s^2", "lateral acceleration in turns", "guess: a third of the grip",
              "lateral_accel"),
    Parameter("HG_RO_HOLD_RAD", 0.4, 0.1, 100.0, "m", "distance from a place held at which the rover drives back",
              "guess", "hold_radius"),
    Parameter("HG_RO_OFFB_BODY", 0, 0, 1, "",
              "Offboard: 0 as PX4, a velocity is a course and a speed forward; 1: along the nose, backwards too, and "
              "yaw and yaw rate are followed", _PX4),
    Parameter("PP_LOOKAHD_GAIN", 0.7, 0.1, 100.0, "s", "look-ahead over speed", "guess", "lookahead_s"),
    Parameter("PP_LOOKAHD_MIN", 0.8, 0.1, 100.0, "m", "least look-ahead", "guess", "lookahead_min"),
    Parameter("PP_LOOKAHD_MAX", 10.0, 0.1, 100.0, "m", "greatest look-ahead", _PX4, "lookahead_max"),
    Parameter("RA_WHEEL_BASE", 0.5, 0.0, 100.0, "m", "front to rear axle", _AIRFRAME, "wheel_base"),
    Parameter("RA_MAX_STR_ANG", 0.5236, 0.0, 1.5708, "rad", "greatest steering angle", _AIRFRAME, "steering_max"),
    Parameter("RA_STR_RATE_LIM", 360.0, -1.0, 1000.0, "deg/s", "rate of the steering; negative: any", _AIRFRAME,
              "steering_rate"),
    Parameter("RA_ACC_RAD_MAX", 3.0, -1.0, 100.0, "m",
              "greatest radius in which a waypoint at a corner counts as passed; negative: NAV_ACC_RAD always",
              "guess"),
    Parameter("RA_ACC_RAD_GAIN", 1.0, 1.0, 100.0, "", "factor on the radius that the corner asks for", _PX4),
    Parameter("RD_WHEEL_TRACK", 0.36, 0.0, 100.0, "m", "between the left and the right wheels", _AIRFRAME,
              "wheel_track"),
    Parameter("RD_TRANS_DRV_TRN", 0.1745, 0.001, 3.1416, "rad",
              "course error at which a skid-steer rover stops to turn on the spot", _PX4, "turn_from"),
    Parameter("RD_TRANS_TRN_DRV", 0.0873, 0.001, 3.1416, "rad", "course error at which it drives on", _PX4,
              "turn_until"),
    Parameter("CA_AIRFRAME", 5, 0, 20, "", "5 a car with Ackermann steering, 6 a differential drive", _AIRFRAME),
    Parameter("CA_R_REV", 1, 0, 255, "", "motors that turn backwards, as bits", _AIRFRAME),
]  # fmt: skip


def rover_params(fields: Mapping[str, float] | None = None) -> RoverParams:
    """The kernel struct with the given SI fields; the declared defaults for those not given."""
    defaults = ParameterTable(ROVER_PARAMETERS).fields(ROVER_PARAMETERS)
    row = RoverParams()
    for name, value in {**defaults, **(fields or {})}.items():
        setattr(row, name, value)
    return row
