"""Whole missions by both engines, each on its own sensors, estimator and controller, of the same seed."""

import pytest

from bench.flying.engine_missions import apart, mission

pytest.importorskip("pybullet")


def test_a_flight_without_noise_is_the_same_flight():
    found = apart(mission("native", "x500", 0.0), mission("pybullet", "x500", 0.0))
    assert found.most_m < 0.05
    assert found.usual_deg < 1.0  # the rest turns at a waypoint one frame sooner or later
    assert found.mode_frames <= 1


def test_a_drive_without_noise_is_the_same_drive():
    found = apart(mission("native", "rover", 0.0), mission("pybullet", "rover", 0.0))
    assert found.most_m < 0.05
    assert found.most_deg < 1.0
    assert found.mode_frames <= 1


def test_a_flight_with_the_same_noise_is_the_same_flight():
    found = apart(mission("native", "x500", 1.0), mission("pybullet", "x500", 1.0))
    assert found.most_m < 0.05
    assert found.usual_deg < 1.0
    assert found.mode_frames <= 1


def test_a_drive_with_the_same_noise_is_as_far_off_as_a_nudged_one():
    """A frame at a waypoint is 10 cm at 5 m/s: the native engine put down 0.1 mm aside is as far off."""
    found = apart(mission("native", "rover", 1.0), mission("pybullet", "rover", 1.0))
    assert found.most_m < 0.4
    assert 0 <= found.mode_frames <= 3
