"""The magnetometer: the world field in frd, iron and noise."""

from math import atan2, cos, degrees, radians, sin

import numpy as np
import pytest

from common.geodesy import DEFAULT_HOME
from common.geomagnetic import field_ned_gauss
from tests.unit.sim.sensors.recorder import Recorder, arrivals


def yawed(recorder, yaw_rad):
    recorder.bodies["q_ned_from_frd"] = (0.0, 0.0, sin(0.5 * yaw_rad), cos(0.5 * yaw_rad))
    return recorder


def test_samples_come_at_25_hertz_without_delay():
    mag = Recorder().run(500)["mag"][0]
    new = arrivals(mag)
    assert np.all(np.diff(new) == 10)
    assert np.all(mag["time_us"][new] == (new + 1) * 4000)


@pytest.mark.parametrize("yaw_deg", [0.0, 90.0, -135.0])
def test_a_perfect_magnetometer_sees_the_world_field_turned_by_the_heading(yaw_deg):
    field = field_ned_gauss(DEFAULT_HOME.lat_deg, DEFAULT_HOME.lon_deg, DEFAULT_HOME.alt_m)
    seen = yawed(Recorder(noise_scale=0.0), radians(yaw_deg)).run(10)["mag"][0, -1]["field_frd_gauss"]
    heading_from_field = degrees(atan2(field[1], field[0]) - atan2(seen[1], seen[0]))
    assert (heading_from_field - yaw_deg + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1e-3)
    assert seen[2] == pytest.approx(field[2], abs=1e-6)


def test_noise_is_that_of_the_rm3100():
    field = Recorder(64).run(200, stride=10)["mag"]["field_frd_gauss"].astype(np.float64)
    assert (field - field.mean(axis=1, keepdims=True)).std(axis=(0, 1)) == pytest.approx(1.5e-4, rel=0.04)


def test_hard_iron_stays_with_the_body_and_differs_per_vehicle():
    recorder = Recorder(1024)
    recorder.models["mag"]["white_std"] = 0.0
    recorder.models["mag"]["soft_iron_std"] = 0.0
    north = yawed(recorder, 0.0).run(1, stride=10)["mag"]["field_frd_gauss"][:, 0]
    south = yawed(recorder, np.pi).run(1, stride=10)["mag"]["field_frd_gauss"][:, 0]
    hard_iron_xy = 0.5 * (north + south)[:, :2]  # the world's part changes sign with the heading
    assert hard_iron_xy.std(axis=0) == pytest.approx(3e-3, rel=0.08)


def test_heading_by_the_magnetometer_alone_is_within_two_degrees_rms():
    field = field_ned_gauss(DEFAULT_HOME.lat_deg, DEFAULT_HOME.lon_deg, DEFAULT_HOME.alt_m)
    recorder = Recorder(1024)
    errors = []
    for yaw_deg in (0.0, 45.0, 90.0, 180.0):
        seen = yawed(recorder, radians(yaw_deg)).run(1, stride=10)["mag"]["field_frd_gauss"][:, 0]
        heading = np.degrees(np.arctan2(field[1], field[0]) - np.arctan2(seen[:, 1], seen[:, 0]))
        errors.append((heading - yaw_deg + 180.0) % 360.0 - 180.0)
    rms = np.sqrt(np.mean(np.square(errors)))
    assert 0.3 < rms < 1.5  # worse than perfect, and room for the estimator's own error


def test_soft_iron_is_symmetric_and_near_one():
    recorder = Recorder(1024)
    recorder.run(1)
    soft_iron = recorder.states["mag"]["soft_iron"].astype(np.float64)
    assert np.array_equal(soft_iron, soft_iron.transpose(0, 2, 1))
    assert (soft_iron - np.eye(3)).std(axis=0) == pytest.approx(np.full((3, 3), 3e-3), rel=0.1)
