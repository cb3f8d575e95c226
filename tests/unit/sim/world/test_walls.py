import numpy as np
import pytest

from sim.world.world import WorldConfig, build_world
from tests.unit.sim.world.queries import query_points, query_rays

WALLED = WorldConfig(size_m=100.0, hill_height_m=0.0, trees_per_ha=0.0, has_walls=True, wall_height_m=6.0)


@pytest.mark.parametrize(
    ("pos_ned", "contact"),
    [
        ([49.8, 0.0, -1.0], [-1.0, 0.0, 0.0, 0.1]),
        ([-49.8, 0.0, -1.0], [1.0, 0.0, 0.0, 0.1]),
        ([0.0, 49.8, -1.0], [0.0, -1.0, 0.0, 0.1]),
        ([0.0, -49.8, -1.0], [0.0, 1.0, 0.0, 0.1]),
        ([50.25, 0.0, -6.2], [0.0, 0.0, -1.0, 0.1]),  # on the top
        ([50.7, 0.0, -1.0], [1.0, 0.0, 0.0, 0.1]),  # from outside
        ([50.1, 0.0, -1.0], [-1.0, 0.0, 0.0, 0.4]),  # centre inside the wall
        ([50.25, 0.0, -5.9], [0.0, 0.0, -1.0, 0.4]),
        ([49.6, 0.0, -1.0], [0.0, 0.0, 0.0, 0.0]),
        ([50.25, 0.0, -6.4], [0.0, 0.0, 0.0, 0.0]),
    ],
)
def test_contact_pushes_off_the_nearest_face(pos_ned, contact):
    _, _, answer = query_points(build_world(WALLED), np.array([pos_ned]), radius=0.3)
    np.testing.assert_allclose(answer[0], contact, atol=1e-5)


@pytest.mark.parametrize(
    ("origin_ned", "dir_ned", "distance"),
    [
        ([0.0, 0.0, -1.0], [1.0, 0.0, 0.0], 50.0),
        ([0.0, 0.0, -1.0], [0.0, -1.0, 0.0], 50.0),
        ([0.0, 0.0, -1.0], [0.6, 0.8, 0.0], 62.5),
        ([0.0, 0.0, -7.0], [1.0, 0.0, 0.0], 90.0),  # over the top
        ([60.0, 0.0, -1.0], [-1.0, 0.0, 0.0], 9.5),  # from outside
        ([50.25, 0.0, -20.0], [0.0, 0.0, 1.0], 14.0),  # down on the top
        ([50.25, 0.0, -1.0], [0.0, 0.0, -1.0], 0.0),  # from inside
    ],
)
def test_ray_hits_the_first_face(origin_ned, dir_ned, distance):
    world = build_world(WALLED)
    assert world.ray_hit(origin_ned, dir_ned, 90.0) == pytest.approx(distance)
    hit = query_rays(world, np.array([origin_ned]), np.array([dir_ned]), 90.0)
    assert hit[0] == pytest.approx(distance, abs=1e-4)


def test_kernel_and_host_agree_on_depth():
    world = build_world(WALLED)
    pos = np.random.default_rng(0).uniform([-55, -55, -8], [55, 55, -1], (5000, 3)).astype(np.float32)
    _, _, contact = query_points(world, pos, radius=1.0)
    depth = np.maximum(1.0 - world.obstacle_distance(pos), 0.0)
    assert (depth > 0.0).sum() > 100
    np.testing.assert_allclose(contact[:, 3], depth, atol=2e-5)


def test_walls_are_an_option():
    open_world = build_world(WALLED.model_copy(update={"has_walls": False}))
    assert open_world.ray_hit([0.0, 0.0, -1.0], [1.0, 0.0, 0.0], 90.0) == 90.0
    assert open_world.obstacle_distance([49.9, 0.0, -1.0]) == np.inf
    _, _, contact = query_points(open_world, np.array([[49.9, 0.0, -1.0]]))
    assert np.all(contact == 0.0)


def test_wall_top_is_level_and_clears_the_highest_edge():
    world = build_world(WorldConfig(size_m=300.0, clearing_blend_m=60.0, has_walls=True, wall_height_m=5.0))
    edge = np.linspace(-150.0, 150.0, 400)
    highest = max(world.height(edge, side).max() for side in (-150.0, 150.0))
    highest = max(highest, *(world.height(side, edge).max() for side in (-150.0, 150.0)))
    assert world.walls.top_m == pytest.approx(highest + 5.0, abs=0.2)  # between the grid points the edge is lower
