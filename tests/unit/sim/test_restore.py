import numpy as np
import pytest
import warp as wp

from autopilot.params import parameter_table
from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from sim.restore import RowRestore
from sim.rig import Rig
from sim.sensors.sensors import sensor_model
from sim.wind import wind_model
from sim.world.batch import WorldBatch
from sim.world.world import WorldConfig, build_world
from tests.unit.sim.test_rig import climb, make_rig, of_rows, same_bits


def put(rig, bank, rows, sources, seeds):
    """Restores rows of the rig from rows of the bank."""
    values = np.zeros((2, rig.vehicle_count), dtype=np.int32)
    values[:, rows] = sources, seeds
    is_chosen = np.isin(np.arange(rig.vehicle_count), rows)
    arrays = [wp.array(values[0], dtype=int), wp.array(is_chosen, dtype=wp.bool), wp.array(values[1], dtype=int)]
    RowRestore(rig, bank, *arrays).launch()


@pytest.fixture(scope="module")
def bank():
    rig = make_rig(3)
    rig.advance(2000)
    climb(rig, 2.0, [0.0, 2.0, -3.0])
    return rig


def test_restored_vehicles_take_every_row_and_a_seed_of_their_own_and_no_other_vehicle_is_touched(bank):
    rig = make_rig(4)
    rig.advance(500)
    before, given = rig.snapshot(), bank.snapshot()
    put(rig, bank, np.array([0, 3]), np.array([2, 1]), np.array([77, 78]))
    after = rig.snapshot()
    assert same_bits(of_rows(after, [1, 2]), of_rows(before, [1, 2]))
    is_seed = [rows.tolist() == [77, 0, 0, 78] for rows in after]
    assert is_seed.count(True) == 1
    kept = [k for k, is_changed in enumerate(is_seed) if not is_changed]
    assert len(kept) > 15  # the estimator's covariance and waiting samples are among them
    assert same_bits([after[k][[0, 3]] for k in kept], [given[k][[2, 1]] for k in kept])


def test_a_restored_vehicle_flies_the_same_flight_again():
    rig, keeper = make_rig(2), make_rig(2)
    rig.advance(2000)
    climb(rig, 3.0)
    put(keeper, rig, np.arange(2), np.arange(2), np.zeros(2))
    rig.advance(250)
    first = rig.snapshot()
    put(rig, keeper, np.arange(2), np.arange(2), np.zeros(2))
    rig.advance(250)
    assert same_bits(first, rig.snapshot())


def test_a_restored_vehicle_flies_on_with_the_noise_of_its_new_seed(bank):
    rig = make_rig(2)
    put(rig, bank, np.arange(2), np.zeros(2, dtype=int), np.array([0, 77]))
    gyro = rig.arrays.sensors.numpy()["samples"]["imu"]["gyro_frd"]
    assert np.array_equal(gyro[0], gyro[1])
    rig.advance(1)
    assert not np.array_equal(gyro[0], gyro[1])


def test_a_recorded_restore_reads_its_arrays_anew(bank):
    rig = make_rig(2)
    sources, is_chosen, seeds = wp.zeros(2, dtype=int), wp.zeros(2, dtype=wp.bool), wp.zeros(2, dtype=int)
    restore = RowRestore(rig, bank, sources, is_chosen, seeds)
    fresh = rig.snapshot()
    restore.launch()
    assert same_bits(rig.snapshot(), fresh)
    is_chosen.numpy()[1], sources.numpy()[1], seeds.numpy()[1] = True, 2, 5
    restore.launch()
    body, wanted = rig.arrays.body.numpy()["pos_ned"], bank.arrays.body.numpy()["pos_ned"]
    assert np.array_equal(body[1], wanted[2])
    assert rig.arrays.seed.numpy().tolist() == [0, 5]
    assert same_bits(of_rows(rig.snapshot(), [0]), of_rows(fresh, [0]))


def test_a_restored_vehicle_stays_in_its_own_world(bank):
    config = WorldConfig(size_m=100.0, hill_height_m=0.0, trees_per_ha=0.0)
    worlds = WorldBatch(config, 3)
    rig = rig_in(worlds, 3)
    put(rig, bank, np.array([2]), np.array([0]), np.array([4]))
    assert rig.arrays.i_world.numpy().tolist() == [0, 1, 2]
    rig.advance(1)


def rig_in(world, vehicle_count):
    rig = Rig(
        load_airframe("x500"),
        world,
        sensor_model(home=DEFAULT_HOME),
        wind_model(0.0),
        home=DEFAULT_HOME,
        vehicle_count=vehicle_count,
        has_estimator=False,
    )
    rig.load_parameters(parameter_table())
    return rig


def dropped(world):
    rig = rig_in(world, 3)
    rig.arrays.body.numpy()["pos_ned"] = [30.0, 20.0, -12.0]
    rig.advance(500)
    return rig


def test_each_vehicle_of_a_batch_of_worlds_meets_its_own_ground_and_trees():
    """Dropped at the same place, each comes to rest where it does alone in a copy of its world."""
    config = WorldConfig(
        size_m=100.0, hill_height_m=6.0, hill_wavelength_m=40.0, clearing_radius_m=1.0, clearing_blend_m=10.0
    )
    worlds = WorldBatch(config, 3)
    worlds.grow_all(5)
    together = dropped(worlds)
    resting = []
    for i in range(3):
        alone = dropped(worlds.map(i))
        assert same_bits(of_rows(together.snapshot(), [i]), of_rows(alone.snapshot(), [i]))
        resting.append(float(alone.arrays.body.numpy()["pos_ned"][i, 2]))
    assert np.ptp(resting) > 0.5


def test_vehicles_and_worlds_of_different_counts_are_refused():
    with pytest.raises(ValueError, match="2 vehicles need as many worlds, not 3"):
        rig_in(WorldBatch(WorldConfig(size_m=50.0), 3), 2)


def test_a_rig_in_one_world_gives_it_to_all():
    rig = rig_in(build_world(WorldConfig(size_m=50.0)), 4)
    assert rig.arrays.i_world.numpy().tolist() == [0, 0, 0, 0]
