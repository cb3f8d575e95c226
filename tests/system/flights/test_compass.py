"""Missions with a compass that is mounted wrongly, and flights without one: judged by the truth."""

from itertools import pairwise
from math import nan

import numpy as np
import pytest

from autopilot.interface.item_lists import MissionItem
from autopilot.interface.vehicle_state import Mode
from common.geodesy import geodetic_from_ned
from mission.flight import Flight, FlightConfig
from sim.faults import set_fault
from sim.world.world import WorldConfig
from tests.system.flights.test_failures import ABOVE_HOME, HEIGHT_M, LAND, TAKEOFF, WAYPOINT
from tests.system.published.test_sticks import FORWARD, UP, Pilot

SIDE_M = 30.0
FOUND_US = 15_000_000  # from moving at 2 m/s to a heading that is known
CORNERS = [(0.0, 0.0), (SIDE_M, 0.0), (SIDE_M, SIDE_M), (0.0, SIDE_M), (0.0, 0.0)]


def square(flight):
    """Take-off, a square and a landing at home."""
    points = [CORNERS[0], *CORNERS[1:], (0.0, 0.0)]
    commands = [TAKEOFF, *[WAYPOINT] * 4, LAND]
    items = []
    for seq, (command, point) in enumerate(zip(commands, points, strict=True)):
        lat_deg, lon_deg, _ = geodetic_from_ned(*point, 0.0, flight.config.home)
        items.append(MissionItem(seq, ABOVE_HOME, command, (0.0, 0.0, 0.0, nan), lat_deg, lon_deg, HEIGHT_M))
    return items


def off_plan_m(pos_ned):
    """Distance from the square's sides."""
    distances = []
    for start, end in pairwise(CORNERS):
        side = np.subtract(end, start)
        along = np.clip((pos_ned[:, :2] - start) @ side / (side @ side), 0.0, 1.0)
        distances.append(np.hypot(*(pos_ned[:, :2] - start - along[:, None] * side).T))
    return np.min(distances, axis=0)


def yaw_of(q):
    x, y, z, w = q.T.astype(float)
    return np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def new_flight(seed, wind_m_s, **parameters):
    return Flight(
        FlightConfig(seed=seed, wind_m_s=wind_m_s, world=WorldConfig(trees_per_ha=0.0), parameters=parameters)
    )


def yaw_error_deg(history):
    return np.degrees(np.abs((yaw_of(history.q_est) - yaw_of(history.q_true) + np.pi) % (2.0 * np.pi) - np.pi))


@pytest.mark.parametrize(
    ("angle_deg", "wind_m_s"),
    [(45.0, 0.0), (90.0, 3.0), pytest.param(180.0, 0.0, marks=pytest.mark.slow), (180.0, 5.0)],
)
def test_mission_with_a_turned_compass_is_flown_and_lands_at_home(angle_deg, wind_m_s):
    flight = new_flight(3, wind_m_s)
    set_fault(flight.rig.arrays.faults.numpy()[0], "mag", "turned", angle_deg)
    wind_errors = []

    async def script(drone):
        await drone.wait_ready()
        await drone.upload(square(flight))
        await drone.start_mission()
        await drone.until(lambda: "Emergency yaw reset: compass not used" in drone.texts, 60.0, "the reset")
        await drone.sleep(2.0)
        estimate = flight.controller.state.estimate
        wind_errors.append(np.hypot(estimate.wind_ned[0], estimate.wind_ned[1] - wind_m_s))
        await drone.until(lambda: not drone.is_armed, 300.0, "disarmed")

    running = flight.fly(script, seconds=400.0)
    assert running.error is None
    assert flight.drone.reached[-1] == 5
    assert wind_errors[0] < 2.0  # gusts are part of it
    assert not flight.rig.rows["truth"]["is_crashed"][0]
    assert any("compass contradicts" in reason for reason in flight.controller.check_arming())
    history = flight.close()
    speed = np.hypot(*history.vel_ned_true[:, :2].T)
    moving_us = history.time_us[np.argmax(speed > 2.0)]
    late = history.time_us > moving_us + FOUND_US
    assert yaw_error_deg(history)[late].max() < 5.0
    assert off_plan_m(history.pos_ned_true).max() < 6.0
    assert np.hypot(*history.pos_ned_true[-1, :2]) < 2.0


def test_vehicle_without_compass_takes_off_by_stick_finds_its_heading_and_flies_a_mission():
    flight = new_flight(4, 3.0, EKF2_MAG_TYPE=5)
    set_fault(flight.rig.arrays.faults.numpy()[0], "mag", "off")
    body = flight.rig.rows["truth"]
    moving_us = []
    mission_us = []

    async def script(drone):
        pilot = Pilot(flight)
        await drone.sleep(10.0)
        assert any("heading not aligned" in reason for reason in flight.controller.check_arming())
        await drone.upload(square(flight))
        await pilot.mode(Mode.ALTITUDE)
        await drone.arm()
        await pilot.hold(5.0, z=UP)
        pilot.move(x=FORWARD // 2)
        await drone.until(lambda: np.hypot(*body["vel_ned"][0][:2]) > 2.0, 10.0, "moving")
        moving_us.append(drone.time_us)
        await drone.until(lambda: flight.controller.commander.has_position, 15.0, "position")
        assert flight.controller.state.home_ned[2] == pytest.approx(0.0, abs=1.5)  # the ground it left
        await pilot.hold(1.0)
        await drone.start_mission(1)
        await drone.until(lambda: 1 in drone.reached, 60.0, "the first corner")
        mission_us.append(drone.time_us)
        await drone.until(lambda: not drone.is_armed, 200.0, "disarmed")

    running = flight.fly(script, seconds=400.0)
    if running.error is not None:
        raise running.error
    history = flight.close()
    assert yaw_error_deg(history)[history.time_us > moving_us[0] + FOUND_US].max() < 5.0
    assert off_plan_m(history.pos_ned_true[history.time_us > mission_us[0]]).max() < 3.0
    assert np.hypot(*history.pos_ned_true[-1, :2]) < 2.0
