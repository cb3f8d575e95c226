"""The range finder over a plain."""

from math import cos, radians, sin

import numpy as np
import pytest

from tests.unit.sim.sensors.recorder import Recorder, arrivals


def at_height(recorder, height_m):
    recorder.bodies["pos_ned"] = (0.0, 0.0, -height_m)
    return recorder


def test_samples_come_at_25_hertz_without_delay():
    ranges = Recorder().run(500)["range"][0]
    new = arrivals(ranges)
    assert np.all(np.diff(new) == 10)
    assert np.all(ranges["time_us"][new] == (new + 1) * 4000)


def test_a_tilted_vehicle_measures_along_its_own_down():
    recorder = Recorder(noise_scale=0.0)
    recorder.bodies["q_ned_from_frd"] = (sin(radians(15.0)), 0.0, 0.0, cos(radians(15.0)))  # 30 deg of roll
    sample = recorder.run(10)["range"][0, -1]
    assert sample["distance_m"] == pytest.approx(10.0 / cos(radians(30.0)), rel=1e-4)
    assert sample["is_valid"] == 1


@pytest.mark.parametrize(
    ("height_m", "is_valid", "distance_m"),
    [(0.05, 0, 0.1), (0.2, 1, 0.2), (39.5, 1, 39.5), (41.0, 0, 40.0), (300.0, 0, 40.0)],
)
def test_out_of_range_is_reported_as_invalid(height_m, is_valid, distance_m):
    sample = at_height(Recorder(noise_scale=0.0), height_m).run(10)["range"][0, -1]
    assert sample["is_valid"] == is_valid
    assert sample["distance_m"] == pytest.approx(distance_m, abs=1e-3)


def test_looking_up_sees_nothing():
    recorder = Recorder(noise_scale=0.0)
    recorder.bodies["q_ned_from_frd"] = (1.0, 0.0, 0.0, 0.0)
    assert recorder.run(10)["range"][0, -1]["is_valid"] == 0


@pytest.mark.parametrize(("height_m", "std_m"), [(3.0, 0.02), (30.0, 0.1)])
def test_noise_is_that_of_the_tf02_pro(height_m, std_m):
    ranges = at_height(Recorder(64), height_m).run(100, stride=10)["range"]
    assert ranges["distance_m"].astype(np.float64).std() == pytest.approx(std_m, rel=0.04)
