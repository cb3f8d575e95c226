"""A companion drives a rover into poses: whole drives in lockstep, over MAVLink's bytes."""

from math import nan, pi

import numpy as np
import pytest
import warp as wp

from autopilot.interface.item_lists import MissionItem
from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.client_end import ClientEnd
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.ports import Estimate
from common.geodesy import geodetic_from_ned
from mission.flight import FlightConfig
from mission.follow.lockstep import flight_with_driver
from mission.plan.plan_lists import FENCE_LIST
from policies.companion.companion import MISFIT
from policies.companion.engagement import Phase
from policies.tasks.drive.observe import FRAME, OWN_SIZE, observe_rows
from sim.world.world import WorldConfig
from tests.unit.mission.follow.follow_flight import lose
from tests.unit.mission.follow.park_flight import (
    advance,
    impact_m_s,
    miss,
    pose_fields,
    send_goto,
    shipped_pilot,
    standing,
)

PLAIN = WorldConfig(hill_height_m=0.0, trees_per_ha=0.0)
GOAL = (6.0, 3.0, 0.5)


def driven(goal=GOAL, seconds=40.0, **changed):
    """A drive to a goal on a plain, after it has been handed back."""
    flight, companion = standing(pilot=shipped_pilot("drive-reach"), world=PLAIN, **changed)
    send_goto(flight, goal)
    advance(flight, 1.0)
    assert companion.phase is Phase.FLYING, (companion.trouble, flight.drone.texts)
    advance(flight, seconds, lambda: companion.phase is Phase.WAITING)
    return flight, companion


def test_a_goto_to_the_companion_is_driven_into_its_pose_and_handed_back_to_hold():
    flight, _ = driven()
    distance_m, turn_deg = miss(flight, GOAL)
    assert (distance_m < 0.3, turn_deg < 10.0) == (True, True), (distance_m, turn_deg)
    assert flight.controller.state.mode is Mode.HOLD
    assert "Companion: hold: goto reached" in flight.drone.texts


def test_a_goto_without_a_heading_ends_as_the_way_there_led():
    flight, _ = driven((6.0, 3.0, nan))
    distance_m, turn_deg = miss(flight, (6.0, 3.0, np.arctan2(3.0, 6.0)))
    assert (distance_m < 0.3, turn_deg < 10.0) == (True, True), (distance_m, turn_deg)


def test_the_companion_sees_what_training_sees():
    flight, companion = standing(is_reported=False, noise=0.0)
    send_goto(flight, goal := (5.0, 1.0, pi / 3.0))
    advance(flight, 2.0)
    assert companion.phase is Phase.FLYING
    while True:  # up to a frame with a decision
        count, action = companion.decision_count, companion.action
        flight.frame()
        if companion.decision_count > count:
            break
    estimate = wp.array(flight.rig.rows["autopilot.ekf.rows"]["estimate"].copy(), dtype=Estimate)
    out = wp.zeros((1, len(FRAME)), dtype=float)
    goals, actions = wp.array([goal], dtype=wp.vec3), wp.array([action], dtype=wp.vec2)
    wp.launch(observe_rows, 1, [estimate, actions, goals, flight._surroundings._ring.ranges, out])
    newest, task = companion.skill.seen[-len(FRAME) :], out.numpy()[0]
    assert (task[-36:] > 0.1).sum() > 3  # cars and walls
    assert newest[:OWN_SIZE] == pytest.approx(task[:OWN_SIZE], abs=1e-6)
    assert newest == pytest.approx(task, abs=5e-3)  # centimetres of ranges and of latitudes


def test_a_goal_in_which_something_is_seen_is_refused_with_the_reason():
    flight, companion = standing()
    box = flight.world.boxes.rows[np.hypot(*flight.world.boxes.middle().T).argmin()]
    send_goto(flight, (float(box["north"]), float(box["east"]), 0.0))
    advance(flight, 0.5)
    assert "Companion: goto refused: something stands there" in flight.drone.texts
    assert companion.skill.goals.goal is None
    assert flight.controller.state.mode is Mode.HOLD


def test_a_goal_outside_the_fence_is_refused_with_the_reason():
    flight, companion = standing()
    corners = [geodetic_from_ned(north, east, 0.0, flight.config.home) for north, east in ((-9, -9), (-9, 9), (9, 0))]
    items = [MissionItem(k, 0, 5001, (3.0, 0.0, 0.0, 0.0), *corner[:2], 0.0) for k, corner in enumerate(corners)]
    flight.fly(lambda drone: drone.upload(items, FENCE_LIST), seconds=5.0)
    advance(flight, 6.0)
    send_goto(flight, (8.0, 8.0, 0.0))
    advance(flight, 0.5)
    assert "Companion: goto refused: it is outside the fence" in flight.drone.texts
    assert companion.skill.goals.goal is None


def test_in_guided_of_ardupilots_rover_it_drives_and_is_handed_back_to_hold():
    vehicle_end, our_end = memory_pair(LinkRole.ONBOARD)
    station = ClientEnd(our_end, 255, 190)
    reacher = shipped_pilot("drive-reach")
    flight, companion = standing(pilot=reacher, world=PLAIN, dialect="ardupilot", links=[vehicle_end])
    station.command(176, 1.0, 4.0)  # Hold
    advance(flight, 1.0)
    station.send("COMMAND_INT", **pose_fields(flight, GOAL))
    advance(flight, 1.0)
    assert (companion.phase, companion.vehicle.is_ardupilot) == (Phase.FLYING, True)
    advance(flight, 40.0, lambda: companion.phase is Phase.WAITING)
    distance_m, turn_deg = miss(flight, GOAL)
    assert (distance_m < 0.3, turn_deg < 10.0) == (True, True), (distance_m, turn_deg)
    assert flight.controller.state.mode is Mode.HOLD


def test_a_goto_to_a_rover_that_is_not_armed_is_refused():
    flight, companion = standing()
    flight.fly(lambda drone: drone.disarm(), seconds=5.0)
    send_goto(flight, GOAL)
    advance(flight, 0.5)
    assert "Companion: goto refused: the vehicle is not armed" in flight.drone.texts
    assert companion.skill.goals.goal is None


def test_a_ring_that_falls_silent_ends_in_hold_at_a_standstill():
    flight, companion = standing(pilot=shipped_pilot("drive-reach"), world=PLAIN)
    send_goto(flight, (25.0, 0.0, 0.0))
    advance(flight, 3.0)
    assert companion.phase is Phase.FLYING
    lose(companion, "OBSTACLE_DISTANCE")
    advance(flight, 3.5)
    assert flight.controller.state.mode is Mode.HOLD
    assert "Companion: holding: old ranges" in flight.drone.texts
    assert "Companion: hold: no ranges all round" in flight.drone.texts
    assert np.linalg.norm(flight.rig.rows["truth"][0]["vel_ned"]) < 0.05


def test_the_rover_reverses_where_the_policy_asks_it_to():
    flight, _ = driven((-2.0, 0.0, 0.0))
    assert miss(flight, (-2.0, 0.0, 0.0))[0] < 0.3
    assert impact_m_s(flight) == 0.0


def test_a_rover_that_gets_nowhere_gives_up_and_says_so(monkeypatch):
    flight, companion = standing(pilot=shipped_pilot("drive-reach"), world=PLAIN)
    send_goto(flight, (10.0, 0.0, 0.0))
    advance(flight, 1.0)
    monkeypatch.setattr(companion.skill._pilot, "act", lambda _: np.zeros(2, np.float32))
    advance(flight, 40.0, lambda: companion.phase is Phase.WAITING)
    assert "Companion: hold: stuck" in flight.drone.texts
    assert flight.controller.state.mode is Mode.HOLD


def test_by_sticks_it_drives_backwards_too_as_a_stock_px4_needs_it():
    reacher = shipped_pilot("drive-reach")
    flight, companion = standing(pilot=reacher, world=PLAIN, parameters={}, is_by_sticks=True)
    for goal in ((-2.0, 0.0, 0.0), GOAL):
        send_goto(flight, goal)
        advance(flight, 1.0)
        assert companion.phase is Phase.FLYING, (companion.trouble, flight.drone.texts)
        assert flight.controller.state.mode is Mode.POSITION
        advance(flight, 40.0, lambda: companion.phase is Phase.WAITING)
        distance_m, turn_deg = miss(flight, goal)
        assert (distance_m < 0.3, turn_deg < 10.0) == (True, True), (distance_m, turn_deg)
    advance(flight, 5.0)
    assert flight.controller.state.mode is Mode.HOLD  # sticks that fell silent would be a failsafe


def test_a_drone_is_not_driven():
    flight, companion = flight_with_driver(FlightConfig(has_lidar=True, world=PLAIN), shipped_pilot())
    advance(flight, 3.0)
    assert companion.trouble == MISFIT
    assert companion.decision_count == 0


def test_waypoints_of_the_plan_are_driven_one_after_the_other_to_the_last():
    flight, companion = standing(pilot=shipped_pilot("drive-reach"), world=PLAIN, is_reported=False)
    places = [(8.0, 0.0), (8.0, 8.0), (0.0, 8.0)]
    corners = [geodetic_from_ned(*place, 0.0, flight.config.home) for place in places]
    items = [MissionItem(k, 0, 16, (0.0, 0.0, 0.0, nan), *corner) for k, corner in enumerate(corners)]
    flight.fly(lambda drone: drone.upload(items), seconds=5.0)
    advance(flight, 7.0)
    assert [goal.pos_ned[:2] for goal in companion.skill.goals._waypoints] == [
        pytest.approx(p, abs=0.02) for p in places
    ]
    companion.engagement.engage()
    advance(flight, 120.0, lambda: companion.phase is Phase.RELEASED)
    assert flight.drone.texts.count("Companion: waypoint 1 of 3 reached") == 1
    assert "Companion: hold: waypoint 3 of 3 reached" in flight.drone.texts
    assert miss(flight, (*places[-1], nan))[0] < 0.3


def test_where_offboard_does_not_reverse_it_says_so_and_does_not_drive():
    flight, companion = standing(pilot=shipped_pilot("drive-reach"), world=PLAIN, parameters={})
    send_goto(flight, GOAL)
    advance(flight, 3.0)
    assert companion.trouble == "Offboard does not reverse: set HG_RO_OFFB_BODY to 1, or drive by sticks"
    assert flight.controller.state.mode is Mode.HOLD
    flight.fly(lambda drone: drone.set_parameter("HG_RO_OFFB_BODY", 1), seconds=5.0)
    advance(flight, 5.0)
    assert "Companion: driving" in flight.drone.texts
