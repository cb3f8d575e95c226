"""Attitude loop: thrust direction and heading to an attitude quaternion, its error to body rates, 250 Hz.

The error is split into tilt and heading (Brescianini, Hehn and D'Andrea 2013, "Nonlinear quadrocopter attitude
control"), because tilt moves the vehicle and is fast, heading is neither.
"""

import warp as wp

from autopilot.control.params import ControlParams
from autopilot.control.pid import clamp3
from common.rotation import quat_from_rotvec, rotvec_from_quat

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
    axes = wp.mat33(
        forward[0], right[0], down[0], forward[1], right[1], down[1], forward[2], right[2], down[2]
    )
    return wp.normalize(wp.quat_from_matrix(axes))


@wp.func
def tilt_error(q_ned_from_frd: wp.quat, q_sp_ned_from_frd: wp.quat) -> wp.vec3:
    """Rotation vector [rad], frd, that takes the body z axis to the wanted one the shortest way; no z element."""
    wanted = wp.quat_rotate_inv(q_ned_from_frd, wp.quat_rotate(q_sp_ned_from_frd, wp.vec3(0.0, 0.0, 1.0)))
    sine = wp.sqrt(wanted[0] * wanted[0] + wanted[1] * wanted[1])
    if sine < _SMALL:
        if wanted[2] < 0.0:  # upside down: any way is as short
            return wp.vec3(wp.pi, 0.0, 0.0)
        return wp.vec3(-wanted[1], wanted[0], 0.0)
    angle = wp.atan2(sine, wanted[2])
    return wp.vec3(-wanted[1], wanted[0], 0.0) * (angle / sine)


@wp.func
def attitude_error(q_ned_from_frd: wp.quat, q_sp_ned_from_frd: wp.quat) -> wp.vec3:
    """Attitude error [rad], frd: the tilt as rotation vector in x and y, then the turn about body z left after it."""
    tilt = tilt_error(q_ned_from_frd, q_sp_ned_from_frd)
    q_levelled = q_ned_from_frd * quat_from_rotvec(tilt)
    turn = rotvec_from_quat(wp.quat_inverse(q_levelled) * q_sp_ned_from_frd)
    return wp.vec3(tilt[0], tilt[1], turn[2])


@wp.func
def rate_setpoint(
    params: ControlParams, q_ned_from_frd: wp.quat, q_sp_ned_from_frd: wp.quat, omega_feed_ned: wp.vec3
) -> wp.vec3:
    """Body rates [rad/s], frd, that close the attitude error, plus the rate at which the setpoint itself turns."""
    gain = wp.vec3(params.att_p_roll, params.att_p_pitch, params.att_p_yaw)
    rate = wp.cw_mul(gain, attitude_error(q_ned_from_frd, q_sp_ned_from_frd))
    rate = rate + wp.quat_rotate_inv(q_ned_from_frd, omega_feed_ned)
    return clamp3(rate, wp.vec3(params.rate_max_roll, params.rate_max_pitch, params.rate_max_yaw))


@wp.func
def thrust_turn_rate(thrust_ned: wp.vec3, jerk_ned: wp.vec3) -> wp.vec3:
    """Angular rate [rad/s], ned, of the direction of a thrust vector [m/s²] that changes with `jerk_ned`."""
    size = wp.max(wp.length(thrust_ned), 1.0)
    direction = thrust_ned / size
    return wp.cross(direction, jerk_ned) / size
