"""Splines and turns of a mission, in lockstep: how closely they are flown, and that nothing stops on the way."""

from math import nan

import numpy as np
import pytest

from tests.system.flown_missions import LAND, SPLINE, TAKEOFF, TURNS, WAYPOINT, fly, item


@pytest.mark.parametrize("wind_m_s", [0.0, 6.0])
def test_spline_goes_smoothly_through_its_waypoints(wind_m_s):
    """Not published with a tolerance; PX4 keeps missions in a corridor of 5 m, ArduPilot arrives within 2 m."""
    corners = [(20.0, 0.0), (50.0, 20.0), (50.0, 60.0), (10.0, 60.0), (-20.0, 30.0)]

    async def script(drone, flown):
        await drone.wait_ready()
        items = [item(flown, 0, TAKEOFF), item(flown, 1, WAYPOINT, *corners[0])]
        items += [item(flown, 2 + k, SPLINE, *corner, 10.0 + 2.0 * (k % 2)) for k, corner in enumerate(corners[1:])]
        await drone.upload(items)
        await drone.start_mission()
        await drone.until(lambda: 1 in drone.reached, 60.0, "first waypoint")
        begin_s = flown.now_s
        await drone.until(lambda: 4 in drone.reached, 120.0, "last but one")
        rows = flown.since(begin_s)
        for k, corner in enumerate(corners[1:4]):
            assert np.linalg.norm(rows[:, 1:4] - (*corner, -10.0 - 2.0 * (k % 2)), axis=1).min() < 0.7
        assert flown.speed(begin_s + 2.0).min() > 3.0  # no stop, no corner
        assert flown.speed(begin_s).max() < 5.7
        await drone.wait_mission_finished(5, 60.0)

    fly(script, wind_m_s=wind_m_s)


@pytest.mark.parametrize("wind_m_s", [0.0, 6.0])
def test_turns_keep_their_radius(wind_m_s):
    """Not published with a tolerance; a circle of 15 m at the speed that its bend allows."""

    async def script(drone, flown):
        await drone.wait_ready()
        turns = item(flown, 1, TURNS, 30.0, 0.0, params=(2.0, 0.0, -15.0, nan))
        await drone.upload([item(flown, 0, TAKEOFF), turns, item(flown, 2, LAND, 30.0, 0.0, 0.0)])
        await drone.start_mission()
        await drone.until(lambda: flown.pos[0] > 10.0, 60.0, "near the circle")
        await drone.sleep(8.0)
        begin_s = flown.now_s
        await drone.sleep(25.0)
        rows = flown.since(begin_s)
        away = np.hypot(rows[:, 1] - 30.0, rows[:, 2])
        assert np.abs(away - 15.0).max() < 0.6
        angle = np.unwrap(np.arctan2(rows[:, 2], rows[:, 1] - 30.0))
        assert angle[-1] < angle[0] - 6.0  # counter-clockwise
        await drone.wait_disarmed(200.0)

    fly(script, wind_m_s=wind_m_s)
