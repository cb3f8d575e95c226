"""JSBSim's Cessna 172 under our flight controller: a whole mission from the runway and back to it."""

from math import hypot

import numpy as np
import pytest

from common.geodesy import DEFAULT_HOME, geodetic_from_ned
from mission.flight import Flight, FlightConfig
from mission.log.flight_summary import planned_path, summarise
from mission.plan.plan_file import Plan, PlanItem
from mission.script import fly_plan
from sim.world.world import WorldConfig

pytest.importorskip("jsbsim")

FLAT = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0)
CORNERS = [(1500.0, 0.0, 100.0), (1500.0, 1500.0, 100.0), (-500.0, 1500.0, 100.0), (-500.0, 0.0, 80.0)]
FRAMES_MOST = 50 * 600
TAKEOFF, WAYPOINT, TURNS, LAND = 22, 16, 18, 21


def item(seq, command, north, east, height, *params):
    lat_deg, lon_deg, _ = geodetic_from_ned(north, east, 0.0, DEFAULT_HOME)
    return PlanItem(seq, 3, command, (*params, *[0.0] * (4 - len(params))), lat_deg, lon_deg, height)


def circuit():
    """Take-off to the north, four waypoints, a circle, a landing."""
    items = [item(0, TAKEOFF, 400.0, 0.0, 50.0)]
    items += [item(k, WAYPOINT, *corner) for k, corner in enumerate(CORNERS, 1)]
    items.append(item(5, TURNS, -1200.0, 0.0, 60.0, 1.0, 0.0, 220.0))
    items.append(item(6, LAND, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    return Plan(tuple(items), DEFAULT_HOME)


def off_the_leg(pos_ned, start, end):
    """Where the straight part of a leg is flown, and distance from the line and height there [m]."""
    along = np.subtract(end, start)[:2]
    length = hypot(*along)
    along /= length
    way, across = (pos_ned[:, :2] - start[:2]) @ along, (pos_ned[:, :2] - start[:2]) @ [-along[1], along[0]]
    is_straight = (way > 900.0) & (way < length - 300.0)
    return is_straight, np.abs(across), -pos_ned[:, 2]


def test_it_takes_off_flies_a_circuit_in_wind_and_lands():
    """Straight and level it is within 5 m in height, 1.5 m/s of the airspeed asked for, and on the line."""
    plan = circuit()
    flight = Flight(FlightConfig(airframe="c172", engine="jsbsim", wind_m_s=3.0, wind_from_deg=300.0, world=FLAT))
    trim_m_s = flight.controller.params["FW_AIRSPD_TRIM"]
    pitot_pa = []
    running = flight.drone.start(fly_plan(flight.drone, plan))
    while not running.is_done and len(pitot_pa) < FRAMES_MOST:
        flight.frame()
        pitot_pa.append(float(flight.rig.truth_row()["pitot_pa"]))
    end = flight.rig.truth_row().copy()
    history = flight.close()
    summary = summarise(flight, history, running, planned_path(plan, flight.config.home))
    assert summary.is_success, summary.result
    airspeed = np.sqrt(np.maximum(pitot_pa, 0.0) / (0.5 * 1.225))[: len(history.mission_seq)]
    for seq, start, stop in zip((2, 3), CORNERS, CORNERS[1:], strict=False):
        is_straight, across, height = off_the_leg(history.pos_ned_true, start, stop)
        level = is_straight & (history.mission_seq == seq)
        assert level.sum() > 250
        assert across[level].max() < 3.0
        assert np.abs(height[level] - 100.0).max() < 5.0
        assert np.abs(airspeed[level] - trim_m_s).max() < 1.5
    assert (end["is_on_ground"], end["is_crashed"]) == (1, 0)
    assert end["impact_speed"] < 3.0  # 14 CFR 23.473 has gear bear 3.05 m/s
    assert abs(end["pos_ned"][1]) < 10.0  # on the runway
