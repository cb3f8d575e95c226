"""Collision prevention: velocities that let the vehicle stop before what is round it."""

from math import cos, hypot, inf, nan, pi, radians, sin

import pytest

from autopilot.inputs.obstacles import BINS, FRESH_US, Obstacles
from autopilot.params import parameter_table

ALL_ROUND = 2.0 * pi / BINS


def obstacles(distances, **params):
    table = parameter_table()
    for name, value in ({"CP_DIST": 2.0} | params).items():
        table.set(name, value)
    found = Obstacles(table, "MPC_ACC_HOR")
    found.reported(0, distances, 0.0, ALL_ROUND)
    return found


def test_free_air_limits_nothing():
    assert obstacles([inf] * BINS).limited(5.0, -3.0, 0) == (5.0, -3.0)


@pytest.mark.parametrize("bearing_deg", [0.0, 90.0, 137.0, 270.0])
@pytest.mark.parametrize("distance_m", [2.0, 3.0, 6.0, 20.0])
def test_speed_towards_a_wall_can_be_braked_in_time(bearing_deg, distance_m):
    """Reaction time and braking with the limits of the vehicle fit into the room before the wall."""
    bearing = radians(bearing_deg)
    walls = [distance_m / max(cos(i * ALL_ROUND - bearing), 1e-9) if cos(i * ALL_ROUND - bearing) > 0 else inf
             for i in range(BINS)]  # fmt: skip
    found = obstacles(walls)
    north, east = found.limited(10.0 * cos(bearing), 10.0 * sin(bearing), 0)
    speed = north * cos(bearing) + east * sin(bearing)
    accel = float(parameter_table()["MPC_ACC_HOR"])
    assert speed * 0.4 + 0.5 * speed**2 / accel <= distance_m - 2.0 + 0.05
    assert speed >= -0.05  # bins are 5 degrees wide


def test_moving_away_and_along_stays_free():
    walls = [5.0 if cos(i * ALL_ROUND) > 0.9 else inf for i in range(BINS)]  # ahead, in the north
    found = obstacles(walls)
    assert found.limited(-4.0, 0.0, 0) == (-4.0, 0.0)
    assert hypot(*found.limited(0.0, 4.0, 0)) == pytest.approx(4.0)


def test_unknown_directions_are_closed_unless_asked_otherwise():
    found = obstacles([nan] * BINS)
    assert found.limited(3.0, 0.0, 0) == (0.0, 0.0)
    assert obstacles([nan] * BINS, CP_GO_NO_DATA=1).limited(3.0, 0.0, 0) == (3.0, 0.0)
    stale = obstacles([inf] * BINS)
    assert stale.limited(3.0, 0.0, FRESH_US + 1) == (0.0, 0.0)


def test_nearest_of_a_bin_counts_and_directions_may_run_backwards():
    found = obstacles([nan] * BINS, CP_GO_NO_DATA=1)
    found.reported(0, [9.0, 4.0, 2.0], radians(90.0), radians(-0.5))  # three rays in the bin to the east
    assert found.limited(0.0, 5.0, 0) == pytest.approx((0.0, 0.0), abs=1e-9)
