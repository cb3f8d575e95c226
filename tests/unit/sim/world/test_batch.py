import numpy as np
import pytest
import warp as wp

from sim.world.batch import WorldBatch, grown_world
from sim.world.custom.heightmap import write_heightmap
from sim.world.custom.world_file import BoxSolid, WorldFile
from sim.world.growing import COVERAGE
from sim.world.trees import CROWN_RADIUS_FRACTION, EDGE_M
from sim.world.world import WorldConfig, build_world
from tests.unit.sim.world.queries import query_points, query_rays

CONFIG = WorldConfig(
    size_m=256.0,
    hill_height_m=8.0,
    hill_wavelength_m=120.0,
    clearing_radius_m=5.0,
    clearing_blend_m=60.0,
    trees_per_ha=100.0,
    tree_height_min_m=8.0,
    tree_height_max_m=15.0,
    has_walls=True,
)


def grown(count, config=CONFIG, first_seed=1, **limits):
    batch = WorldBatch(config, count, **limits)
    batch.grow_all(first_seed)
    return batch


def regrow(batch, rows, seeds):
    is_chosen = np.zeros(batch.count, dtype=bool)
    is_chosen[rows] = True
    values = np.full(batch.count, 999, dtype=np.int32)
    values[rows] = seeds
    batch.grow(wp.array(is_chosen, dtype=wp.bool), wp.array(values, dtype=wp.int32))


def bytes_of(batch, i_world):
    world, kernel = batch.map(i_world), batch.kernels.numpy()[i_world]
    entries = int(batch._bucket_start.numpy()[i_world, -1])
    return (
        world.heights.tobytes()
        + world.trees.tobytes()
        + batch._bucket_start.numpy()[i_world].tobytes()
        + batch._bucket_trees.numpy()[i_world, :entries].tobytes()
        + kernel["terrain"]["ground_max_m"].tobytes()
        + kernel["forest"]["top_m"].tobytes()
        + kernel["walls"]["top_m"].tobytes()
    )


def set_params(batch, **values):
    rows = batch.params.numpy()
    for name, value in values.items():
        rows[name] = value


def spacing_of(trees):
    north, east = trees["north"].astype(float), trees["east"].astype(float)
    return (np.hypot(north[:, None] - north, east[:, None] - east) + 1e9 * np.eye(len(trees))).min(axis=1)


def test_same_seed_gives_same_bytes_and_another_seed_does_not():
    first, second = grown(3), grown(3)
    assert [bytes_of(first, i) for i in range(3)] == [bytes_of(second, i) for i in range(3)]
    assert len({bytes_of(first, i) for i in range(3)}) == 3


def test_a_world_of_many_equals_the_one_of_a_batch_of_one():
    many = grown(4, first_seed=7)
    one = grown(1, first_seed=9)
    assert bytes_of(many, 2) == bytes_of(one, 0)
    assert grown_world(CONFIG, 9).trees.tobytes() == many.map(2).trees.tobytes()
    assert grown_world(CONFIG, 9).config == CONFIG.model_copy(update={"seed": 9})


def test_the_room_of_a_batch_changes_no_world_that_fits():
    roomy = grown(1, trees_per_ha_max=600.0, tree_height_limit_m=30.0)
    assert bytes_of(roomy, 0) == bytes_of(grown(1), 0)


def test_growing_some_worlds_leaves_every_byte_of_the_others():
    batch = grown(4)
    before = [bytes_of(batch, i) for i in range(4)]
    regrow(batch, [1, 3], [41, 43])
    after = [bytes_of(batch, i) for i in range(4)]
    assert (after[0], after[2]) == (before[0], before[2])
    assert after[1] != before[1]
    assert after[3] == bytes_of(grown(1, first_seed=43), 0)


def test_a_batch_is_level_and_empty_until_it_is_grown():
    world = WorldBatch(CONFIG, 2).map(1)
    assert np.all(world.heights == 0.0)
    assert world.trees.size == 0
    _, _, contact = query_points(world, np.zeros((1, 3)))
    assert np.all(contact == 0.0)


def test_kernels_meet_what_the_host_meets():
    batch = grown(3)
    world, position = batch.map(1), (batch, 1)
    rng = np.random.default_rng(0)
    pos = rng.uniform([-135, -135, -22], [135, 135, 9], (10_000, 3)).astype(np.float32)
    height, _, contact = query_points(position, pos, radius=1.5)
    np.testing.assert_allclose(height, world.height(pos[:, 0], pos[:, 1]), atol=5e-5)
    depth = np.maximum(1.5 - world.obstacle_distance(pos.astype(float)), 0.0)
    assert (depth > 0.0).sum() > 500
    np.testing.assert_allclose(contact[:, 3], depth, atol=1e-4)
    direction = rng.normal(size=(800, 3)) * [1.0, 1.0, 0.4]
    direction = (direction / np.linalg.norm(direction, axis=1, keepdims=True)).astype(np.float32)
    kernel = query_rays(position, pos[:800], direction, 150.0)
    error = np.abs(kernel - [world.ray_hit(o, d, 150.0) for o, d in zip(pos[:800], direction, strict=True)])
    assert np.percentile(error, 99) < 1e-3  # float32 over 150 m
    assert np.mean(error > 0.02) < 3e-3  # grazing rays may hit or miss within rounding


def test_the_map_of_a_world_answers_as_its_row_of_the_batch():
    """A flight in the copy meets exactly what a vehicle of the batch meets."""
    batch = grown(2)
    pos = np.random.default_rng(1).uniform([-140, -140, -20], [140, 140, 9], (5000, 3))
    direction = np.tile([0.6, 0.64, 0.48], (5000, 1))
    for a, b in zip(query_points(batch.map(1), pos, 1.0), query_points((batch, 1), pos, 1.0), strict=True):
        np.testing.assert_array_equal(a, b)
    hits = [query_rays(position, pos, direction, 60.0) for position in (batch.map(1), (batch, 1))]
    np.testing.assert_array_equal(*hits)


def test_copies_of_a_world_keep_what_they_were_when_it_grows_anew():
    batch = grown(2)
    world = batch.map(0)
    heights = world.heights.tobytes()
    regrow(batch, [0], [99])
    assert world.heights.tobytes() == heights
    assert batch.map(0).heights.tobytes() != heights


def test_trees_are_as_many_as_asked_and_never_closer_than_their_spacing():
    asked = np.array([30.0, 100.0, 300.0])
    batch = WorldBatch(CONFIG.model_copy(update={"size_m": 400.0}), 3, trees_per_ha_max=300.0)
    set_params(batch, trees_per_ha=asked, clearing_radius_m=0.0)
    for seed, density in zip((1, 50), (1.0, 0.5), strict=True):
        set_params(batch, trees_per_ha=density * asked)
        batch.grow_all(seed)
        for i, trees_per_ha in enumerate(density * asked):
            trees = batch.map(i).trees  # on 390 m x 390 m
            assert len(trees) / 15.21 == pytest.approx(trees_per_ha, rel=0.08)
            spacing_m = np.sqrt(COVERAGE * 1.0e4 / trees_per_ha)
            assert spacing_of(trees).min() > spacing_m - 1e-4  # float32 positions
            assert spacing_of(trees).max() < 2.0 * spacing_m  # and few holes are left: not scattered


def test_density_is_met_in_the_mean():
    batch = grown(24, CONFIG.model_copy(update={"size_m": 500.0, "clearing_radius_m": 0.0}))
    counts = batch.kernels.numpy()["forest"]["tree_count"]
    assert counts.mean() / 24.0 - 100.0 == pytest.approx(0.0, abs=2.0)  # 490 m x 490 m of planted ground are 24 ha


def test_trees_stand_on_the_ground_inside_the_map_and_outside_the_clearing():
    batch = grown(2)
    for i in range(2):
        world = batch.map(i)
        trees = world.trees
        ground = world.height(trees["north"], trees["east"])
        height = trees["crown_high"] + trees["crown_radius"] - ground
        assert height.min() > 8.0 - 1e-3
        assert height.max() < 15.0 + 1e-3
        assert np.ptp(height) > 6.0
        fraction = trees["crown_radius"] / height
        assert CROWN_RADIUS_FRACTION[0] - 1e-3 < fraction.min() < fraction.max() < CROWN_RADIUS_FRACTION[1] + 1e-3
        np.testing.assert_allclose(trees["root_height"], ground - 1.0, atol=1e-4)
        assert max(np.abs(trees["north"]).max(), np.abs(trees["east"]).max()) <= 128.0 - EDGE_M
        assert np.all(np.hypot(trees["north"], trees["east"]) - trees["crown_radius"] > CONFIG.clearing_radius_m)


def test_hills_stay_within_their_bound_and_use_it_and_home_is_level():
    world = grown(1, CONFIG.model_copy(update={"clearing_blend_m": 1.0, "clearing_radius_m": 0.0})).map(0)
    assert np.abs(world.heights).max() == pytest.approx(8.0)
    world = grown(1, CONFIG.model_copy(update={"clearing_radius_m": 30.0})).map(0)
    assert np.abs(world.heights).max() <= 8.0
    angle, radius = np.meshgrid(np.linspace(0.0, 6.3, 100), np.linspace(0.0, 30.0, 50))
    assert np.all(world.height(radius * np.cos(angle), radius * np.sin(angle)) == 0.0)


def test_hills_have_the_character_of_those_of_a_single_world():
    """As steep and as rough: mean slope and mean bend of the ground, over some seeds."""
    config = CONFIG.model_copy(update={"clearing_blend_m": 1.0})
    batch = grown(12, config)
    single = [build_world(config.model_copy(update={"seed": seed, "trees_per_ha": 0.0})).heights for seed in range(12)]
    for order in (1, 2):
        ours = np.mean([np.abs(np.diff(batch.map(i).heights, n=order, axis=0)).mean() for i in range(12)])
        theirs = np.mean([np.abs(np.diff(heights, n=order, axis=0)).mean() for heights in single])
        assert ours == pytest.approx(theirs, rel=0.15)


def test_each_world_is_grown_from_numbers_of_its_own():
    batch = WorldBatch(CONFIG, 3)
    set_params(
        batch, hill_height_m=[0.0, 2.0, 8.0], trees_per_ha=[0.0, 50.0, 100.0], has_walls=[0, 1, 1], wall_height_m=20.0
    )
    batch.grow_all(1)
    plain, low, high = (batch.map(i) for i in range(3))
    assert np.all(plain.heights == 0.0)
    assert plain.trees.size == 0
    assert not plain.walls.is_built
    assert plain.obstacle_distance([0.0, 0.0, -5.0]) == np.inf
    assert 1.0 < np.abs(low.heights).max() <= 2.0 < np.abs(high.heights).max()
    assert low.trees.size < 0.6 * high.trees.size
    edges = np.concatenate([high.heights[[0, -1]].ravel(), high.heights[:, [0, -1]].ravel()])
    assert high.walls.top_m == pytest.approx(edges.max() + 20.0)
    assert (low.config.hill_height_m, low.config.trees_per_ha, low.config.has_walls) == (2.0, 50.0, True)


def test_numbers_beyond_the_room_of_the_batch_get_its_limits():
    batch = WorldBatch(CONFIG, 2)
    set_params(batch, trees_per_ha=1.0e6, tree_height_min_m=40.0, tree_height_max_m=60.0)
    batch.grow_all(1)
    world = batch.map(0)
    height = world.trees["crown_high"] + world.trees["crown_radius"] - world.trees["root_height"] - 1.0
    assert height.max() <= 15.0 + 1e-3
    assert 500 < len(world.trees) <= batch._trees.shape[1]
    assert len(world.trees) == pytest.approx(630, rel=0.1)


@pytest.mark.parametrize("trees_per_ha", [20.0, 600.0])
def test_there_is_room_for_every_tree_that_lands(trees_per_ha):
    highest = {"trees_per_ha": trees_per_ha, "tree_height_min_m": 15.0, "size_m": 100.0}
    batch = grown(60, CONFIG.model_copy(update=highest))
    assert batch.kernels.numpy()["forest"]["tree_count"].max() < batch._trees.shape[1]
    assert batch._bucket_start.numpy()[:, -1].max() < 0.98 * batch._bucket_trees.shape[1]


def test_a_batch_has_as_many_octaves_as_its_configuration():
    smooth, rough = (grown(1, CONFIG.model_copy(update={"octaves": octaves})).map(0).heights for octaves in (1, 6))
    roughness = [np.abs(np.diff(h, n=2, axis=0)).mean() for h in (smooth, rough)]
    assert roughness[1] > 2.0 * roughness[0]
    assert np.corrcoef(smooth.ravel(), rough.ravel())[0, 1] > 0.8


def test_worlds_with_a_heightmap_have_its_ground_and_trees_of_their_own(tmp_path):
    """As one that is built of it alone: points, rays and contact; walls too."""
    file = tmp_path / "hills.png"
    png, heightmap = write_heightmap(build_world(CONFIG).terrain)
    file.write_bytes(png)
    config = WorldFile(
        heightmap=heightmap.model_copy(update={"file": file}),
        trees_per_ha=100.0,
        has_walls=True,
        boxes=[BoxSolid(position_ned_m=(20.0, 10.0), size_m=(4.0, 4.0, 3.0))],
    )
    batch = WorldBatch(config, 2)
    batch.grow_all(1)
    one = build_world(config.model_copy(update={"trees_per_ha": 0.0}))
    for i_world in range(2):
        assert batch.map(i_world).heights.tobytes() == one.heights.tobytes()
    assert batch.map(0).trees.tobytes() != batch.map(1).trees.tobytes()
    roots = batch.map(0).trees
    assert len(roots) > 50
    bare = WorldBatch(config.model_copy(update={"trees_per_ha": 0.0}), 2)
    bare.grow_all(1)
    rng = np.random.default_rng(1)
    pos = np.column_stack([rng.uniform(-120.0, 120.0, (500, 2)), rng.uniform(-12.0, 2.0, 500)])
    for of_batch, of_one in zip(query_points((bare, 1), pos), query_points(one, pos), strict=True):
        np.testing.assert_array_equal(of_batch, of_one)
    dirs = rng.normal(size=(500, 3))
    dirs /= np.linalg.norm(dirs, axis=1, keepdims=True)
    np.testing.assert_array_equal(query_rays((bare, 1), pos, dirs, 60.0), query_rays(one, pos, dirs, 60.0))
