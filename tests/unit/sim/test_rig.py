import numpy as np
import pytest
import warp as wp

from autopilot.navigator.setpoint import SetpointPort
from autopilot.params import parameter_table
from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from sim.rig import Rig
from sim.sensors.sensors import sensor_model
from sim.wind import wind_model
from sim.world.world import build_world


def make_rig(vehicle_count, *, is_noisy=True, noise_scale=1.0, **options):
    rig = Rig(
        load_airframe("x500"),
        build_world(),
        sensor_model(noise_scale=noise_scale if is_noisy else 0.0, home=DEFAULT_HOME),
        wind_model(4.0, 270.0, 1.0, 1.0) if is_noisy else wind_model(0.0),
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


def climb(rig, seconds, norths=None):
    rows = rig.arrays.autopilot.setpoint.numpy()
    for i in range(rig.vehicle_count):
        port = SetpointPort(rows[i : i + 1])
        port.set_flags(is_armed=True, is_landed=False)
        port.fly_to((0.0 if norths is None else norths[i], 0.0, -5.0), 0.3)
        port.write()
    rig.advance(int(seconds * 250))


def of_rows(snapshot, rows):
    """The chosen vehicles of a snapshot, in this order."""
    return [array[rows] for array in snapshot]


def test_a_restored_rig_flies_the_same_flight_again():
    rig, other = make_rig(2), make_rig(2, seed=9)
    rig.advance(2000)
    climb(rig, 3.0)
    start = rig.snapshot()
    rig.advance(250)
    other.restore(start)
    assert same_bits(other.snapshot(), start)
    other.advance(250)
    assert same_bits(rig.snapshot(), other.snapshot())


def test_threads_do_not_change_a_bit():
    one = make_rig(5, threads=1)
    two = make_rig(5, threads=2)
    for rig in (one, two):
        rig.advance(2000)
        climb(rig, 2.0)
    assert same_bits(one.snapshot(), two.snapshot())


def test_a_single_vehicle_flies_as_the_same_row_of_many():
    one, many = make_rig(1), make_rig(64)
    for rig in (one, many):
        rig.advance(750)
        climb(rig, 2.0)
    assert one.arrays.body.numpy()["pos_ned"][0, 2] < -0.5
    assert same_bits(one.snapshot(), of_rows(many.snapshot(), [0]))


def test_permuting_the_vehicles_permutes_the_results():
    norths = np.array([0.0, 3.0, -7.0, 12.0, 5.0])
    order = np.array([3, 0, 4, 1, 2])
    first, second = make_rig(5, is_noisy=False), make_rig(5, is_noisy=False)
    for rig, wanted in ((first, norths), (second, norths[order])):
        rig.advance(750)
        climb(rig, 4.0, wanted)
    assert np.ptp(first.arrays.body.numpy()["pos_ned"][:, 0]) > 1.0
    for name, (a, b) in {
        "body": (first.arrays.body, second.arrays.body),
        "estimator": (first.arrays.autopilot.ekf.rows, second.arrays.autopilot.ekf.rows),
        "covariance": (first.arrays.autopilot.ekf.covariance, second.arrays.autopilot.ekf.covariance),
        "control": (first.arrays.autopilot.control, second.arrays.autopilot.control),
    }.items():
        assert same_bits([a.numpy()[order]], [b.numpy()]), name


def test_neighbours_and_their_seeds_change_nothing():
    first, second = make_rig(3), make_rig(3)
    second.arrays.seed.numpy()[:] = [5, 0, 9]
    for rig in (first, second):
        rig.advance(750)
    first, second = (rig.snapshot() for rig in (first, second))
    assert same_bits(of_rows(first, [1]), of_rows(second, [1]))
    assert not same_bits(of_rows(first, [0]), of_rows(second, [0]))


def test_the_same_seed_gives_the_same_bytes_and_another_gives_others():
    snapshots = []
    for seed in (7, 7, 8):
        rig = make_rig(2, seed=seed)
        rig.advance(750)
        snapshots.append(rig.snapshot())
    assert same_bits(snapshots[0], snapshots[1])
    assert not same_bits(snapshots[0], snapshots[2])


def test_the_number_of_ticks_in_a_launch_changes_nothing():
    first, second = make_rig(2), make_rig(2)
    first.advance(750)
    for _ in range(150):
        second.advance(5)
    assert same_bits(first.snapshot(), second.snapshot())


def test_booting_one_vehicle_touches_only_that_one():
    rig = make_rig(3)
    fresh = rig.snapshot()
    rig.advance(750)
    climb(rig, 2.0)
    before = rig.snapshot()
    rig.boot(np.array([False, True, False]))
    after = rig.snapshot()
    assert same_bits(of_rows(after, [0, 2]), of_rows(before, [0, 2]))
    assert rig.arrays.body.numpy()["pos_ned"][1, 2] == fresh_body(fresh)["pos_ned"][1, 2]
    rig.advance(1250)  # it aligns anew
    estimate = rig.arrays.autopilot.ekf.rows.numpy()["estimate"][1]
    assert estimate["pos_h_std"] < 2.0
    assert abs(estimate["pos_ned"][2] - rig.arrays.body.numpy()["pos_ned"][1, 2]) < 1.0


def test_reboot_restarts_the_controller_and_leaves_the_body_where_it_is():
    rig = make_rig(2)
    rig.advance(750)
    climb(rig, 1.0)
    body = rig.arrays.body.numpy()[0].copy()
    neighbour = of_rows(rig.snapshot(), [1])
    rig.reboot(0)
    after = rig.arrays.body.numpy()[0]
    assert all(np.array_equal(after[name], body[name]) for name in ("pos_ned", "vel_ned", "battery_charge_c"))
    assert rig.arrays.autopilot.ekf.rows.numpy()["estimate"]["flags"][0] == 0
    assert same_bits(of_rows(rig.snapshot(), [1]), neighbour)


def fresh_body(snapshot):
    return next(rows for rows in snapshot if rows.dtype.names and "rotor_speed" in rows.dtype.names)


@pytest.mark.parametrize("noise_scale", [0.0, 0.2])
def test_slow_climb_with_quiet_sensors_is_not_taken_for_rest(noise_scale):
    rig = make_rig(4, noise_scale=noise_scale)  # in a wind of 4 m/s
    rig.advance(2000)
    climb(rig, 15.0)
    rows = rig.arrays.autopilot.setpoint.numpy()
    for i in range(4):
        port = SetpointPort(rows[i : i + 1])
        port.set_flags(is_armed=True, is_landed=False)
        port.move((0.0, 0.0, -0.3), 0.0)
        port.write()
    before, height_before = height_errors(rig), -rig.arrays.body.numpy()["pos_ned"][:, 2]
    rig.advance(20 * 250)
    assert np.all(-rig.arrays.body.numpy()["pos_ned"][:, 2] - height_before > 5.0)
    assert np.abs(height_errors(rig) - before).max() < 0.3
    assert not rig.arrays.autopilot.ekf.rows.numpy()["stillness"]["is_still"].any()


def height_errors(rig):
    """[m] estimated minus true."""
    estimate = rig.arrays.autopilot.ekf.rows.numpy()["estimate"]
    return rig.arrays.body.numpy()["pos_ned"][:, 2] - estimate["pos_ned"][:, 2]


@pytest.mark.parametrize("has_mirrors", [False, True])
def test_rows_are_one_view_that_shows_the_present_and_follow_an_array_that_is_replaced(has_mirrors):
    rig = make_rig(1, has_mirrors=has_mirrors)
    ticks = rig.rows["tick"]
    rig.advance(250)
    assert rig.rows["tick"] is ticks
    assert ticks.tolist() == [250]
    if not has_mirrors:
        rig.arrays.tick = wp.array([7], dtype=wp.int64, device="cpu")
        assert rig.rows["tick"].tolist() == [7]
