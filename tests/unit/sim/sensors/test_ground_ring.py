import numpy as np
import pytest
import warp as wp

from sim.sensors.ground_ring import RING_MAX_M, SECTORS, ring_ranges
from sim.world.batch import grown_world
from sim.world.boxes import BoxesMap
from sim.world.driving_worlds import CAR_PARK, COURSE
from sim.world.world import World, WorldMap

HEADING = 0.7


@wp.kernel
def _ring(worlds: wp.array[World], place: wp.vec2, heading: float, noise: float, ranges_m: wp.array2d[wp.float32]):
    ring_ranges(worlds[0], place, heading, noise, 5, 7, ranges_m, 0)


def ring(world: WorldMap, place, noise=0.0):
    ranges = wp.zeros((1, SECTORS), dtype=wp.float32)
    worlds = wp.array([world.kernel], dtype=World)
    wp.launch(_ring, 1, [worlds, wp.vec2(*place), HEADING, noise, ranges])
    return ranges.numpy()[0]


def flattened(config, seed):
    """A world on level ground, so that level rays meet what stands there."""
    return grown_world(config.model_copy(update={"hill_height_m": 0.0}), seed)


@pytest.mark.parametrize("config", [COURSE, CAR_PARK])
def test_a_sector_tells_the_nearest_of_what_level_rays_through_it_meet(config):
    for seed in range(3):
        world = flattened(config, seed)
        ranges = ring(world, (0.4, -0.3))
        height = 0.05  # below the kerbs' tops
        for k in range(SECTORS):
            angles = HEADING + np.radians(5.0 * k + np.array([-5.0, 0.0, 5.0]) / 3.0)
            hits = [world.ray_hit([0.4, -0.3, -height], [np.cos(a), np.sin(a), 0.0], float(RING_MAX_M)) for a in angles]
            assert ranges[k] == pytest.approx(min(hits), abs=2e-3)


def test_what_stands_on_a_slope_is_seen_and_the_slope_is_not():
    world = grown_world(COURSE.model_copy(update={"wall_count": 0, "mover_count": 0, "trees_per_ha": 0.0}), 1)
    assert np.all(ring(world, (12.0, 5.0)) == RING_MAX_M)
    with_walls = grown_world(COURSE, 1)
    rows = with_walls.boxes.rows
    place = (float(rows["north"][0]) + 3.0, float(rows["east"][0]))
    assert ring(with_walls, place).min() < 4.0


def test_a_mover_is_seen_where_it_is_now():
    world = flattened(CAR_PARK, 4)
    movers = BoxesMap(world.boxes.rows[world.boxes.rows["period_ticks"] > 0])
    for tick in (0, 1500):
        world.kernel.boxes.tick = tick
        place = movers.middle(tick)[0] + [0.0, 0.6]
        assert ring(world, place).min() < 0.5


def test_noise_shakes_ranges_and_some_returns_are_missing():
    world = flattened(CAR_PARK, 2)
    exact, noisy = ring(world, (0.0, 0.0)), ring(world, (0.0, 0.0), noise=5.0)
    seen = (exact < RING_MAX_M) & (noisy < RING_MAX_M)
    assert 0.02 < np.abs(exact - noisy)[seen].mean() < 0.15
    assert (noisy == RING_MAX_M).sum() > (exact == RING_MAX_M).sum()
