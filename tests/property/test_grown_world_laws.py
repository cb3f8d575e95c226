"""Laws of grown worlds: what must hold for every seed and all numbers, and which bytes a growth may touch."""

from functools import cache
from itertools import pairwise

import numpy as np
import warp as wp
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.world.batch import WorldBatch
from sim.world.growing import COVERAGE
from sim.world.trees import EDGE_M
from sim.world.world import WorldConfig, WorldMap
from tests.unit.sim.world.queries import query_points

FEW = settings(max_examples=60, deadline=None)  # the first example compiles a kernel
COUNT = 3
CONFIG = WorldConfig(size_m=160.0, trees_per_ha=400.0, tree_height_max_m=20.0)
seeds = st.integers(-(2**31), 2**31 - 1)
rows = st.fixed_dictionaries(
    {
        "hill_height_m": st.floats(0.0, 60.0, width=32),
        "hill_wavelength_m": st.floats(20.0, 500.0, width=32),
        "clearing_radius_m": st.floats(0.0, 100.0, width=32),
        "clearing_blend_m": st.floats(1.0, 100.0, width=32),
        "trees_per_ha": st.floats(0.0, 800.0, width=32),
        "tree_height_max_m": st.floats(5.0, 40.0, width=32),
        "has_walls": st.integers(0, 1),
    }
)


@cache
def batch() -> WorldBatch:
    return WorldBatch(CONFIG, COUNT)


def grow(i_world: int, seed: int, numbers: dict) -> WorldMap:
    table = batch().params.numpy()
    for name, value in numbers.items():
        table[name][i_world] = value
    is_chosen = np.arange(COUNT) == i_world
    batch().grow(wp.array(is_chosen, dtype=wp.bool), wp.full(COUNT, seed, dtype=wp.int32))
    return batch().map(i_world)


def stored_bytes(i_world: int) -> bytes:
    stores = (batch()._heights, batch()._trees, batch()._bucket_start, batch()._bucket_trees, batch().kernels)
    return b"".join(store.numpy()[i_world].tobytes() for store in stores)


@given(seed=seeds, numbers=rows)
@FEW
def test_hills_are_bounded_and_the_clearing_is_level_and_free_of_trees(seed, numbers):
    world = grow(0, seed, numbers)
    assert np.isfinite(world.heights).all()
    rounding = 1.0 + 1e-6  # heights are single precision
    assert np.abs(world.heights).max() <= rounding * numbers["hill_height_m"]
    angle, fraction = np.meshgrid(np.linspace(0.0, 6.3, 30), np.linspace(0.0, 1.0, 10))
    north, east = (fraction * numbers["clearing_radius_m"] * turn(angle) for turn in (np.cos, np.sin))
    is_inside = np.maximum(np.abs(north), np.abs(east)) <= 80.0
    assert np.all(world.height(north, east)[is_inside] == 0.0)
    trees = world.trees
    distance = np.hypot(trees["north"].astype(float), trees["east"].astype(float))
    assert np.all(distance - trees["crown_radius"] > numbers["clearing_radius_m"] - 1e-4)


@given(seed=seeds, numbers=rows)
@FEW
def test_trees_keep_their_spacing_their_bounds_and_fit_the_store(seed, numbers):
    world = grow(1, seed, numbers)
    trees = world.trees
    density = min(numbers["trees_per_ha"], 400.0)
    if density == 0.0:
        assert trees.size == 0
        return
    positions = np.stack([trees["north"], trees["east"]], axis=-1).astype(float)
    distance = np.linalg.norm(positions[:, None] - positions, axis=-1)[~np.eye(len(positions), dtype=bool)]
    assert distance.min(initial=np.inf) > np.sqrt(COVERAGE * 1.0e4 / density) - 1e-4
    height = trees["crown_high"] + trees["crown_radius"] - trees["root_height"] - 1.0
    assert height.max(initial=0.0) < min(numbers["tree_height_max_m"], 20.0) + 1e-3
    assert np.abs(positions).max(initial=0.0) <= 80.0 - EDGE_M
    starts = batch()._bucket_start.numpy()[1]
    assert starts[0] == 0
    assert np.all(np.diff(starts) >= 0)
    assert starts[-1] <= batch()._bucket_trees.shape[1]
    for lower, upper in pairwise(starts):
        listed = batch()._bucket_trees.numpy()[1, lower:upper]
        assert np.all(np.diff(listed) > 0)
        assert np.all((listed >= 0) & (listed < trees.size))


@given(
    seed=seeds, numbers=rows, north=st.floats(-90.0, 90.0), east=st.floats(-90.0, 90.0), fraction=st.floats(-0.1, 1.2)
)
@FEW
def test_contact_depth_is_radius_less_the_distance_on_the_host(seed, numbers, north, east, fraction):
    world = grow(2, seed, numbers)
    pos = np.array([north, east, -float(world.height(north, east)) - 20.0 * fraction])
    height, _, contact = query_points((batch(), 2), pos[None], 1.0)
    # float32 positions on slopes of up to 60 m in 20 m
    assert abs(height[0] - world.height(north, east)) < 1e-3
    assert abs(contact[0, 3] - max(1.0 - float(world.obstacle_distance(pos)), 0.0)) < 1e-3


@given(seed=seeds, numbers=rows, i_world=st.integers(0, COUNT - 1))
@settings(max_examples=25, deadline=None)
def test_a_world_grows_the_same_again_and_leaves_its_neighbours_alone(seed, numbers, i_world):
    world = grow(i_world, seed, numbers)
    before = [stored_bytes(i) for i in range(COUNT)]
    grow(i_world, seed - 1 if seed > 0 else seed + 1, numbers)
    assert [stored_bytes(i) for i in range(COUNT) if i != i_world] == [before[i] for i in range(COUNT) if i != i_world]
    again = grow(i_world, seed, numbers)
    assert again.heights.tobytes() == world.heights.tobytes()
    assert again.trees.tobytes() == world.trees.tobytes()
