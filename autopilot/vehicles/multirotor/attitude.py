"""Attitude loop: thrust direction and heading to an attitude quaternion, its error to body rates, 250 Hz.

The error is split into tilt and heading (Brescianini, Hehn and D'Andrea 2013, "Nonlinear quadrocopter attitude
control"), because tilt moves the vehicle and is fast, heading is neither.
"""

import warp as wp

from autopilot.vehicles.multirotor.params import ControlParams
from common.vectors import clamp3

wp.set_module_options({"enable_backward": False})

_SMALL = wp.constant(1.0e-5)


@wp.func
def attitude_from_thrust(thrust_ned: wp.vec3, yaw: float) -> wp.quat:
    """The attitude whose -z axis points along a thrust vector and whose x axis has the heading `yaw` [rad]."""
    down = -wp.normalize(thrust_ned)
    right = wp.vec3(-wp.sin(yaw), wp.cos(yaw), 0.0)
    forward = wp.cross(right, down)
    if wp.length(forward) < _SMALL:
        forward = wp.vec3(wp.cos(yaw), wp.sin(yaw), 0.0)
    forward = wp.normalize(forward)
    right = wp.cross(down, forward)
    axes = wp.mat33(forward[0], right[0], down[0], forward[1], right[1], down[1], forward[2], right[2], down[2])
    return wp.normalize(wp.quat_from_matrix(axes))


@wp.func
def angle_per_half_sine(half_sine: float, half_cosine: float) -> float:
    """An angle [rad] over the sine of its half, for a half angle in [0, pi / 2].

    Up to 30 deg by the series of the arcsine (error below 1e-6), which is several times faster than the arctangent.
    """
    square = half_sine * half_sine
    if half_cosine > 0.966:
        return 2.0 + square * (1.0 / 3.0 + square * (3.0 / 20.0 + square * (5.0 / 56.0)))
    return 2.0 * wp.atan2(half_sine, half_cosine) / half_sine


@wp.func
def attitude_error(q_ned_from_frd: wp.quat, q_sp_ned_from_frd: wp.quat) -> wp.vec3:
    """Attitude error [rad], frd: x and y turn the body z axis to the wanted one the shortest way, z is the turn left.

    The error quaternion is split as tilt * turn, with turn about z: turn = (0, 0, z, w) / sqrt(z² + w²).
    """
    q = wp.quat_inverse(q_ned_from_frd) * q_sp_ned_from_frd
    if q[3] < 0.0:
        q = -q
    tilt_cosine = wp.sqrt(q[2] * q[2] + q[3] * q[3])  # of half the tilt
    tilt_sine = wp.sqrt(q[0] * q[0] + q[1] * q[1])
    if tilt_cosine < _SMALL:
        return wp.vec3(wp.pi, 0.0, 0.0)  # upside down: any way is as short
    tilt = angle_per_half_sine(tilt_sine, tilt_cosine) / tilt_cosine
    turn_sine = q[2] / tilt_cosine
    turn = turn_sine * angle_per_half_sine(wp.abs(turn_sine), q[3] / tilt_cosine)
    return wp.vec3(tilt * (q[3] * q[0] - q[1] * q[2]), tilt * (q[3] * q[1] + q[0] * q[2]), turn)


@wp.func
def turned(q_ned_from_frd: wp.quat, omega_ned: wp.vec3, dt_s: float) -> wp.quat:
    """The attitude turned at `omega_ned` [rad/s] for a step so short that first order in the angle does."""
    half = wp.quat(0.5 * dt_s * omega_ned[0], 0.5 * dt_s * omega_ned[1], 0.5 * dt_s * omega_ned[2], 0.0)
    return wp.normalize(q_ned_from_frd + half * q_ned_from_frd)


@wp.func
def rate_lags_s(params: ControlParams) -> wp.vec3:
    """How late roll and pitch rates follow their setpoints [s], frd: of their gains, whatever the motors' lag.

    A heading turns for seconds, in which the rate integral makes up for its lag.
    """
    tilt = (1.0 + params.rate_d_tilt) / wp.max(params.rate_p_tilt, 1.0)
    return wp.vec3(tilt, tilt, 0.0)


@wp.func
def rate_setpoint(
    params: ControlParams, q_ned_from_frd: wp.quat, q_sp_ned_from_frd: wp.quat, omega_feed_ned: wp.vec3
) -> wp.vec3:
    """Body rates [rad/s], frd, that close the attitude error, plus the rate at which the setpoint itself turns.

    The error is that to where a setpoint that turns so was as long ago as rates lag: the rate loop cannot be earlier,
    and what it made up for it would have to make up for again, the other way round, when the setpoint stops.
    """
    gain = wp.vec3(params.att_p_roll, params.att_p_pitch, params.att_p_yaw)
    feed = wp.quat_rotate_inv(q_ned_from_frd, omega_feed_ned)
    error = attitude_error(q_ned_from_frd, q_sp_ned_from_frd) - wp.cw_mul(rate_lags_s(params), feed)
    rate = wp.cw_mul(gain, error) + feed
    return clamp3(rate, wp.vec3(params.rate_max_roll, params.rate_max_pitch, params.rate_max_yaw))


@wp.func
def thrust_turn_rate(thrust_ned: wp.vec3, jerk_ned: wp.vec3) -> wp.vec3:
    """Angular rate [rad/s], ned, of the direction of a thrust vector [m/s²] that changes with `jerk_ned`."""
    size = wp.max(wp.length(thrust_ned), 1.0)
    direction = thrust_ned / size
    return wp.cross(direction, jerk_ned) / size
