"""Parameters of the cascade, their defaults, and the kernel struct they fill.

Gains of the rate loops are in units of angular acceleration, those of the velocity loops in units of acceleration,
so that they carry over between airframes with similar motors. `python -m autopilot.tuning` designs and checks them.
"""

from collections.abc import Mapping

import warp as wp

from common.params import Parameter, ParameterTable

wp.set_module_options({"enable_backward": False})


@wp.struct
class ControlParams:
    pos_p_xy: float  # [1/s]
    pos_p_z: float
    vel_p_xy: float  # [1/s]
    vel_i_xy: float  # [1/s²]
    vel_d_xy: float  # [1]
    vel_p_z: float
    vel_i_z: float
    vel_d_z: float
    accel_cutoff_hz: float
    disturbance_cutoff_hz: float
    speed_max_xy: float  # [m/s]
    speed_max_up: float
    speed_max_down: float
    cruise_speed: float
    climb_speed: float
    descend_speed: float
    accel_max_xy: float  # [m/s²]
    accel_max_up: float
    accel_max_down: float
    jerk_path: float  # [m/s³]
    jerk_direct: float
    lag_max_m: float
    tilt_max: float  # [rad]
    tilt_max_ramp: float  # [rad] while the thrust of a take-off grows
    thrust_min: float  # fraction of the maximum
    thrust_max: float
    takeoff_ramp_s: float
    yaw_rate_auto: float  # [rad/s]
    yaw_accel_auto: float  # [rad/s²]
    yaw_rate_time_s: float
    att_p_roll: float  # [1/s]
    att_p_pitch: float
    att_p_yaw: float
    rate_max_roll: float  # [rad/s]
    rate_max_pitch: float
    rate_max_yaw: float
    rate_p_tilt: float  # [1/s] roll and pitch
    rate_i_tilt: float  # [1/s²]
    rate_d_tilt: float  # [1]
    rate_p_yaw: float
    rate_i_yaw: float
    rate_d_yaw: float
    rate_integral_max_tilt: float  # [rad/s²]
    rate_integral_max_yaw: float
    gyro_cutoff_hz: float
    gyro_rate_cutoff_hz: float


_TUNED = "python -m autopilot.tuning --airframe x500"
_PX4 = "PX4 1.15 default"

CONTROL_PARAMETERS: list[Parameter] = [
    Parameter("MPC_XY_P", 1.9, 0.1, 6.0, "1/s", "position to velocity, horizontal", _TUNED, "pos_p_xy"),
    Parameter("MPC_Z_P", 2.4, 0.1, 6.0, "1/s", "position to velocity, vertical", _TUNED, "pos_p_z"),
    Parameter("MPC_XY_VEL_P_ACC", 4.0, 0.5, 15.0, "1/s", "velocity to acceleration", _TUNED, "vel_p_xy"),
    Parameter("MPC_XY_VEL_I_ACC", 1.3, 0.0, 60.0, "1/s^2", "velocity integral to acceleration", _TUNED, "vel_i_xy"),
    Parameter("MPC_XY_VEL_D_ACC", 0.1, 0.0, 2.0, "", "acceleration error to acceleration", _TUNED, "vel_d_xy"),
    Parameter("MPC_Z_VEL_P_ACC", 6.0, 0.5, 15.0, "1/s", "velocity to acceleration", _TUNED, "vel_p_z"),
    Parameter("MPC_Z_VEL_I_ACC", 2.0, 0.0, 60.0, "1/s^2", "velocity integral to acceleration", _TUNED, "vel_i_z"),
    Parameter("MPC_Z_VEL_D_ACC", 0.0, 0.0, 2.0, "", "acceleration error to acceleration", _TUNED, "vel_d_z"),
    Parameter(
        "MPC_ACC_CUTOFF", 5.0, 0.5, 50.0, "Hz", "low-pass of the D term's acceleration", "guess", "accel_cutoff_hz"
    ),
    Parameter(
        "MPC_DIST_CUTOFF",
        2.0,
        0.0,
        10.0,
        "Hz",
        "bandwidth of the disturbance observer, 0: off",
        "guess",
        "disturbance_cutoff_hz",
    ),
    Parameter("MPC_XY_VEL_MAX", 12.0, 0.5, 20.0, "m/s", "horizontal speed limit", _PX4, "speed_max_xy"),
    Parameter("MPC_Z_VEL_MAX_UP", 3.0, 0.5, 8.0, "m/s", "climb speed limit", _PX4, "speed_max_up"),
    Parameter("MPC_Z_VEL_MAX_DN", 1.5, 0.5, 4.0, "m/s", "descent speed limit", _PX4, "speed_max_down"),
    Parameter("MPC_XY_CRUISE", 5.0, 0.5, 20.0, "m/s", "speed in missions and to positions", _PX4, "cruise_speed"),
    Parameter("MPC_Z_V_AUTO_UP", 3.0, 0.5, 8.0, "m/s", "climb speed in auto modes", _PX4, "climb_speed"),
    Parameter("MPC_Z_V_AUTO_DN", 1.5, 0.5, 4.0, "m/s", "descent speed in auto modes", _PX4, "descend_speed"),
    Parameter("MPC_ACC_HOR", 4.0, 1.0, 15.0, "m/s^2", "acceleration along and across the way", "guess", "accel_max_xy"),
    Parameter("MPC_ACC_UP_MAX", 4.0, 2.0, 15.0, "m/s^2", "upward acceleration", _PX4, "accel_max_up"),
    Parameter("MPC_ACC_DOWN_MAX", 3.0, 2.0, 9.0, "m/s^2", "downward acceleration", _PX4, "accel_max_down"),
    Parameter("MPC_JERK_AUTO", 8.0, 1.0, 80.0, "m/s^3", "jerk on mission legs", "guess", "jerk_path"),
    Parameter("MPC_JERK_MAX", 20.0, 0.5, 500.0, "m/s^3", "jerk to positions and velocities", "guess", "jerk_direct"),
    Parameter("MPC_XY_ERR_MAX", 2.0, 0.1, 10.0, "m", "lag behind the trajectory at which it waits", _PX4, "lag_max_m"),
    Parameter("MPC_TILTMAX_AIR", 45.0, 20.0, 70.0, "deg", "tilt limit", _PX4, "tilt_max"),
    Parameter(
        "MPC_TILTMAX_LND", 12.0, 5.0, 70.0, "deg", "tilt limit while a take-off's thrust grows", _PX4, "tilt_max_ramp"
    ),
    Parameter("MPC_THR_MIN", 0.08, 0.0, 0.3, "norm", "least collective thrust in flight", "guess", "thrust_min"),
    Parameter("MPC_THR_MAX", 1.0, 0.5, 1.0, "norm", "greatest collective thrust", _PX4, "thrust_max"),
    Parameter("MPC_TKO_RAMP_T", 0.6, 0.0, 5.0, "s", "from idle to full thrust at take-off", "guess", "takeoff_ramp_s"),
    Parameter("MPC_YAWRAUTO_MAX", 60.0, 5.0, 360.0, "deg/s", "yaw rate of the yaw setpoint", _PX4, "yaw_rate_auto"),
    Parameter(
        "MPC_YAWRAUTO_ACC",
        90.0,
        5.0,
        360.0,
        "deg/s^2",
        "yaw acceleration of the yaw setpoint",
        "guess",
        "yaw_accel_auto",
    ),
    Parameter("MPC_MAN_Y_TAU", 0.08, 0.0, 5.0, "s", "time in which a yaw rate is taken up", _PX4, "yaw_rate_time_s"),
    Parameter("MC_ROLL_P", 8.0, 1.0, 20.0, "1/s", "attitude to rate, roll", _TUNED, "att_p_roll"),
    Parameter("MC_PITCH_P", 8.0, 1.0, 20.0, "1/s", "attitude to rate, pitch", _TUNED, "att_p_pitch"),
    Parameter("MC_YAW_P", 3.0, 0.5, 10.0, "1/s", "attitude to rate, yaw", _TUNED, "att_p_yaw"),
    Parameter("MC_ROLLRATE_MAX", 220.0, 10.0, 1800.0, "deg/s", "roll rate limit", _PX4, "rate_max_roll"),
    Parameter("MC_PITCHRATE_MAX", 220.0, 10.0, 1800.0, "deg/s", "pitch rate limit", _PX4, "rate_max_pitch"),
    Parameter("MC_YAWRATE_MAX", 200.0, 10.0, 1800.0, "deg/s", "yaw rate limit", _PX4, "rate_max_yaw"),
    Parameter(
        "MC_RPRATE_P_ACC",
        25.0,
        1.0,
        100.0,
        "1/s",
        "rate to angular acceleration, roll and pitch",
        _TUNED,
        "rate_p_tilt",
    ),
    Parameter("MC_RPRATE_I_ACC", 62.0, 0.0, 500.0, "1/s^2", "rate integral, roll and pitch", _TUNED, "rate_i_tilt"),
    Parameter("MC_RPRATE_D_ACC", 0.32, 0.0, 2.0, "", "angular acceleration, roll and pitch", _TUNED, "rate_d_tilt"),
    Parameter("MC_YAWRATE_P_ACC", 10.0, 0.5, 100.0, "1/s", "rate to angular acceleration, yaw", _TUNED, "rate_p_yaw"),
    Parameter("MC_YAWRATE_I_ACC", 10.0, 0.0, 500.0, "1/s^2", "rate integral, yaw", _TUNED, "rate_i_yaw"),
    Parameter("MC_YAWRATE_D_ACC", 0.0, 0.0, 2.0, "", "angular acceleration, yaw", _TUNED, "rate_d_yaw"),
    Parameter(
        "MC_RPR_INT_LIM",
        30.0,
        0.0,
        200.0,
        "rad/s^2",
        "bound of the roll and pitch rate integral",
        "guess",
        "rate_integral_max_tilt",
    ),
    Parameter(
        "MC_YR_INT_LIM", 5.0, 0.0, 200.0, "rad/s^2", "bound of the yaw rate integral", "guess", "rate_integral_max_yaw"
    ),
    Parameter("IMU_GYRO_CUTOFF", 80.0, 5.0, 1000.0, "Hz", "low-pass of the body rates", "guess", "gyro_cutoff_hz"),
    Parameter(
        "IMU_DGYRO_CUTOFF", 30.0, 5.0, 1000.0, "Hz", "low-pass of the rates' derivative", _PX4, "gyro_rate_cutoff_hz"
    ),
]


def control_params(fields: Mapping[str, float] | None = None) -> ControlParams:
    """The kernel struct with the given SI fields; the declared defaults for those not given."""
    defaults = ParameterTable(CONTROL_PARAMETERS).fields(CONTROL_PARAMETERS)
    row = ControlParams()
    for name, value in {**defaults, **(fields or {})}.items():
        setattr(row, name, value)
    return row
