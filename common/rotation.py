"""Rotations in kernels: unit Hamilton quaternions, active, stored (x, y, z, w) by Warp.

`q_dst_from_src` rotates a vector of frame src into frame dst. A rotation vector is axis times angle [rad].
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

_SMALL_ANGLE = wp.constant(1.0e-4)  # below it the series is exact to float32


@wp.func
def quat_from_rotvec(rotvec: wp.vec3) -> wp.quat:
    """Exponential map: the unit quaternion of a rotation vector [rad]."""
    angle = wp.length(rotvec)
    scale = 0.5 - angle * angle / 48.0
    if angle > _SMALL_ANGLE:
        scale = wp.sin(0.5 * angle) / angle
    return wp.normalize(wp.quat(rotvec[0] * scale, rotvec[1] * scale, rotvec[2] * scale, wp.cos(0.5 * angle)))


@wp.func
def rotvec_from_quat(q: wp.quat) -> wp.vec3:
    """Logarithm: the rotation vector [rad] of length at most pi; q and -q give the same one."""
    sign = 1.0
    if q[3] < 0.0:
        sign = -1.0
    axis = wp.vec3(q[0], q[1], q[2]) * sign
    sin_half = wp.length(axis)
    scale = 2.0
    if sin_half > _SMALL_ANGLE:
        scale = 2.0 * wp.atan2(sin_half, q[3] * sign) / sin_half
    return axis * scale


@wp.func
def yaw_from_quat(q_ned_from_frd: wp.quat) -> float:
    """Heading [rad] in (-pi, pi], ZYX Euler convention."""
    x = q_ned_from_frd[0]
    y = q_ned_from_frd[1]
    z = q_ned_from_frd[2]
    w = q_ned_from_frd[3]
    return wp.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


@wp.func
def quat_from_yaw(yaw_rad: float) -> wp.quat:
    """Level attitude with the given heading [rad]."""
    return wp.quat(0.0, 0.0, wp.sin(0.5 * yaw_rad), wp.cos(0.5 * yaw_rad))


@wp.func
def wrap_pi(angle_rad: float) -> float:
    """The angle shifted by turns into [-pi, pi]."""
    return angle_rad - 2.0 * wp.pi * wp.round(angle_rad / (2.0 * wp.pi))
