"""Draws at an episode's start that are not numbers: keyed by seed, environment and episode, like those.

Seeds of worlds, paths and noise are of disjoint sets: odd numbers in tests, those that four divides in training, and
the other even ones in validation.
"""

import warp as wp

from common.rng import draw_key
from policies.tasks.task import SPLITS

wp.set_module_options({"enable_backward": False})

WORLD_STREAM = wp.constant(1)
NOISE_STREAM = wp.constant(2)
HOVER_STREAM = wp.constant(3)
WIND_STREAM = wp.constant(4)
PATH_STREAM = wp.constant(5)
_VALIDATION = wp.constant(SPLITS.index("validation"))
_TEST = wp.constant(SPLITS.index("test"))
_SEED_BITS = wp.constant(wp.uint32(0x3FFFFFFF))


@wp.func
def draw_seed(seed: int, i_env: int, episode: int, stream: int, split: int) -> int:
    """A seed below 2**31; `split` is a place in `SPLITS`."""
    drawn = int(draw_key(seed, i_env, episode, stream) & _SEED_BITS)
    if split == _TEST:
        return 2 * drawn + 1
    return 4 * (drawn // 2) + wp.where(split == _VALIDATION, 2, 0)


@wp.func
def draw_index(seed: int, i_env: int, episode: int, stream: int, count: int) -> int:
    """One of 0 to count - 1."""
    fraction = wp.randf(draw_key(seed, i_env, episode, stream))
    return wp.min(int(fraction * float(count)), count - 1)


@wp.func
def draw_angle(seed: int, i_env: int, episode: int, stream: int) -> float:
    """An angle in [-pi, pi) [rad]."""
    return 2.0 * wp.pi * (wp.randf(draw_key(seed, i_env, episode, stream)) - 0.5)
