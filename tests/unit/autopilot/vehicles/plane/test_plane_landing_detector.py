"""When a plane counts as landed."""

from math import isfinite, nan
from types import SimpleNamespace

from autopilot.ports import AIRSPEED_VALID, TERRAIN_VALID
from autopilot.vehicles.plane.landing_detector import PlaneLandingDetector
from autopilot.vehicles.plane.modes.params import MODE_PARAMETERS
from common.params import ParameterTable


def after(seconds, speed, thrust, airspeed=0.0, height=nan):
    detector = PlaneLandingDetector(ParameterTable(MODE_PARAMETERS))
    flags = int(AIRSPEED_VALID) | (int(TERRAIN_VALID) if isfinite(height) else 0)
    estimate = SimpleNamespace(
        vel_ned=(speed, 0.0, 0.0), pos_ned=(0.0, 0.0, -height), terrain_d=0.0, flags=flags, airspeed=airspeed
    )
    for _ in range(round(seconds * 50)):
        detector.update(estimate, thrust, 0.0, 0.02)
    return detector.is_landed


def test_it_has_landed_when_it_is_slow_with_its_motor_idle():
    assert after(2.5, 3.0, 0.0)
    assert not after(1.5, 3.0, 0.0)
    assert not after(5.0, 8.0, 0.0)


def test_one_that_taxis_has_not():
    assert not after(60.0, 3.0, 0.5)


def test_one_that_lies_still_with_its_motor_running_has():
    assert not after(9.0, 0.2, 1.0)
    assert after(11.0, 0.2, 1.0)


def test_one_that_stands_over_the_ground_in_a_storm_has_not():
    assert not after(60.0, 2.0, 0.0, airspeed=14.0)


def test_one_whose_motor_holds_it_against_the_wind_has_not_unless_it_is_on_the_ground():
    assert not after(60.0, 0.5, 0.5, airspeed=9.0)
    assert not after(60.0, 0.5, 0.5, airspeed=9.0, height=20.0)
    assert after(11.0, 0.5, 0.5, airspeed=9.0, height=0.3)
