import numpy as np
import pytest
from pydantic import ValidationError

from sim.world.world import WorldConfig, build_world
from tests.unit.sim.world.queries import query_rays

SMALL = WorldConfig(size_m=240.0, clearing_blend_m=60.0, trees_per_ha=120.0, has_walls=True)


def test_kernel_and_host_rays_agree_on_everything_solid():
    world = build_world(SMALL)
    rng = np.random.default_rng(0)
    origin = rng.uniform([-125, -125, -25], [125, 125, 3], (1500, 3)).astype(np.float32)
    direction = rng.normal(size=(1500, 3)) * [1.0, 1.0, 0.4]
    direction = (direction / np.linalg.norm(direction, axis=1, keepdims=True)).astype(np.float32)
    kernel = query_rays(world, origin, direction, 200.0)
    host = np.array([world.ray_hit(o, d, 200.0) for o, d in zip(origin, direction, strict=True)])
    assert np.mean((host > 0.0) & (host < 200.0)) > 0.5
    error = np.abs(kernel - host)
    assert np.percentile(error, 99) < 1e-3  # float32 over 200 m
    assert np.mean(error > 0.02) < 2e-3  # grazing rays may hit or miss within rounding


def test_clearance_is_the_smallest_of_obstacles_and_height_above_ground():
    world = build_world(SMALL)
    pos = np.random.default_rng(0).uniform([-110, -110, -40], [110, 110, 0], (20, 30, 3))
    clearance = world.clearance(pos)
    assert clearance.shape == (20, 30)
    above_ground = -pos[..., 2] - world.height(pos[..., 0], pos[..., 1])
    np.testing.assert_array_equal(clearance, np.minimum(world.obstacle_distance(pos), above_ground))


def test_tree_density_leaves_the_hills_alone():
    dense, bare = build_world(SMALL), build_world(SMALL.model_copy(update={"trees_per_ha": 0.0}))
    assert dense.heights.tobytes() == bare.heights.tobytes()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"size_m": 10_000.0}, "at most 1024"),
        ({"tree_height_min_m": 12.0}, "larger than tree_height_max_m"),
        ({"seed": -1}, "greater than or equal to 0"),
        ({"trees": 5}, "Extra inputs"),
    ],
)
def test_wrong_configuration_is_refused_by_name(settings, message):
    with pytest.raises(ValidationError, match=message):
        WorldConfig(**settings)
