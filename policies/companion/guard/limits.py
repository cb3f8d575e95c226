"""How fast it may go: towards the owner, towards what is solid or unseen, up and down. Pure functions."""

from math import cos, isfinite, radians, sqrt

import numpy as np
from numpy.typing import NDArray

from common.attitude import Quat, rotated
from policies.companion.guard.settings import GuardSettings

Floats = NDArray[np.float64]
CLIMB_M_S = 1.0
SINK_M_S = 0.3  # from above what it may be
_WAY_M, _STEP_M = 4.0, 0.02  # farther along an arc nothing is asked for


def capped(level: Floats, most: float) -> Floats:
    """A level velocity (2,) that is no faster than this [m/s]."""
    return np.asarray(level * min(1.0, most / max(float(np.hypot(*level)), 1e-6)))


def stopping_speed(free_m: float, delay_s: float, brake: float) -> float:
    """The speed [m/s] from which it stands within a way [m], after a delay [s], braking at so much [m/s²]."""
    if free_m <= 0.0:
        return 0.0
    return brake * (sqrt(delay_s * delay_s + 2.0 * free_m / brake) - delay_s)


def braking_speed(free_m: float, own_m_s: float, delay_s: float, brake: float) -> float:
    """As `stopping_speed`, for who goes at a speed [m/s] until it answers, which may be more."""
    most = stopping_speed(free_m, delay_s, brake)
    return min(most, stopping_speed(free_m - delay_s * max(own_m_s, 0.0), 0.0, brake))


def way_along_m(points: Floats, curvature: float, is_backwards: bool, s: GuardSettings) -> float:
    """How far [m] a vehicle on wheels gets along an arc before its hull comes too near to a point.

    What is too near already does not count as long as it comes no nearer.

    Args:
        points: what is solid [m], ahead and right of its middle, (points, 2).
        curvature: [1/m] of the way of its middle, positive to the right.
        is_backwards: it drives so.
        s: of the guard.
    """
    along = np.arange(0.0, _WAY_M + _STEP_M, _STEP_M)
    if not len(points):
        return float(along[-1])
    along = -along if is_backwards else along
    turn = curvature * along
    # the chord of an arc: sinc holds where it is nearly straight
    ahead = along * np.sinc(turn / (2.0 * np.pi)) * np.cos(0.5 * turn)
    right = along * np.sinc(turn / (2.0 * np.pi)) * np.sin(0.5 * turn)
    off = points[None] - np.stack([ahead, right], -1)[:, None]
    cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
    lengthwise = np.abs(off[..., 0] * cos + off[..., 1] * sin) - s.hull_half_length_m
    across = np.abs(off[..., 1] * cos - off[..., 0] * sin) - s.hull_half_width_m
    outside = np.hypot(np.maximum(lengthwise, 0.0), np.maximum(across, 0.0))
    room = outside + np.minimum(np.maximum(lengthwise, across), 0.0)
    is_met = ((room < s.hull_room_m) & (room < room[0] - 0.01)).any(1)
    return float(abs(along[np.argmax(is_met)])) - _STEP_M if is_met.any() else _WAY_M


def within_heights(down: float, height_m: float, s: GuardSettings) -> float:
    """A velocity down [m/s] that keeps between the heights allowed.

    Args:
        down: wanted [m/s].
        height_m: above the ground; NaN: nothing in reach.
        s: of the guard.
    """
    if not isfinite(height_m):
        return min(max(down, 0.0), SINK_M_S)
    if height_m < s.height_min_m:
        return min(down, -0.5 * CLIMB_M_S)
    if height_m > s.height_max_m:
        return max(down, SINK_M_S)
    down = max(down, -stopping_speed(s.height_max_m - height_m, s.reaction_s, CLIMB_M_S))
    return min(down, stopping_speed(height_m - s.height_min_m, s.reaction_s, CLIMB_M_S))


def is_tilted(q_ned_from_frd: Quat, s: GuardSettings) -> bool:
    """Whether a vehicle leans by more than it may."""
    return rotated(q_ned_from_frd, (0.0, 0.0, 1.0))[2] < cos(radians(s.tilt_max_deg))


def faded(age_s: float, from_s: float, to_s: float) -> float:
    """1 until one age, 0 from another on."""
    return float(np.clip((to_s - age_s) / (to_s - from_s), 0.0, 1.0))
