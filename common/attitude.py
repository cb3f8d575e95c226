"""Rotations and angles of one vehicle in plain numbers; common.rotation does the same in kernels.

Unit Hamilton quaternions (x, y, z, w), active: `q_dst_from_src` rotates a vector of frame src into frame dst.
"""

from collections.abc import Sequence
from math import asin, atan2, cos, pi, sin, sqrt

Vector = tuple[float, float, float]
Quat = tuple[float, float, float, float]  # x, y, z, w
_STEEP = 1e-6  # squared length; steeper, where ahead is is not known, and rounding may make it negative


def product(a: Sequence[float], b: Sequence[float]) -> Quat:
    """Hamilton product: first `b`, then `a`."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def inverse(q: Sequence[float]) -> Quat:
    """The rotation back."""
    x, y, z, w = q
    return (-x, -y, -z, w)


def rotated(q_dst_from_src: Sequence[float], v: Sequence[float]) -> Vector:
    """The vector in the destination frame."""
    x, y, z, w = q_dst_from_src
    a, b, c = v
    tx, ty, tz = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return (a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx)


def yaw_of(q_ned_from_frd: Sequence[float]) -> float:
    """Heading [rad] in [-pi, pi], ZYX Euler convention."""
    x, y, z, w = q_ned_from_frd
    return atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def roll_pitch_yaw_of(q_ned_from_frd: Sequence[float]) -> Vector:
    """Roll, pitch and yaw [rad], ZYX Euler convention."""
    x, y, z, w = q_ned_from_frd
    sine = 2.0 * (w * y - z * x)
    return (
        atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        asin(1.0 if sine > 1.0 else -1.0 if sine < -1.0 else sine),
        atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    )


def levelled(v_frd: Sequence[float], down_frd: Sequence[float]) -> Vector:
    """A vector of a leaning body as ahead, right and down of it, level.

    Args:
        v_frd: body frame.
        down_frd: the first two elements of the unit vector down in it.
    """
    x, y, z = v_frd
    lean_x, lean_y = down_frd
    upright = sqrt(max(1.0 - lean_x * lean_x - lean_y * lean_y, 0.0))
    level = sqrt(max(1.0 - lean_x * lean_x, _STEEP))  # length of the body's x axis without what points down
    down = lean_x * x + lean_y * y + upright * z
    return (x - lean_x * down) / level, (upright * y - lean_y * z) / level, down


def quat_of(yaw_rad: float, pitch_rad: float) -> Quat:
    """Yaw, then pitch, no roll."""
    return product(
        (0.0, 0.0, sin(0.5 * yaw_rad), cos(0.5 * yaw_rad)), (0.0, sin(0.5 * pitch_rad), 0.0, cos(0.5 * pitch_rad))
    )


def quat_of_roll_pitch_yaw(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quat:
    """The attitude of Euler angles ZYX; the inverse of `roll_pitch_yaw_of`."""
    return product(quat_of(yaw_rad, pitch_rad), (sin(0.5 * roll_rad), 0.0, 0.0, cos(0.5 * roll_rad)))


def wrapped(angle_rad: float) -> float:
    """The angle [rad] shifted by turns into [-pi, pi)."""
    return (angle_rad + pi) % (2.0 * pi) - pi
