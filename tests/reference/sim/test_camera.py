"""The renderer against the world's own float64 ray cast, and the facts a picture must show."""

from math import radians, sqrt, tan

import numpy as np
import pytest

from sim.sensors.camera import SKY_DEPTH_M, CameraPose, Renderer
from sim.sensors.ray import CROWN, GROUND, SKY, TRUNK, WALL
from sim.world.world import WorldConfig, build_world

WIDTH, HEIGHT = 32, 24
LEVEL_NORTH = (0.5, 0.5, 0.5, 0.5)  # q_ned_from_rdf: right is east, down is down, ahead is north
STRAIGHT_DOWN = (0.0, 0.0, sqrt(0.5), sqrt(0.5))  # ahead is down, the picture's upper edge is north


@pytest.fixture(scope="module")
def world():
    return build_world(WorldConfig(size_m=400.0, hill_height_m=25.0, has_walls=True))


@pytest.fixture(scope="module")
def renderer(world):
    return Renderer(world)


def random_poses(world, count):
    rng = np.random.default_rng(5)
    poses = []
    for _ in range(count):
        north, east = rng.uniform(-180.0, 180.0, 2)
        height = float(world.height(north, east)) + rng.uniform(0.5, 60.0)
        q = rng.normal(size=4)
        poses.append(CameraPose((north, east, -height), tuple(q / np.linalg.norm(q)), hfov_deg=90.0))
    return poses


def rotation(q):
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rays_rdf(hfov_deg):
    half = tan(0.5 * radians(hfov_deg))
    right = (np.arange(WIDTH) + 0.5 - 0.5 * WIDTH) * 2.0 * half / WIDTH
    down = (np.arange(HEIGHT) + 0.5 - 0.5 * HEIGHT) * 2.0 * half / WIDTH
    return np.stack([*np.meshgrid(right, down), np.ones((HEIGHT, WIDTH))], axis=-1)


def test_depth_is_that_of_the_exact_ray_cast(world, renderer):
    poses = random_poses(world, 80)
    pictures = renderer.images(poses, WIDTH, HEIGHT)
    rng = np.random.default_rng(6)
    wrong = compared = 0
    for i, pose in enumerate(poses):
        rays = rays_rdf(pose.hfov_deg) @ rotation(pose.q_ned_from_rdf).T
        for row, column in zip(rng.integers(0, HEIGHT, 20), rng.integers(0, WIDTH, 20), strict=True):
            ray = rays[row, column]
            length = np.linalg.norm(ray)
            expected = world.ray_hit(np.array(pose.pos_ned), ray / length, 1000.0)
            if expected == 1000.0:
                continue
            if np.abs(np.array(pose.pos_ned) + ray / length * expected)[:2].max() > 200.4:  # beyond the map
                continue
            compared += 1
            depth = pictures.depth_m[i, row, column] * length
            wrong += abs(depth - expected) > 0.01 + 1e-4 * expected
    assert compared > 500
    assert wrong <= 0.005 * compared  # rays that graze a silhouette may fall on either side of it in float32


def test_picture_from_above_shows_ground_at_its_distance(renderer):
    image = renderer.images([CameraPose((0.0, 0.0, -10.0), STRAIGHT_DOWN, hfov_deg=60.0)], WIDTH, HEIGHT)
    assert (image.kind == GROUND).all()
    assert image.depth_m == pytest.approx(10.0, abs=1e-3)


def test_upper_half_of_a_level_picture_over_the_trees_is_sky(renderer):
    image = renderer.images([CameraPose((0.0, 0.0, -80.0), LEVEL_NORTH)], WIDTH, HEIGHT)
    assert (image.kind[0, : HEIGHT // 2] == SKY).all()
    assert (image.depth_m[0, : HEIGHT // 2] == SKY_DEPTH_M).all()
    assert (image.kind[0, -4:] != SKY).all()
    sky, ground = image.rgb[0, 0].mean(axis=0), image.rgb[0, -1].mean(axis=0)
    assert sky[2] > sky[0]  # blue
    assert ground[1] > ground[2]  # green


def test_tree_has_a_crown_above_its_trunk_and_right_is_east(world, renderer):
    tree = world.trees[np.argmin(np.hypot(world.trees["north"], world.trees["east"]))]
    mid_trunk = 0.5 * (tree["root_height"] + 1.0 + tree["crown_low"] - tree["crown_radius"])
    pos = (float(tree["north"]) - 6.0, float(tree["east"]) - 1.0, -float(mid_trunk))
    image = renderer.images([CameraPose(pos, LEVEL_NORTH, hfov_deg=90.0)], 320, 240)
    kind = image.kind[0]
    column = round(160 + 160 / 6.0)  # 1 m to the east at 6 m
    assert kind[120, column] == TRUNK
    assert CROWN in kind[:120, column]
    assert image.depth_m[0, 120, column] == pytest.approx(6.0 - tree["trunk_radius"], abs=0.1)


def test_walls_are_seen_at_the_edge(world, renderer):
    up = float(world.height(195.0, 0.0)) + 4.0
    image = renderer.images([CameraPose((195.0, 0.0, -up), LEVEL_NORTH)], WIDTH, HEIGHT)
    assert image.kind[0, HEIGHT // 2 + 5, WIDTH // 2] == WALL
    assert image.depth_m[0, HEIGHT // 2 + 5, WIDTH // 2] == pytest.approx(5.0, abs=1e-3)


def test_a_batch_is_the_pictures_one_by_one(world, renderer):
    poses = random_poses(world, 5)
    together = renderer.images(poses, WIDTH, HEIGHT)
    for i, pose in enumerate(poses):
        alone = renderer.images([pose], WIDTH, HEIGHT)
        assert (alone.rgb[0] == together.rgb[i]).all()
        assert (alone.depth_m[0] == together.depth_m[i]).all()


def test_exposure_and_balance_change_the_light(renderer):
    pose = CameraPose((0.0, 0.0, -10.0), STRAIGHT_DOWN)
    dark = CameraPose(pose.pos_ned, pose.q_ned_from_rdf, exposure=0.5)
    warm = CameraPose(pose.pos_ned, pose.q_ned_from_rdf, balance=(1.3, 1.0, 0.7))
    pictures = renderer.images([pose, dark, warm], WIDTH, HEIGHT)
    normal, darker, warmer = pictures.rgb.astype(float).mean(axis=(1, 2))
    assert (darker < 0.85 * normal).all()
    assert warmer[0] > normal[0]
    assert warmer[2] < normal[2]
