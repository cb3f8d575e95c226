"""The start of an episode of a flown task: seeds, hover, world, the vehicle's make. Kernel functions and their rows."""

import warp as wp

from policies.tasks.episode import StepBuffers, begin_episode
from policies.tasks.flight.episode_draws import HOVER_STREAM, NOISE_STREAM, WORLD_STREAM, draw_index, draw_seed
from policies.tasks.flight.flown_vehicle import Makes
from sim.world.growing import WorldParams

wp.set_module_options({"enable_backward": False})


@wp.struct
class Start:
    """What an episode starts with; one row per environment."""

    is_starting: wp.array(dtype=wp.bool)
    is_growing: wp.array(dtype=wp.bool)
    world_seeds: wp.array(dtype=int)
    noise_seeds: wp.array(dtype=int)
    hovers: wp.array(dtype=int)
    hover_count: int
    split: int  # a place in SPLITS
    world_params: wp.array(dtype=WorldParams)
    makes: Makes


@wp.func
def begin_flight(buffers: StepBuffers, start: Start, i: int) -> int:
    """Begins a row's episode, draws its noise and its hover, and returns its index."""
    seed = buffers.seed[i]
    episode = begin_episode(buffers, i)
    start.noise_seeds[i] = draw_seed(seed, i, episode, NOISE_STREAM, start.split)
    start.hovers[i] = draw_index(seed, i, episode, HOVER_STREAM, start.hover_count)
    return episode


@wp.func
def ask_for_world(
    buffers: StepBuffers, start: Start, i: int, episode: int, hill_height_m: float, trees_per_ha: float
) -> None:
    """Has a world grown for a row's episode."""
    start.is_growing[i] = True
    start.world_seeds[i] = draw_seed(buffers.seed[i], i, episode, WORLD_STREAM, start.split)
    world = start.world_params[i]
    world.hill_height_m = hill_height_m
    world.trees_per_ha = trees_per_ha
    start.world_params[i] = world


@wp.func
def continuous_action(buffers: StepBuffers, i: int) -> wp.vec4:
    """The four continuous actions that lie in the buffers, in [-1, 1]."""
    action = wp.vec4()
    for k in range(4):
        action[k] = wp.clamp(buffers.continuous[i, k], -1.0, 1.0)
    return action
