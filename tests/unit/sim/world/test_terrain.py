import hashlib

import numpy as np
import pytest

from sim.world.terrain import TerrainMap, make_heights
from sim.world.world import WorldConfig, build_world
from tests.unit.sim.world.queries import query_points, query_rays

BARE = WorldConfig(size_m=400.0, clearing_blend_m=60.0, trees_per_ha=0.0)
STEP = TerrainMap(np.array([[0, 0, 0], [0, 0, 0], [4, 4, 4]], np.float32), 8.0)  # rises north of home, slope 1


def test_same_seed_gives_same_bytes_and_another_seed_does_not():
    heights = [build_world(BARE.model_copy(update={"seed": seed})).heights.tobytes() for seed in (3, 3, 4)]
    assert heights[0] == heights[1]
    assert heights[0] != heights[2]


def test_default_world_has_the_recorded_bytes():
    """Plans and recorded flights rely on the default map: a change of it must be meant."""
    world = build_world()
    digest = hashlib.sha256(world.heights.tobytes() + world.trees.tobytes()).hexdigest()
    assert digest[:16] == "9cc96a319c9ae91d"


def test_clearing_is_exactly_level():
    world = build_world(BARE)
    angle, radius = np.meshgrid(np.linspace(0.0, 6.3, 100), np.linspace(0.0, BARE.clearing_radius_m, 50))
    north, east = radius * np.cos(angle), radius * np.sin(angle)
    assert np.all(world.height(north, east) == 0.0)
    assert np.all(world.normal_ned(north, east) == [0.0, 0.0, -1.0])


def test_hills_stay_within_their_bound_and_use_it():
    heights = make_heights(5, 100, 400.0, 12.0, 250.0, 6, 0.0, 1.0)
    assert np.abs(heights).max() == pytest.approx(12.0)


def test_octaves_add_detail_to_the_same_hills():
    smooth, rough = (make_heights(5, 200, 400.0, 12.0, 200.0, octaves, 0.0, 1.0) for octaves in (1, 6))
    roughness = [np.abs(np.diff(h, n=2, axis=0)).mean() for h in (smooth, rough)]
    assert roughness[1] > 3.0 * roughness[0]
    assert np.corrcoef(smooth.ravel(), rough.ravel())[0, 1] > 0.8


def test_height_equals_the_grid_at_its_points():
    world = build_world(BARE)
    along = np.linspace(-200.0, 200.0, world.terrain.cells + 1)
    north, east = np.meshgrid(along, along, indexing="ij")
    # positions such as -196 m are exact in binary, but the cell count times the scale is rounded
    np.testing.assert_allclose(world.height(north, east), world.heights, atol=1e-9)


def test_ground_beyond_the_map_continues_level_from_its_edge():
    world = build_world(BARE)
    along = np.linspace(-199.0, 199.0, 40)
    np.testing.assert_array_equal(world.height(350.0, along), world.height(200.0, along))
    assert np.all(world.normal_ned(350.0, along)[:, 0] == 0.0)
    assert np.any(world.normal_ned(350.0, along)[:, 1] != 0.0)


def test_normal_of_a_slope_to_the_north_points_south_and_up():
    np.testing.assert_allclose(STEP.normal_ned(2.0, 1.0), [-np.sqrt(0.5), 0.0, -np.sqrt(0.5)])


@pytest.mark.parametrize(
    ("origin_ned", "dir_ned", "distance"),
    [
        ([-2.0, 0.0, -1.0], [1.0, 0.0, 0.0], 3.0),  # level flight into the slope at height 1
        ([1.0, 1.0, -9.0], [0.0, 0.0, 1.0], 8.0),  # down on the slope
        ([-2.0, 0.0, -1.0], [-1.0, 0.0, 0.0], 50.0),  # away from it: no hit
        ([-2.0, 0.0, -1.0], [0.0, 0.0, -1.0], 50.0),  # up
        ([20.0, 0.0, -5.0], [0.0, 0.0, 1.0], 1.0),  # on the level ground beyond the northern edge
        ([20.0, 0.0, -3.0], [0.0, 0.0, -1.0], 0.0),  # from under ground
    ],
)
def test_ray_hits_where_geometry_says(origin_ned, dir_ned, distance):
    assert STEP.ray_hit(np.array(origin_ned), np.array(dir_ned), 50.0) == pytest.approx(distance)


def test_kernel_and_host_agree_on_height_and_normal():
    world = build_world(BARE)
    pos = np.random.default_rng(0).uniform(-230.0, 230.0, (5000, 3)).astype(np.float32)
    height, normal, _ = query_points(world, pos)
    # float32 position in a 400 m map: 2e-5 m times the slope
    np.testing.assert_allclose(height, world.height(pos[:, 0], pos[:, 1]), atol=5e-5)
    # a point within rounding of a triangle's side may be given to its neighbour
    differs = np.abs(normal - world.normal_ned(pos[:, 0], pos[:, 1])).max(axis=1) > 1e-4
    assert differs.mean() < 1e-3


def test_kernel_ray_downwards_hits_at_the_height():
    world = build_world(BARE)
    pos = np.random.default_rng(1).uniform([-230.0, -230.0, -60.0], [230.0, 230.0, -20.0], (2000, 3)).astype(np.float32)
    hit = query_rays(world, pos, np.tile([0.0, 0.0, 1.0], (2000, 1)), 100.0)
    np.testing.assert_allclose(hit, -pos[:, 2] - world.height(pos[:, 0], pos[:, 1]), atol=1e-4)


def test_position_that_is_not_a_number_stays_inside_the_arrays():
    world = build_world(BARE)
    pos = np.array([[np.nan, np.nan, np.nan], [np.inf, -np.inf, 0.0], [1e38, -1e38, 0.0]])
    height, _, contact = query_points(world, pos)
    np.testing.assert_array_equal(height, world.heights[[0, -1, -1], 0])
    assert np.all(contact == 0.0)
    hit = query_rays(world, pos, np.tile([0.6, 0.0, 0.8], (3, 1)), 50.0)
    assert np.all((hit >= 0.0) & (hit <= 50.0))
