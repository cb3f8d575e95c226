"""Counter-based random draws for kernels.

A draw is named by (seed, vehicle, tick, stream), never by call order, so results do not depend on the batch
size, the thread count or on who else is in the batch.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

_TURN = wp.constant(6.283185307179586)


@wp.func
def draw_tick(tick: wp.int64) -> int:
    """A tick as draws and schedules count it: the same number for 99 days, then from 0 again. No time is made of it."""
    return int(tick & wp.int64(0x7FFFFFFF))


@wp.func
def draw_key(seed: int, i_vehicle: int, tick: int, stream: int) -> wp.uint32:
    """Generator state of the draw named by its four counters."""
    state = wp.rand_init(seed, i_vehicle)
    state = wp.rand_init(int(state), tick)
    return wp.rand_init(int(state), stream)


@wp.func
def normal(seed: int, i_vehicle: int, tick: int, stream: int) -> float:
    """One standard normal draw."""
    return wp.randn(draw_key(seed, i_vehicle, tick, stream))


@wp.func
def normal3(seed: int, i_vehicle: int, tick: int, stream: int) -> wp.vec3:
    """Three independent standard normal draws."""
    state = draw_key(seed, i_vehicle, tick, stream)
    x = wp.randn(state)
    y = wp.randn(state)
    z = wp.randn(state)
    return wp.vec3(x, y, z)


@wp.func
def normal6(seed: int, i_vehicle: int, tick: int, stream: int) -> tuple[wp.vec3, wp.vec3]:
    """Six independent standard normal draws: three Box-Muller pairs, half the price of `normal3` twice."""
    state = draw_key(seed, i_vehicle, tick, stream)
    u0 = wp.randf(state)
    angle_0 = _TURN * wp.randf(state)
    u1 = wp.randf(state)
    angle_1 = _TURN * wp.randf(state)
    u2 = wp.randf(state)
    angle_2 = _TURN * wp.randf(state)
    # 1 - u lies in (0, 1]: the logarithm is finite
    radius_0 = wp.sqrt(-2.0 * wp.log(1.0 - u0))
    radius_1 = wp.sqrt(-2.0 * wp.log(1.0 - u1))
    radius_2 = wp.sqrt(-2.0 * wp.log(1.0 - u2))
    first = wp.vec3(radius_0 * wp.cos(angle_0), radius_1 * wp.cos(angle_1), radius_2 * wp.cos(angle_2))
    second = wp.vec3(radius_0 * wp.sin(angle_0), radius_1 * wp.sin(angle_1), radius_2 * wp.sin(angle_2))
    return first, second


@wp.func
def uniform(seed: int, i_vehicle: int, tick: int, stream: int) -> float:
    """One uniform draw in [0, 1)."""
    return wp.randf(draw_key(seed, i_vehicle, tick, stream))
