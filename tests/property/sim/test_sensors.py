"""Laws of the sensors: repeatable, independent of the batch, exact without noise."""

from math import cos, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.geodesy import GeoPoint
from sim.sensors.sensors import sensor_model
from tests.unit.sim.sensors.recorder import REST_ACCEL_FRD, Recorder

seeds = st.integers(0, 2**31 - 1)
few = settings(max_examples=10, deadline=None)


@few
@given(seeds)
def test_same_seed_same_bits(seed):
    assert Recorder(4, seed=seed).run(300).tobytes() == Recorder(4, seed=seed).run(300).tobytes()


@few
@given(seeds)
def test_another_seed_gives_other_noise(seed):
    first = Recorder(seed=seed).run(10)["imu"]["gyro_frd"]
    second = Recorder(seed=(seed + 1) % 2**31).run(10)["imu"]["gyro_frd"]
    assert not np.any(first == second)


@few
@given(seeds)
def test_one_vehicle_equals_the_first_of_many(seed):
    alone = Recorder(1, seed=seed).run(600)
    among = Recorder(64, seed=seed).run(600)
    assert alone[0].tobytes() == among[0].tobytes()


@few
@given(st.lists(st.integers(1, 40), min_size=2, max_size=6))
def test_the_split_into_launches_does_not_matter(counts):
    parts = Recorder(3)
    split = np.concatenate([parts.run(count) for count in counts], axis=1)
    assert np.array_equal(split, Recorder(3).run(sum(counts)))  # joining rows does not keep padding bytes


def test_rebooting_one_row_touches_only_that_row():
    untouched = Recorder(3)
    rebooted = Recorder(3)
    untouched.run(700)
    rebooted.run(700)
    old_bias = rebooted.states["imu"]["gyro_bias_frd"][1].copy()
    rebooted.states[1] = np.zeros((), rebooted.states.dtype)
    expected, got = untouched.run(200), rebooted.run(200)
    assert np.array_equal(expected[[0, 2]], got[[0, 2]])
    assert got[1, 0]["gnss"]["fix_type"] == 1
    assert not np.array_equal(old_bias, rebooted.states["imu"]["gyro_bias_frd"][1])  # a power-on draws anew


@few
@given(
    seeds,
    st.floats(-np.pi, np.pi),
    st.tuples(st.floats(-200, 200, width=32), st.floats(-200, 200, width=32), st.floats(-35, -1, width=32)),
)
def test_without_noise_the_samples_are_the_truth(seed, yaw, pos_ned):
    recorder = Recorder(noise_scale=0.0, seed=seed)
    recorder.bodies["pos_ned"][0] = pos_ned
    recorder.bodies["q_ned_from_frd"][0] = (0.0, 0.0, sin(0.5 * yaw), cos(0.5 * yaw))
    recorder.bodies["motor_speed"][0, :4] = 600.0
    recorder.bodies["gyro_frd"][0] = (0.1, -0.2, 0.3)
    last = recorder.run(600)[0, -1]
    assert last["imu"]["gyro_frd"].tolist() == recorder.bodies["gyro_frd"][0].tolist()
    assert last["imu"]["accel_frd"].tolist() == np.float32(REST_ACCEL_FRD).tolist()
    assert last["gnss"]["pos_ned"].tolist() == recorder.bodies["pos_ned"][0].tolist()
    assert last["gnss"]["vel_ned"].tolist() == recorder.bodies["vel_ned"][0].tolist()
    assert last["battery"]["voltage_v"] == 15.0
    assert last["battery"]["current_a"] == 12.0
    field = recorder.models["mag"]["field_ned_gauss"][0]
    assert np.linalg.norm(last["mag"]["field_frd_gauss"]) == pytest.approx(np.linalg.norm(field), rel=1e-5)
    assert last["baro"]["pressure_pa"] < 101325.0


@given(st.floats(-60, 60), st.floats(-180, 180), st.floats(-100, 4000), st.floats(0, 3))
@settings(max_examples=30, deadline=None)
def test_any_home_and_noise_make_a_model(lat_deg, lon_deg, alt_m, noise_scale):
    model = sensor_model(noise_scale, GeoPoint(lat_deg, lon_deg, alt_m))
    assert 0.2 < np.linalg.norm(np.array(model.mag.field_ned_gauss)) < 0.7  # gauss: WMM's range on the ground
    assert model.imu.gyro_std == pytest.approx(noise_scale * sensor_model().imu.gyro_std)


def test_a_negative_noise_scale_is_refused():
    with pytest.raises(ValueError, match="noise scale"):
        sensor_model(-1.0)
