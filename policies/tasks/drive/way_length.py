"""How far it is to a pose for a vehicle that steers at most so much and may reverse: lengths of Reeds-Shepp paths.

The words and their formulas are those of `policies/experts/reeds_shepp.py`, in the paper's frame: x ahead, y left,
angles counter-clockwise, lengths in radii. In kernels, one pose at a time, float32.
"""

import warp as wp

from common.rotation import wrap_pi

wp.set_module_options({"enable_backward": False})

_HALF = wp.constant(1.5707963267948966)
_NONE = wp.constant(1.0e9)


@wp.func
def _arccos(value: float) -> float:
    return wp.acos(wp.clamp(value, -1.0, 1.0))


@wp.func
def _same_side(x: float, y: float, phi: float) -> float:
    """The shortest of the words whose first and last turn are to the left, as many as begin to the left and ahead."""
    a = x - wp.sin(phi)
    b = y - 1.0 + wp.cos(phi)
    gap = wp.sqrt(a * a + b * b)
    bearing = wp.atan2(b, a)
    best = gap + wp.abs(bearing) + wp.abs(wrap_pi(phi - bearing))  # L+ S+ L+
    if gap <= 4.0:
        angle = _arccos(gap / 4.0)
        t = wrap_pi(bearing + _HALF + angle)
        u = wrap_pi(wp.pi - 2.0 * angle)
        best = wp.min(best, wp.abs(t) + wp.abs(u) + wp.abs(wrap_pi(phi - t - u)))  # L+ R- L+
        best = wp.min(best, wp.abs(t) + wp.abs(u) + wp.abs(wrap_pi(t + u - phi)))  # L+ R- L-
        u = _arccos(1.0 - gap * gap / 8.0)
        t = wrap_pi(bearing + _HALF - wp.asin(wp.clamp(2.0 * wp.sin(u) / wp.max(gap, 1.0e-6), -1.0, 1.0)))
        best = wp.min(best, wp.abs(t) + wp.abs(u) + wp.abs(wrap_pi(t - u - phi)))  # L+ R+ L-
    if gap >= 2.0:
        u = wp.sqrt(gap * gap - 4.0) - 2.0
        t = wrap_pi(bearing + _HALF + wp.atan2(2.0, u + 2.0))
        best = wp.min(best, wp.abs(t) + _HALF + wp.abs(u) + wp.abs(wrap_pi(t - phi + _HALF)))  # L+ R-quarter S- L-
        t = wrap_pi(bearing + _HALF - wp.atan2(u + 2.0, 2.0))
        best = wp.min(best, wp.abs(t) + _HALF + wp.abs(u) + wp.abs(wrap_pi(t - phi - _HALF)))  # L+ S+ R+quarter L-
    return best


@wp.func
def _other_side(x: float, y: float, phi: float) -> float:
    """The same of the words whose last turn is to the right."""
    a = x + wp.sin(phi)
    b = y - 1.0 - wp.cos(phi)
    gap = wp.sqrt(a * a + b * b)
    bearing = wp.atan2(b, a)
    best = float(_NONE)
    if gap >= 2.0:
        u = wp.sqrt(gap * gap - 4.0)
        t = wrap_pi(bearing + wp.atan2(2.0, u))
        best = wp.min(best, wp.abs(t) + u + wp.abs(wrap_pi(t - phi)))  # L+ S+ R+
        u = gap - 2.0
        t = wrap_pi(bearing + _HALF)
        best = wp.min(best, wp.abs(t) + _HALF + u + wp.abs(wrap_pi(phi - t - _HALF)))  # L+ R-quarter S- R-
        t = bearing
        best = wp.min(best, wp.abs(t) + _HALF + u + wp.abs(wrap_pi(phi - t - _HALF)))  # L+ S+ L+quarter R-
    if gap >= 4.0:
        u = wp.sqrt(gap * gap - 4.0) - 4.0
        t = wrap_pi(bearing + _HALF + wp.atan2(2.0, u + 4.0))
        best = wp.min(best, wp.abs(t) + 2.0 * _HALF + wp.abs(u) + wp.abs(wrap_pi(t - phi)))  # L+ R- S- L- R+
    if gap <= 6.0:
        angle = _arccos((gap - 2.0) / 4.0)
        u = wp.pi - angle
        t = wrap_pi(bearing + _HALF - angle)
        if gap <= 2.0:
            angle = _arccos((gap + 2.0) / 4.0)
            u = angle
            t = wrap_pi(bearing + _HALF + angle)
        best = wp.min(best, wp.abs(t) + 2.0 * wp.abs(u) + wp.abs(wrap_pi(phi - t + 2.0 * u)))  # L+ R+ L- R-
    if gap >= 2.0 and gap * gap <= 20.0:
        u = _arccos((20.0 - gap * gap) / 16.0)
        t = wrap_pi(bearing + _HALF + wp.asin(wp.clamp(2.0 * wp.sin(u) / wp.max(gap, 1.0e-6), -1.0, 1.0)))
        best = wp.min(best, wp.abs(t) + 2.0 * wp.abs(u) + wp.abs(wrap_pi(t - phi)))  # L+ R- L- R+
    return best


@wp.func
def way_length_m(from_pose: wp.vec3, to_pose: wp.vec3, radius_m: float) -> float:
    """Length [m] of the shortest path between poses (north, east, heading) without anything in the way.

    Args:
        from_pose: where the middle of the rear axle is.
        to_pose: where it is to be.
        radius_m: of the tightest turn.
    """
    north = (to_pose[0] - from_pose[0]) / radius_m
    east = (to_pose[1] - from_pose[1]) / radius_m
    cos = wp.cos(from_pose[2])
    sin = wp.sin(from_pose[2])
    x = north * cos + east * sin
    y = north * sin - east * cos
    phi = from_pose[2] - to_pose[2]
    best = float(_NONE)
    for flip in range(4):  # of time and of the plane
        time = 1.0 - 2.0 * float(flip % 2)
        plane = 1.0 - 2.0 * float(flip // 2)
        turn = wrap_pi(time * plane * phi)
        best = wp.min(best, _same_side(time * x, plane * y, turn))
        best = wp.min(best, _other_side(time * x, plane * y, turn))
    return best * radius_m
