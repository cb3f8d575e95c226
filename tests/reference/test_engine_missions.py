"""Whole missions by all engines, each on its own sensors, estimator and controller, of the same seed."""

from functools import cache

import pytest

from bench.flying.engine_missions import OFF_DEG, OFF_M, apart, mission

pytest.importorskip("pybullet")
pytest.importorskip("jsbsim")
flown = cache(mission)


SLOW = pytest.mark.slow


@pytest.mark.parametrize("noise", [pytest.param(0.0, marks=SLOW), 1.0])
@pytest.mark.parametrize(
    ("engine", "airframe"),
    [("jsbsim", "x500"), *(pytest.param("pybullet", name, marks=SLOW) for name in ("x500", "rover"))],
)
def test_a_mission_is_the_same_mission(engine, airframe, noise):
    """Never 5 cm or a degree apart, and every mode in the same frame."""
    found = apart(flown("native", airframe, noise), flown(engine, airframe, noise))
    assert found.most_m < OFF_M
    assert found.most_deg < OFF_DEG
    assert found.mode_frames == 0
