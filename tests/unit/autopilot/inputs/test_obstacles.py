"""Collision prevention: velocities that let the vehicle stop before what is round it."""

from math import atan2, cos, hypot, inf, isfinite, nan, pi, radians, sin

import pytest

from autopilot.inputs.obstacles import BINS, FRESH_US, Obstacles
from autopilot.params import parameter_table
from autopilot.vehicles.rover.vehicle import ROVER

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


@pytest.mark.parametrize("distance_m", [2.5, 4.0, 8.0])
@pytest.mark.parametrize("beside_m", [-0.3, 0.0, 0.3])
def test_a_post_in_the_lane_is_seen_from_every_heading(distance_m, beside_m):
    """Of a scanner that tells the nearest of sectors of 5 degrees, fixed to the hull."""
    for yaw_deg in range(0, 360, 7):
        yaw = radians(yaw_deg)
        ahead_m = (distance_m**2 - beside_m**2) ** 0.5
        off_nose = atan2(beside_m, ahead_m)
        sectors = [inf] * BINS
        sectors[round(off_nose / ALL_ROUND) % BINS] = distance_m
        found = obstacles([nan] * BINS)
        found.reported(0, sectors, yaw, ALL_ROUND)
        room = found.room_along(yaw, 0.4, 0.25, 0)
        assert room < 3.0 * (distance_m - 0.4) ** 0.5 + 0.1
        assert isfinite(room)


def test_what_stands_beside_the_lane_does_not_stop_it():
    for yaw_deg in range(0, 360, 7):
        sectors = [0.8 / max(abs(sin(i * ALL_ROUND)), 1e-9) for i in range(BINS)]  # walls on both sides
        found = obstacles([nan] * BINS, CP_DIST=0.5)
        found.reported(0, [min(d, 10.0) if d < 10.0 else inf for d in sectors], radians(yaw_deg), ALL_ROUND)
        assert found.room_along(radians(yaw_deg), 0.4, 0.25, 0) > 2.0


@pytest.mark.parametrize("none", [-1.0, 0.0])
def test_no_limit_of_braking_is_what_wheels_hold(none):
    table = parameter_table(vehicle=ROVER)
    table.set("CP_DIST", 1.0)
    table.set("RO_DECEL_LIM", none)
    found = Obstacles(table, "RO_DECEL_LIM")
    found.reported(0, [4.0] * BINS, 0.0, ALL_ROUND)
    assert 2.0 < found.room_along(0.0, 0.4, 0.25, 0) < 5.0
