"""Counter-based random draws for kernels.

A draw is named by (seed, vehicle, tick, stream), never by call order, so results do not depend on the batch
size, the thread count or on who else is in the batch.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})


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
def uniform(seed: int, i_vehicle: int, tick: int, stream: int) -> float:
    """One uniform draw in [0, 1)."""
    return wp.randf(draw_key(seed, i_vehicle, tick, stream))
