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


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_drive_is_one_that_the_native_engine_also_drives(noise):
    """Put down at home or a millimetre aside: so little decides in which frame a waypoint is passed, 10 cm at 5 m/s."""
    bullet = flown("pybullet", "rover", noise)
    found = min(apart(flown("native", "rover", noise, aside_m), bullet) for aside_m in (0.0, -1e-3, 1e-3))
    assert found.most_m < 0.05
    assert found.most_deg < 1.0
    assert found.mode_frames == 0
