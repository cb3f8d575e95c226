"""A rover's ring of range finders whose measurements come late."""

import pytest

from mission.flight import Flight, FlightConfig
from sim.world.driving_worlds import CAR_PARK
from tests.unit.mission.follow.goto_flight import advance

LOT = CAR_PARK.model_copy(update={"seed": 6})
MOMENTS = 10
STEP_S = 0.1  # as often as it measures


def _heard(lag_s):
    """At moments when the newest ranges that there are were measured [us], and they [m]."""
    flight = Flight(FlightConfig(airframe="rover", has_lidar=True, world=LOT, seed=6, scan_lag_s=lag_s))
    heard = []
    try:
        for _ in range(MOMENTS):
            advance(flight, STEP_S)
            obstacles = flight.controller.obstacles
            heard.append((obstacles.sensed_us, list(obstacles.body_m)))
    finally:
        flight.close()
    return heard


@pytest.mark.parametrize(("lag_s", "late"), [(0.1, 1), (0.2, 2)])
def test_late_ring_is_heard_as_it_measured_then_and_says_when(lag_s, late):
    fresh, lagged = _heard(0.0), _heard(lag_s)
    assert fresh[-1] != fresh[-2]
    assert lagged[late:] == fresh[:-late]
    assert not lagged[0][1]  # nothing has come yet
