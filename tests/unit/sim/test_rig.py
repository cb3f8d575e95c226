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
    assert all(np.array_equal(a, b) for a, b in zip(first, rig.snapshot(), strict=True))


def test_restoring_one_vehicle_touches_only_that_one_and_gives_it_new_noise():
    rig = make_rig(3)
    rig.advance(2000)
    start = rig.snapshot()
    rig.advance(100)
    before = rig.snapshot()
    rig.restore(start, np.array([1]), np.array([1]), np.array([77]))
    after = rig.snapshot()
    for a, b, c in zip(before, after, start, strict=True):
        assert np.array_equal(a[[0, 2]], b[[0, 2]])
        assert np.array_equal(b[1], c[1]) or c[1] == 0  # the seed, 0 before
    assert rig.arrays.seed.numpy().tolist() == [0, 77, 0]
    rig.advance(100)
    gyro = rig.arrays.sensors.numpy()["samples"]["imu"]["gyro_frd"]
    replayed = before[[i for i, a in enumerate(before) if a.dtype == gyro.base.dtype][0]]
    assert not np.array_equal(gyro[1], replayed["samples"]["imu"]["gyro_frd"][1])


def test_threads_do_not_change_a_bit():
    one = make_rig(5, threads=1)
    two = make_rig(5, threads=2)
    for rig in (one, two):
        rig.advance(2000)
        climb(rig, 2.0)
    assert all(np.array_equal(a, b, equal_nan=False) or _same_bytes(a, b) for a, b in zip(one.snapshot(), two.snapshot(), strict=True))


def _same_bytes(a, b):
    return a.tobytes() == b.tobytes()
