"""How long does a fresh world for an episode take, one core?

One world of a batch is grown anew at a time, as at the end of an episode: as they are for FollowMe, with six times as
many trees, and on a grid twice as fine; then all worlds of the batch at once.
"""

import time

import numpy as np
import warp as wp

from bench.row import Row, best_of, require
from policies.tasks.follow_me.world import FOLLOW_WORLD
from sim.world.batch import WorldBatch
from sim.world.world import WorldConfig

WORLDS = 64
TIMES = 5
COMMAND = "python -m bench worlds"


def measure() -> list[Row]:
    name = "fresh world of 256 m"
    dense = FOLLOW_WORLD.model_copy(update={"trees_per_ha": 600.0})
    fine = FOLLOW_WORLD.model_copy(update={"cell_m": 2.0})
    return [
        Row(f"{name}, 100 trees/ha, 65 x 65 heights", _one_ms(FOLLOW_WORLD), "ms", "lower", 2.0, COMMAND),
        Row(f"{name}, 600 trees/ha, 65 x 65 heights", _one_ms(dense), "ms", "lower", None, COMMAND),
        Row(f"{name}, 100 trees/ha, 129 x 129 heights", _one_ms(fine), "ms", "lower", None, COMMAND),
        Row(f"{name}, {WORLDS} at once: each", _each_ms(FOLLOW_WORLD), "ms", "lower", 2.0, COMMAND),
    ]


def _one_ms(config: WorldConfig) -> float:
    """Of one world at a time, the mean over a batch."""
    batch = _grown(config)
    is_chosen, seeds = wp.zeros(WORLDS, dtype=wp.bool), wp.zeros(WORLDS, dtype=wp.int32)

    def cpu_ms() -> float:
        start = time.process_time()
        for i_world in range(WORLDS):
            is_chosen.numpy()[:] = np.arange(WORLDS) == i_world
            seeds.numpy()[i_world] += 1
            batch.grow(is_chosen, seeds)
        return 1e3 * (time.process_time() - start) / WORLDS

    return best_of(TIMES, cpu_ms)


def _each_ms(config: WorldConfig) -> float:
    batch = _grown(config)

    def cpu_ms() -> float:
        start = time.process_time()
        batch.grow_all(1)
        return 1e3 * (time.process_time() - start) / WORLDS

    return best_of(TIMES, cpu_ms)


def _grown(config: WorldConfig) -> WorldBatch:
    """A batch with as many trees and hills as asked."""
    batch = WorldBatch(config, WORLDS)
    batch.grow_all(1)
    counts = batch.kernels.numpy()["forest"]["tree_count"]
    hectares = (config.size_m / 100.0) ** 2
    require(0.8 < counts.mean() / hectares / config.trees_per_ha < 1.1, f"{counts.mean():.0f} trees")
    world = batch.map(0)
    require(world.height(0.0, 0.0) == 0.0, "home is not level")
    highest = float(np.abs(world.heights).max())
    require(0.5 * config.hill_height_m < highest <= config.hill_height_m, f"hills of {highest:.1f} m")
    return batch
