import numpy as np
import pytest
import warp as wp

from common.kernels import TICK_S
from sim.world.batch import WorldBatch, grown_world
from sim.world.boxes import BoxesMap, box_type
from sim.world.building import ENTRANCE_M, SPOT_WIDTH_M, most_boxes, spot_pose
from sim.world.world import WorldConfig, WorldMap, build_world
from tests.unit.sim.world.queries import query_points, query_rays

PLAIN = WorldConfig(size_m=100.0, hill_height_m=0.0, trees_per_ha=0.0)
HILLS = PLAIN.model_copy(
    update={"cell_m": 1.0, "hill_height_m": 3.0, "hill_wavelength_m": 60.0, "clearing_radius_m": 2.0}
)
COURSE = HILLS.model_copy(update={"clearing_blend_m": 5.0, "wall_count": 20, "mover_count": 6})
LOT = HILLS.model_copy(update={"clearing_blend_m": 5.0, "mover_count": 3, "spot_count": 5})

# at (10, 20), pointing east: 4 m by 2 m, to 1 m above home
EAST_BOX = (10.0, 20.0, 0.0, 1.0, 2.0, 1.0, -1.0, 1.0, 0.0, 0, 0)
# the same, running 3 m ahead and back: 4 s for all
CART = (*EAST_BOX[:8], 3.0, 1000, 250)


def plain_with(*boxes: tuple[float, ...], tick: int = 0) -> WorldMap:
    bare = build_world(PLAIN)
    rows = BoxesMap(np.array(list(boxes), dtype=box_type()))
    kernel = bare.kernel
    kernel.boxes = rows.kernel("cpu")
    kernel.boxes.tick = tick
    return WorldMap(PLAIN, bare.terrain, bare.forest, bare.walls, kernel, rows)


@pytest.mark.parametrize(
    ("pos_ned", "contact"),
    [
        ([11.2, 20.0, -0.5], [1.0, 0.0, 0.0, 0.1]),
        ([8.8, 20.0, -0.5], [-1.0, 0.0, 0.0, 0.1]),
        ([10.0, 22.2, -0.5], [0.0, 1.0, 0.0, 0.1]),
        ([10.0, 17.8, -0.5], [0.0, -1.0, 0.0, 0.1]),
        ([10.0, 20.0, -1.2], [0.0, 0.0, -1.0, 0.1]),  # on the top
        ([10.9, 20.0, -0.5], [1.0, 0.0, 0.0, 0.4]),  # centre inside
        ([10.0, 20.0, -0.9], [0.0, 0.0, -1.0, 0.4]),
        ([11.1, 22.1, -0.5], [np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.3 - np.sqrt(0.02)]),  # at a corner
        ([11.4, 20.0, -0.5], [0.0, 0.0, 0.0, 0.0]),
        ([10.0, 20.0, -1.4], [0.0, 0.0, 0.0, 0.0]),
    ],
)
def test_contact_pushes_off_the_nearest_face(pos_ned, contact):
    _, _, answer = query_points(plain_with(EAST_BOX), np.array([pos_ned]), radius=0.3)
    np.testing.assert_allclose(answer[0], contact, atol=1e-5)


@pytest.mark.parametrize(
    ("tick", "east_m"), [(0, 20.0), (250, 17.0), (500, 20.0), (750, 23.0), (1000, 20.0), (10**9 * 2, 20.0)]
)
def test_a_mover_runs_to_and_fro_as_a_function_of_the_tick(tick, east_m):
    """It begins a quarter into its run: in the middle, on its way back; a quarter later it turns."""
    world = plain_with(CART, tick=tick)
    np.testing.assert_allclose(world.boxes.middle(tick), [[10.0, east_m]], atol=1e-6)
    hit = query_rays(world, np.array([[10.0, 0.0, -0.5]]), np.array([[0.0, 1.0, 0.0]]), 40.0)
    assert hit[0] == pytest.approx(east_m - 2.0, abs=1e-4)
    assert world.ray_hit([10.0, 0.0, -0.5], [0.0, 1.0, 0.0], 40.0, tick) == pytest.approx(east_m - 2.0)


@pytest.mark.parametrize("config", [COURSE, LOT])
def test_kernels_meet_what_the_host_meets(config):
    world = grown_world(config, 5)
    world.kernel.boxes.tick = tick = 777
    rng = np.random.default_rng(0)
    boxes = world.boxes.rows
    near = np.stack([boxes["north"], boxes["east"], -boxes["high"]], axis=1)[rng.integers(0, len(boxes), 4000)]
    pos = (near + rng.normal(size=(4000, 3)) * [2.0, 2.0, 0.5]).astype(np.float32)
    _, _, contact = query_points(world, pos, radius=0.4)
    depth = np.maximum(0.4 - world.obstacle_distance(pos.astype(float), tick), 0.0)
    assert (depth > 0.0).sum() > 300
    np.testing.assert_allclose(contact[:, 3], depth, atol=1e-4)
    direction = rng.normal(size=(400, 3)) * [1.0, 1.0, 0.2]
    direction = (direction / np.linalg.norm(direction, axis=1, keepdims=True)).astype(np.float32)
    kernel = query_rays(world, pos[:400], direction, 30.0)
    host = [world.ray_hit(o, d, 30.0, tick) for o, d in zip(pos[:400], direction, strict=True)]
    assert np.mean(np.abs(kernel - host) > 1e-3) < 0.01  # grazing rays may hit or miss within rounding


def test_same_seed_gives_same_boxes_and_another_seed_does_not():
    first, second = WorldBatch(COURSE, 3), WorldBatch(COURSE, 3)
    first.grow_all(1)
    second.grow_all(2)
    rows = [[batch.map(i).boxes.rows.tobytes() for i in range(3)] for batch in (first, second)]
    assert rows[0][1:] == rows[1][:2]
    assert rows[0][0] != rows[0][1]
    assert grown_world(COURSE, 3).boxes.rows.tobytes() == rows[0][2]


def test_a_world_has_the_walls_and_movers_that_its_numbers_ask_for():
    batch = WorldBatch(COURSE, 3)
    rows = batch.params.numpy()
    rows["wall_count"], rows["mover_count"] = [0, 7, 99], [0, 2, 0]
    batch.grow_all(1)
    counts = [len(batch.map(i).boxes.rows) for i in range(3)]
    assert counts == [0, 9, most_boxes(20, 6, 0)]  # never more than there is room for
    assert batch.map(1).boxes.rows["period_ticks"].astype(bool).sum() == 2


@pytest.mark.parametrize("config", [COURSE, LOT])
def test_home_stays_free_at_all_times_and_every_box_stands_in_the_ground(config):
    for seed in range(5):
        world = grown_world(config, seed)
        distance = [world.boxes.distance(np.array([[0.0, 0.0, -0.3]]), tick)[0] for tick in range(0, 12000, 50)]
        assert min(distance) > 0.8
        rows = world.boxes.rows
        ground = world.height(rows["north"], rows["east"])
        assert np.all(rows["low"] < ground - 0.9)
        assert np.all((rows["high"] > ground + 0.1) & (rows["high"] < ground + 4.0))
        speed = 4.0 * rows["half_way"] / np.maximum(rows["period_ticks"], 1) / TICK_S
        assert np.all(speed <= 1.001)


@wp.kernel
def _spots(seed: int, spot_count: int, poses: wp.array[wp.vec3]):
    i = wp.tid()
    poses[i] = spot_pose(seed, spot_count, i)


def test_each_row_of_a_car_park_has_a_free_spot_and_every_spot_opens_to_the_aisle():
    for seed in range(8):
        world = grown_world(LOT, seed)
        poses = wp.zeros(10, dtype=wp.vec3)
        wp.launch(_spots, dim=10, inputs=[seed, 5, poses])
        north, east, heading = poses.numpy().T
        standing = world.boxes.rows[world.boxes.rows["period_ticks"] == 0]
        parked = BoxesMap(standing)
        height = world.height(north, east) + 0.2
        room = parked.distance(np.stack([north, east, -height], axis=1))
        is_free = room > 0.4  # half a spot's width is 0.55
        assert is_free[:5].any()
        assert is_free[5:].any()
        out = np.stack([north + np.cos(heading), east + np.sin(heading), -height], axis=1)
        assert np.all(parked.distance(out) > 0.25)  # before it begins the aisle
        assert np.hypot(north, east).min() > ENTRANCE_M + 0.4 * SPOT_WIDTH_M


def test_boxes_are_an_option():
    world = build_world(PLAIN)
    assert world.obstacle_distance([0.0, 0.0, -1.0]) == np.inf
    assert grown_world(PLAIN, 1).boxes.rows.size == 0
