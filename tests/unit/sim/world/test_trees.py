import numpy as np
import pytest

from sim.world.poisson import COVERAGE, poisson_disc
from sim.world.trees import EDGE_M, ForestMap, tree_type
from sim.world.world import WorldConfig, WorldMap, build_world
from tests.unit.sim.world.queries import query_points, query_rays

FOREST = WorldConfig(size_m=300.0, clearing_blend_m=60.0, trees_per_ha=100.0)
PLAIN = WorldConfig(size_m=100.0, hill_height_m=0.0, trees_per_ha=0.0)


# at (10, 20): trunk radius 0.2 to a height of 4 m, crown of radius 2 round the axis from 4 to 6 m
ONE_TREE = (10.0, 20.0, -1.0, 0.2, 4.0, 6.0, 2.0)


def plain_with(*trees: tuple[float, ...]) -> WorldMap:
    bare = build_world(PLAIN)
    forest = ForestMap(np.array(list(trees), dtype=tree_type()), PLAIN.size_m)
    kernel = bare.kernel
    kernel.forest = forest.kernel("cpu")
    return WorldMap(PLAIN, bare.terrain, forest, bare.walls, kernel)


def test_same_seed_gives_same_bytes_and_another_seed_does_not():
    trees = [build_world(FOREST.model_copy(update={"seed": seed})).trees.tobytes() for seed in (3, 3, 4)]
    assert trees[0] == trees[1]
    assert trees[0] != trees[2]


def test_no_two_trees_are_closer_than_the_spacing_of_their_density():
    trees = build_world(FOREST).trees
    spacing = np.sqrt(COVERAGE * 1.0e4 / FOREST.trees_per_ha)
    north, east = trees["north"].astype(float), trees["east"].astype(float)
    distance = np.hypot(north[:, None] - north, east[:, None] - east) + 1e9 * np.eye(len(trees))
    assert distance.min() > spacing - 1e-4  # float32 positions
    assert np.all(distance.min(axis=1) < 2.0 * spacing)  # and no hole is left: Poisson-disc, not scattered


@pytest.mark.parametrize("spacing_m", [3.0, 10.0])
def test_poisson_disc_reaches_its_coverage(spacing_m):
    side_m = 80.0 * spacing_m
    assert len(poisson_disc(1, side_m, spacing_m, 0.0)) * spacing_m**2 / side_m**2 == pytest.approx(COVERAGE, rel=0.03)


def test_trees_stand_on_the_ground_inside_the_map_and_outside_the_clearing():
    world = build_world(FOREST)
    trees = world.trees
    ground = world.height(trees["north"], trees["east"])
    assert np.all(trees["root_height"] < ground)
    assert np.all(trees["crown_low"] - trees["crown_radius"] > ground + 1.0)
    assert np.all(trees["crown_high"] >= trees["crown_low"])
    assert np.all(trees["crown_radius"] > trees["trunk_radius"])
    assert max(np.abs(trees["north"]).max(), np.abs(trees["east"]).max()) <= 150.0 - EDGE_M
    assert np.all(np.hypot(trees["north"], trees["east"]) - trees["crown_radius"] > FOREST.clearing_radius_m)


def test_defaults_leave_the_air_free_above_15_m_within_120_m_of_home():
    for seed in range(5):
        world = build_world(WorldConfig(seed=seed))
        is_near = np.hypot(world.trees["north"], world.trees["east"]) < 120.0
        assert is_near.sum() > 50
        assert (world.trees["crown_high"] + world.trees["crown_radius"])[is_near].max() < 15.0


@pytest.mark.parametrize(
    ("pos_ned", "contact"),
    [
        ([10.0, 20.4, -1.0], [0.0, 1.0, 0.0, 0.1]),  # east of the trunk
        ([9.6, 20.0, -1.0], [-1.0, 0.0, 0.0, 0.1]),  # south of it
        ([10.0, 20.0, -8.2], [0.0, 0.0, -1.0, 0.1]),  # above the crown
        ([12.2, 20.0, -5.0], [1.0, 0.0, 0.0, 0.1]),  # north of the crown
        ([10.0, 20.0, -5.0], [0.0, 0.0, -1.0, 2.3]),  # on the axis
        ([10.0, 20.6, -1.0], [0.0, 0.0, 0.0, 0.0]),  # apart
        ([10.0, 20.0, -9.0], [0.0, 0.0, 0.0, 0.0]),
    ],
)
def test_contact_pushes_out_of_trunk_and_crown(pos_ned, contact):
    world = plain_with(ONE_TREE)
    _, _, answer = query_points(world, np.array([pos_ned]), radius=0.3)
    np.testing.assert_allclose(answer[0], contact, atol=1e-5)


@pytest.mark.parametrize(
    ("origin_ned", "dir_ned", "distance"),
    [
        ([-20.0, 20.0, -1.0], [1.0, 0.0, 0.0], 29.8),  # the trunk
        ([-20.0, 20.0, -5.0], [1.0, 0.0, 0.0], 28.0),  # the side of the crown
        ([10.0, 20.0, -30.0], [0.0, 0.0, 1.0], 22.0),  # the top of the crown
        ([11.0, 20.0, -1.0], [0.0, 0.0, -1.0], 3.0 - np.sqrt(3.0)),  # the crown from below
        ([10.0, 20.0, -5.0], [1.0, 0.0, 0.0], 0.0),  # from inside
        ([10.0, 20.1, -2.0], [0.0, 0.0, -1.0], 0.0),
        ([-20.0, 22.5, -5.0], [1.0, 0.0, 0.0], 40.0),  # past it
        ([-20.0, 20.5, -1.0], [1.0, 0.0, 0.0], 40.0),  # past the trunk, under the crown
        ([40.0, 20.0, -5.0], [1.0, 0.0, 0.0], 40.0),  # away from it
    ],
)
def test_ray_hits_trunk_and_crown(origin_ned, dir_ned, distance):
    world = plain_with(ONE_TREE)
    assert world.ray_hit(origin_ned, dir_ned, 40.0) == pytest.approx(distance)
    hit = query_rays(world, np.array([origin_ned]), np.array([dir_ned]), 40.0)
    assert hit[0] == pytest.approx(distance, abs=1e-4)


def test_nearer_tree_is_hit_though_its_bucket_comes_later():
    tall = (15.5, 20.0, -1.0, 0.2, 4.0, 6.0, 2.2)  # wide crown: the bucket before, which ends at 11.5, lists it too
    bush = (15.0, 20.0, -1.0, 0.2, 1.0, 2.0, 1.0)
    hit = query_rays(plain_with(tall, bush), np.array([[5.0, 20.0, -1.0]]), np.array([[1.0, 0.0, 0.0]]), 40.0)
    assert hit[0] == pytest.approx(9.0, abs=1e-4)


def test_kernel_finds_every_contact_the_host_finds():
    world = build_world(FOREST)
    pos = np.random.default_rng(0).uniform([-160, -160, -20], [160, 160, 2], (20_000, 3)).astype(np.float32)
    _, _, contact = query_points(world, pos, radius=1.5)
    depth = np.maximum(1.5 - world.forest.distance(pos.astype(float)), 0.0)
    assert (depth > 0.0).sum() > 500
    np.testing.assert_allclose(contact[:, 3], depth, atol=1e-4)


def test_distance_does_not_depend_on_the_company_of_other_points():
    world = build_world(FOREST)
    pos = np.random.default_rng(0).uniform([-140, -140, -20], [140, 140, 2], (700, 3))
    alone = np.array([world.obstacle_distance(point) for point in pos])
    np.testing.assert_array_equal(world.obstacle_distance(pos), alone)


def test_world_without_trees_has_no_obstacles():
    world = build_world(PLAIN)
    assert world.obstacle_distance([0.0, 0.0, -5.0]) == np.inf
    assert world.clearance([0.0, 0.0, -5.0]) == 5.0
    _, _, contact = query_points(world, np.zeros((1, 3)))
    assert np.all(contact == 0.0)
