import numpy as np

from autopilot.navigator.setpoint import SetpointPort
from autopilot.params import parameter_table
from common.airframe import load_airframe
from sim.rig import Rig
from sim.sensors.sensors import DEFAULT_HOME, sensor_model
from sim.wind import wind_model
from sim.world.world import build_world


def make_rig(vehicle_count, **options):
    rig = Rig(
        load_airframe("x500"),
        build_world(),
        sensor_model(home=DEFAULT_HOME),
        wind_model(4.0, 270.0, 1.0, 1.0),
        home=DEFAULT_HOME,
        vehicle_count=vehicle_count,
        **options,
    )
    rig.load_parameters(parameter_table())
    return rig


def leaves(rows):
    """The plain arrays in an array of structs; the padding between fields is left out."""
    if rows.dtype.names is None:
        return [rows]
    return [leaf for name in rows.dtype.names for leaf in leaves(rows[name])]


def same_bits(first, second):
    """Equal to the bit, NaN too."""
    pairs = zip(first, second, strict=True)
    return all(a.tobytes() == b.tobytes() for x, y in pairs for a, b in zip(leaves(x), leaves(y), strict=True))


def climb(rig, seconds):
    rows = rig.arrays.autopilot.setpoint.numpy()
    for i in range(rig.vehicle_count):
        port = SetpointPort(rows[i : i + 1])
        port.set_flags(is_armed=True, is_landed=False)
        port.fly_to((0.0, 0.0, -5.0), 0.3)
        port.write()
    rig.advance(int(seconds * 250))


def test_a_restored_vehicle_flies_the_same_flight_again():
    rig = make_rig(2)
    rig.advance(2000)
    climb(rig, 3.0)
    start = rig.snapshot()
    rig.advance(250)
    first = rig.snapshot()
    rig.restore(start, np.arange(2), np.arange(2), np.zeros(2))
    rig.advance(250)
    assert same_bits(first, rig.snapshot())


def test_restoring_one_vehicle_touches_only_that_one_and_gives_it_new_noise():
    rig = make_rig(3)
    rig.advance(2000)
    start = rig.snapshot()
    rig.advance(100)
    before = rig.snapshot()
    rig.restore(start, np.array([1]), np.array([1]), np.array([77]))
    after = rig.snapshot()
    others = [0, 2]
    assert same_bits([rows[others] for rows in after], [rows[others] for rows in before])
    is_seed = [rows.shape == (3,) and rows.tolist() == [0, 77, 0] for rows in after]
    assert is_seed.count(True) == 1
    kept = [k for k, is_changed in enumerate(is_seed) if not is_changed]
    assert same_bits([after[k][[1]] for k in kept], [start[k][[1]] for k in kept])


def test_a_restored_vehicle_flies_on_with_the_noise_of_its_new_seed():
    rig = make_rig(2)
    rig.advance(2000)
    rig.restore(rig.snapshot(), np.arange(2), np.zeros(2, dtype=int), np.array([0, 77]))
    gyro = rig.arrays.sensors.numpy()["samples"]["imu"]["gyro_frd"]
    assert np.array_equal(gyro[0], gyro[1])
    rig.advance(1)
    assert not np.array_equal(gyro[0], gyro[1])


def test_threads_do_not_change_a_bit():
    one = make_rig(5, threads=1)
    two = make_rig(5, threads=2)
    for rig in (one, two):
        rig.advance(2000)
        climb(rig, 2.0)
    assert same_bits(one.snapshot(), two.snapshot())
