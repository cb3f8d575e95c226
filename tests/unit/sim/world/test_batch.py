import numpy as np
import warp as wp

from sim.world.batch import WorldBatch, grown_world
from sim.world.world import WorldConfig
from tests.unit.sim.world.queries import query_points

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
