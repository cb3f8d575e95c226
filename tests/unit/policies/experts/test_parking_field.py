"""The field of ways: exact where nothing is in the way, longer round what is, downhill to the target everywhere."""

import numpy as np
import pytest
import warp as wp

from policies.experts.parking_field import NODES, SPACING_M, Target, fill_field, way_at
from policies.tasks.parking.scene import Scene

wp.set_module_options({"enable_backward": False})
TARGET = (4.0, 6.0)


@wp.kernel
def fill(way: wp.array3d(dtype=float), cost: wp.array3d(dtype=float), scene: Scene, target: Target):
    fill_field(way, cost, 0, 0, scene, target)


@wp.kernel
def look(way: wp.array3d(dtype=float), points: wp.array(dtype=wp.vec2), found: wp.array(dtype=wp.vec3)):
    k = wp.tid()
    found[k] = way_at(way, 0, 0, points[k])


@pytest.fixture(scope="module")
def ways():
    """Ways and gradients at points, with a block in the scene or without."""

    def of(points, block=None):
        scene = Scene()
        scene.obstacle_half = wp.vec2(3.0, 0.5)
        if block is not None:
            scene.obstacle_count = 1
            scene.obstacles = wp.mat44(*block, 0.0, 1.0, *([0.0] * 12))
        target = Target()
        target.pose = wp.vec4(*TARGET, 0.0, 1.0)
        way, cost = (wp.zeros((1, NODES, NODES), dtype=float) for _ in range(2))
        wp.launch(fill, 1, [way, cost, scene, target])
        found = wp.zeros(len(points), dtype=wp.vec3)
        wp.launch(look, len(points), [way, wp.array(points, dtype=wp.vec2), found])
        return found.numpy()

    return of


def points_within(half_m, count=200):
    return np.random.default_rng(0).uniform(-half_m, half_m, (count, 2)).astype(np.float32)


def test_way_is_the_distance_where_nothing_is_near(ways):
    points = points_within(12.0)
    distances = np.hypot(*(points - TARGET).T)
    np.testing.assert_allclose(ways(points)[:, 0], distances, rtol=0.1, atol=SPACING_M)  # of first order in the spacing


def test_gradient_leads_away_from_the_target(ways):
    points = points_within(12.0)
    points = points[np.hypot(*(points - TARGET).T) > 1.0]
    away = (points - TARGET) / np.hypot(*(points - TARGET).T)[:, None]
    gradients = ways(points)[:, 1:]
    cosines = (gradients * away).sum(axis=1) / np.hypot(*gradients.T)
    assert cosines.min() > 0.95


def test_way_round_a_block_is_longer(ways):
    behind, beside = ways(np.array([[4.0, -4.0], [-8.0, 6.0]], dtype=np.float32), block=(4.0, 1.0))[:, 0]
    assert behind > 10.0 + 1.0
    assert beside == pytest.approx(12.0, rel=0.1)
