"""Whole missions by all engines, each on its own sensors, estimator and controller, of the same seed."""

from functools import cache

import pytest

from bench.flying.engine_missions import apart, mission

pytest.importorskip("pybullet")
pytest.importorskip("jsbsim")
flown = cache(mission)


@pytest.mark.parametrize("noise", [0.0, 1.0])
@pytest.mark.parametrize("engine", ["pybullet", "jsbsim"])
def test_a_flight_is_the_same_flight(engine, noise):
    found = apart(flown("native", "x500", noise), flown(engine, "x500", noise))
    assert found.most_m < 0.05
    assert found.usual_deg < 1.0  # the rest lets go of its brakes a frame sooner or later
    assert found.mode_frames <= 1


def test_two_engines_of_double_precision_fly_alike_all_the_way():
    """With the same noise: never a degree apart, and every mode in the same frame."""
    found = apart(flown("pybullet", "x500", 1.0), flown("jsbsim", "x500", 1.0))
    assert found.most_m < 0.05
    assert found.most_deg < 1.0
    assert found.mode_frames == 0


def test_a_drive_without_noise_is_the_same_drive():
    found = apart(mission("native", "rover", 0.0), mission("pybullet", "rover", 0.0))
    assert found.most_m < 0.05
    assert found.most_deg < 1.0
    assert found.mode_frames <= 1


def test_a_drive_with_the_same_noise_is_as_far_off_as_a_nudged_one():
    """A frame at a waypoint is 10 cm at 5 m/s: the native engine put down 0.1 mm aside is as far off."""
    found = apart(mission("native", "rover", 1.0), mission("pybullet", "rover", 1.0))
    assert found.most_m < 0.4
    assert 0 <= found.mode_frames <= 3
