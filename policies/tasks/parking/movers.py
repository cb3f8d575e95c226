"""The four capsules of level 2: each runs along its line, parallel to the walls, and turns back on contact.

A mover is a pose whose forward axis is its direction of travel. It turns back at the walls of its storey, and both of a
pair turn back when they begin to touch. Pads and portals do not turn them back (choice: a pad would be a barrier).
"""

import warp as wp

from common.rng import draw_key
from policies.tasks.parking.arena import (
    WALL_X_HIGH,
    WALL_X_LOW,
    WALL_Z_HIGH,
    WALL_Z_LOW,
    forward_of,
    position_of,
    storey_centre,
)
from policies.tasks.parking.car import DT, nearest_on_line
from policies.tasks.parking.parking_params import Level2Params

wp.set_module_options({"enable_backward": False})

PER_STOREY = wp.constant(2)
_LINE_RANGE = wp.constant(9.0)  # [m] how far from the middle lines and first places are drawn


@wp.func
def half_line(params: Level2Params) -> float:
    """From a capsule's middle to the middle of its cap [m]."""
    return wp.max(0.0, 0.5 * params.mover_length_m - params.mover_radius_m)


@wp.func
def line_distance(a0: wp.vec2, a1: wp.vec2, b0: wp.vec2, b1: wp.vec2) -> float:
    """The shortest distance of two lines in the plane; 0 where they cross [m]."""
    along_a = a1 - a0
    along_b = b1 - b0
    cross = along_a[0] * along_b[1] - along_a[1] * along_b[0]
    if wp.abs(cross) > 1.0e-9:
        gap = b0 - a0
        fraction_a = (gap[0] * along_b[1] - gap[1] * along_b[0]) / cross
        fraction_b = (gap[0] * along_a[1] - gap[1] * along_a[0]) / cross
        if fraction_a >= 0.0 and fraction_a <= 1.0 and fraction_b >= 0.0 and fraction_b <= 1.0:
            return 0.0
    near_a = wp.min(wp.length(a0 - nearest_on_line(b0, b1, a0)), wp.length(a1 - nearest_on_line(b0, b1, a1)))
    near_b = wp.min(wp.length(b0 - nearest_on_line(a0, a1, b0)), wp.length(b1 - nearest_on_line(a0, a1, b1)))
    return wp.min(near_a, near_b)


@wp.func
def movers_touch(a: wp.vec4, b: wp.vec4, params: Level2Params) -> bool:
    """Whether two capsules overlap."""
    gap = position_of(b) - position_of(a)
    if wp.dot(gap, gap) > params.mover_length_m * params.mover_length_m:
        return False
    reach_a = forward_of(a) * half_line(params)
    reach_b = forward_of(b) * half_line(params)
    at_a = position_of(a)
    at_b = position_of(b)
    distance = line_distance(at_a - reach_a, at_a + reach_a, at_b - reach_b, at_b + reach_b)
    return distance <= 2.0 * params.mover_radius_m


@wp.func
def turned_back(mover: wp.vec4) -> wp.vec4:
    """The same place, the other way."""
    return wp.vec4(mover[0], mover[1], -mover[2], -mover[3])


@wp.func
def ran(mover: wp.vec4, storey: int, params: Level2Params) -> wp.vec4:
    """A mover one tick later; away from a wall that it reaches."""
    step = forward_of(mover) * (params.mover_speed_m_s * DT)
    out = wp.vec4(mover[0] + step[0], mover[1] + step[1], mover[2], mover[3])
    local = position_of(out) - storey_centre(storey)
    half = 0.5 * params.mover_length_m
    is_at_high = (out[2] > 0.5 and local[0] + half >= WALL_X_HIGH) or (out[3] > 0.5 and local[1] + half >= WALL_Z_HIGH)
    is_at_low = (out[2] < -0.5 and local[0] - half <= WALL_X_LOW) or (out[3] < -0.5 and local[1] - half <= WALL_Z_LOW)
    if is_at_high or is_at_low:
        out = turned_back(out)
    return out


@wp.func
def run_movers(
    movers: wp.array2d(dtype=wp.vec4), touching: wp.array2d(dtype=int), i: int, params: Level2Params
) -> None:
    """All movers of a row, one tick."""
    for storey in range(2):
        first = ran(movers[i, PER_STOREY * storey], storey, params)
        second = ran(movers[i, PER_STOREY * storey + 1], storey, params)
        is_touching = wp.where(movers_touch(first, second, params), 1, 0)
        if is_touching == 1 and touching[i, storey] == 0:
            first = turned_back(first)
            second = turned_back(second)
        touching[i, storey] = is_touching
        movers[i, PER_STOREY * storey] = first
        movers[i, PER_STOREY * storey + 1] = second


@wp.func
def draw_mover(storey: int, is_along_x: bool, seed: int, i_env: int, episode: int, stream: int) -> wp.vec4:
    """A mover on a line along x or z, anywhere on it, either way."""
    rng = draw_key(seed, i_env, episode, stream)
    x = _LINE_RANGE * (2.0 * wp.randf(rng) - 1.0)
    z = _LINE_RANGE * (2.0 * wp.randf(rng) - 1.0)
    way = wp.where(wp.randf(rng) < 0.5, -1.0, 1.0)
    centre = storey_centre(storey)
    return wp.vec4(centre[0] + x, centre[1] + z, wp.where(is_along_x, way, 0.0), wp.where(is_along_x, 0.0, way))
