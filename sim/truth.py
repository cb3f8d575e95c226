"""The truth about a body, whatever it is and whoever moves it: all that sensors, cameras, logs, tasks and viewers read.

An engine writes one row per vehicle after each tick; nobody else does. What an engine needs besides to go on (the
charge of a battery, the slip of a foot) is its own.
"""

import warp as wp

from autopilot.estimator.airspeed import with_airspeed
from autopilot.estimator.state import AirspeedCheck
from autopilot.ports import (
    HEIGHT_VALID,
    POSITION_VALID,
    TILT_ALIGNED,
    VELOCITY_VALID,
    YAW_ALIGNED,
    AirspeedSample,
    BatterySample,
    Estimate,
)
from common.geodesy import GRAVITY_M_S2
from common.kernels import tick_end_us, vec8

wp.set_module_options({"enable_backward": False})


@wp.struct
class Truth:
    """The true state of one vehicle at the end of a tick."""

    pos_ned: wp.vec3  # [m]
    vel_ned: wp.vec3  # [m/s]
    q_ned_from_frd: wp.quat
    omega_frd: wp.vec3  # [rad/s]
    accel_frd: wp.vec3  # [m/s²] specific force, mean over the tick
    gyro_frd: wp.vec3  # [rad/s] mean over the tick
    motor_speed: vec8  # [rad/s] of propellers or wheels; they shake the IMU, and their controllers report them
    has_wheels: int  # 0: it stands on feet, and has no encoders
    wheel_speed_m_s: wp.vec2  # of the treads, left and right, where the encoders are; positive forward
    steering_rad: float  # angle of the steered wheels to the right, of a bicycle between them
    has_pitot: int  # 0: it measures no airspeed
    pitot_pa: float  # dynamic pressure along the nose
    height_agl_m: float  # of the centre of gravity over the ground below
    battery_voltage_v: float
    battery_current_a: float
    is_on_ground: int  # a foot or a wheel touches
    is_crashed: int  # for good
    impact_speed: float  # [m/s] largest speed along a contact normal so far


@wp.func
def true_estimate(truth: Truth, tick: wp.int64) -> Estimate:
    """The true state in the place of an estimate."""
    estimate = Estimate()
    estimate.time_us = tick_end_us(tick)
    estimate.flags = TILT_ALIGNED | YAW_ALIGNED | VELOCITY_VALID | POSITION_VALID | HEIGHT_VALID
    estimate.q_ned_from_frd = truth.q_ned_from_frd
    estimate.omega_frd = truth.omega_frd
    estimate.accel_frd = truth.accel_frd
    estimate.vel_ned = truth.vel_ned
    estimate.pos_ned = truth.pos_ned
    estimate.accel_ned = wp.quat_rotate(truth.q_ned_from_frd, truth.accel_frd) + wp.vec3(0.0, 0.0, GRAVITY_M_S2)
    if truth.has_pitot == 1:
        sample = AirspeedSample()
        sample.time_us = estimate.time_us
        sample.pressure_pa = truth.pitot_pa
        estimate = with_airspeed(estimate, AirspeedCheck(), sample)
    return estimate


@wp.func
def true_battery(truth: Truth, tick: wp.int64) -> BatterySample:
    """The true battery in the place of a sample."""
    battery = BatterySample()
    battery.time_us = tick_end_us(tick)
    battery.voltage_v = truth.battery_voltage_v
    battery.current_a = truth.battery_current_a
    return battery


@wp.func
def has_touched(truth: Truth) -> bool:
    """Whether a vehicle touches, or has touched, anything solid since its impacts were forgotten."""
    return truth.impact_speed > 0.0 or truth.is_on_ground == 1 or truth.is_crashed == 1
