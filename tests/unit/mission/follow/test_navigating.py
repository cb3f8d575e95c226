"""A companion flies the forest policy to its goals: whole flights in lockstep, over MAVLink's bytes."""

from math import atan2, cos, sin

import numpy as np
import pytest
import warp as wp

from autopilot.interface.item_lists import MissionItem
from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import encode
from common.attitude import yaw_of
from common.geodesy import geodetic_from_ned
from policies.companion.engagement import Phase
from policies.tasks.flight.flown_vehicle import own_state
from policies.tasks.flight.own_state import OwnState
from policies.tasks.navigate.observe import frame_elements, observe_rows
from sim.advance import RigArrays
from tests.unit.mission.follow.follow_flight import lose
from tests.unit.mission.follow.forest_flight import (
    AUTOPILOT,
    COMPANION,
    DENSE,
    advance,
    goto_fields,
    hovering,
    miss_m,
    place,
    send_goto,
)
from tests.unit.policies.tasks.flight.moving import moved, pose_of


@wp.kernel(enable_backward=False)
def read_own(rig: RigArrays, out: wp.array(dtype=OwnState)):
    out[0] = own_state(rig, 0, 1)


def mode(flight):
    return flight.controller.state.mode


def waypoints(flight, places):
    items = [geodetic_from_ned(*place_ned, flight.config.home) for place_ned in places]
    return [MissionItem(k, 0, 16, (0.0, 0.0, 0.0, 0.0), *item) for k, item in enumerate(items)]


def test_a_goto_to_the_companion_is_flown_through_the_forest_and_handed_back_to_hold():
    flight, companion = hovering(is_reported=False)
    goal_ned = place(flight, 45.0, -20.0)
    flight.rig.forget_impacts()
    send_goto(flight, goal_ned, COMPANION)
    advance(flight, 1.0)
    assert (companion.phase, mode(flight)) == (Phase.FLYING, Mode.OFFBOARD)
    speeds = []
    flight.run(
        lambda f: companion.phase is not Phase.FLYING or f.time_us > 60_000_000,
        on_frame=lambda f: speeds.append(np.linalg.norm(f.rig.rows["truth"][0]["vel_ned"])),
    )
    advance(flight, 4.0)
    assert mode(flight) is Mode.HOLD
    assert "Companion: hold: goto reached" in flight.drone.texts
    assert miss_m(flight, goal_ned) < 4.0
    assert max(speeds) > 5.0
    assert float(flight.rig.rows["truth"][0]["impact_speed"]) == 0.0
    assert companion.phase is Phase.WAITING


def test_a_goto_to_the_vehicle_is_an_order_if_the_companion_was_told_to_engage():
    """As QGroundControl and MAVSDK send it: the companion hears of it where the vehicle says it goes."""
    flight, companion = hovering()
    first, second = place(flight, 0.0, 30.0), place(flight, 25.0, 0.0)
    for goal_ned in (first, second):
        send_goto(flight, goal_ned, AUTOPILOT)
        advance(flight, 1.0)
        assert companion.phase is Phase.FLYING
        assert companion.skill.goals.goal.pos_ned == pytest.approx(goal_ned, abs=0.05)
        advance(flight, 2.0)
    advance(flight, 30.0, lambda: companion.phase is Phase.WAITING)
    assert miss_m(flight, second) < 5.0


def test_without_an_order_the_pilot_chooses_offboard():
    flight, companion = hovering(is_reported=False)
    assert (companion.phase, companion.trouble) == (Phase.WAITING, "no goal")
    send_goto(flight, place(flight, 0.0, 30.0), AUTOPILOT)
    advance(flight, 1.0)
    assert (companion.phase, mode(flight)) == (Phase.READY, Mode.HOLD)
    flight.drone.send(
        "COMMAND_LONG", target_system=1, target_component=1, command=176, param1=1, param2=6, confirmation=0
    )
    advance(flight, 0.5)
    assert (companion.phase, mode(flight)) == (Phase.FLYING, Mode.OFFBOARD)


@pytest.mark.parametrize(
    ("north", "sentence"), [(2000.0, "goto refused: it is 2.0 km away, 1.0 km allowed"), (1e5, "goto refused")]
)
def test_a_goal_too_far_is_refused_with_the_reason(north, sentence):
    flight, companion = hovering()
    send_goto(flight, (north, 0.0, -2.0), COMPANION)
    advance(flight, 0.5)
    assert any(sentence in text for text in flight.drone.texts), flight.drone.texts
    assert mode(flight) is Mode.HOLD
    assert companion.skill.goals.goal is None


def test_a_scanner_that_falls_silent_makes_it_stand_and_ends_in_hold():
    flight, companion = hovering()
    send_goto(flight, place(flight, 45.0, -20.0), COMPANION)
    advance(flight, 2.0)
    assert companion.phase is Phase.FLYING
    lose(companion, "OBSTACLE_DISTANCE")
    advance(flight, 2.4)
    assert mode(flight) is Mode.OFFBOARD
    assert np.linalg.norm(flight.rig.rows["truth"][0]["vel_ned"]) < 0.5
    assert {"Companion: slower: old ranges", "Companion: holding: old ranges"} <= set(flight.drone.texts)
    advance(flight, 1.0)
    assert mode(flight) is Mode.HOLD
    assert "Companion: hold: no ranges all round" in flight.drone.texts


def test_a_scanner_that_falls_silent_as_control_is_taken_makes_it_stand_too():
    flight, companion = hovering(is_reported=False)
    send_goto(flight, place(flight, 45.0, -20.0), AUTOPILOT)
    advance(flight, 1.0)
    lose(companion, "OBSTACLE_DISTANCE")
    flight.drone.send(
        "COMMAND_LONG", target_system=1, target_component=1, command=176, param1=1, param2=6, confirmation=0
    )
    advance(flight, 1.5)
    assert (companion.phase, mode(flight)) == (Phase.FLYING, Mode.OFFBOARD)
    advance(flight, 2.0)
    assert mode(flight) is Mode.HOLD
    assert companion.trouble == "no ranges all round"


def test_the_companion_sees_what_training_sees():
    flight, companion = hovering()
    goal_ned = place(flight, 45.0, -20.0)
    send_goto(flight, goal_ned, COMPANION)
    poses = {}
    advance(flight, 4.0)
    while True:  # up to a frame with a decision
        count, action = companion.decision_count, companion._flown.copy()  # the guard has changed what it chose
        poses[flight.time_us] = pose_of(flight.rig.rows["autopilot.ekf.rows"][0]["estimate"])
        flight.frame()
        if companion.decision_count > count:
            break
    own = wp.zeros(1, dtype=OwnState)
    wp.launch(read_own, 1, [flight.rig.arrays, own])
    out = wp.zeros((1, len(frame_elements(has_rays=True))), dtype=float)
    was, now = poses[companion.skill.ranges.taken_us], pose_of(own.numpy()[0])
    scanner = flight._components[0]._scanner
    ranges = wp.array([moved(scanner._ranges.numpy()[0], was, now)], dtype=float)
    goals, actions = wp.array([goal_ned], dtype=wp.vec3), wp.array([action], dtype=wp.vec4)
    wp.launch(observe_rows, 1, [1, own, actions, goals, ranges, out])
    newest = companion.skill.seen[-len(out.numpy()[0]) :]
    assert (out.numpy()[0][-52:] > 0.2).sum() > 3  # trees, and the ground ahead
    assert newest == pytest.approx(out.numpy()[0], abs=2e-3)  # centimetres of ranges, of latitudes


def test_waypoints_of_the_plan_are_flown_one_after_the_other():
    flight, companion = hovering(is_reported=False)
    places = [place(flight, 25.0, 0.0), place(flight, 25.0, 25.0)]
    flight.drone.start(flight.drone.upload(waypoints(flight, places)))
    advance(flight, 8.0)
    assert [goal.pos_ned for goal in companion.skill.goals._waypoints] == [pytest.approx(p, abs=0.1) for p in places]
    companion.engagement.engage()
    passed_m = [1e9, 1e9]

    def note(f):
        for k, goal_ned in enumerate(places):
            passed_m[k] = min(passed_m[k], miss_m(f, goal_ned))

    flight.run(lambda f: companion.phase is Phase.RELEASED or f.time_us > 60_000_000, on_frame=note)
    assert max(passed_m) < 4.0
    assert "Companion: waypoint 1 of 2 reached" in flight.drone.texts
    assert "Companion: hold: waypoint 2 of 2 reached" in flight.drone.texts


@pytest.mark.parametrize("component", [AUTOPILOT, COMPANION])
def test_in_the_ardupilot_dialect_a_goto_is_flown_in_guided(component):
    vehicle_end, station = memory_pair(LinkRole.GROUND)
    flight, companion = hovering(dialect="ardupilot", links=[vehicle_end])
    goal_ned = place(flight, 0.0, 30.0)
    station.send(encode("COMMAND_INT", 255, 190, 0, **goto_fields(flight, goal_ned, component)))
    advance(flight, 1.0)
    assert (companion.phase, mode(flight)) == (Phase.FLYING, Mode.GUIDED)
    advance(flight, 20.0, lambda: companion.phase is Phase.RELEASED)
    assert mode(flight) is Mode.BRAKE


def test_two_flights_to_a_goal_write_the_same_bytes(tmp_path):
    for name in ("first", "second"):
        folder = tmp_path / name
        folder.mkdir()
        flight, _ = hovering(folder)
        send_goto(flight, place(flight, 45.0, -20.0), COMPANION)
        advance(flight, 6.0)
        flight.close()
    for log in ("flight.tlog", "flight.ulg"):
        first, second = ((tmp_path / name / log).read_bytes() for name in ("first", "second"))
        assert len(first) > 100_000
        assert first == second, log


def test_full_speed_into_the_trees_is_stopped_before_them_by_the_guard(monkeypatch):
    """A policy that wants to go straight at its goal at 7 m/s whatever it sees; every scan is 200 ms late."""
    flight, companion = hovering(is_reported=False, world=DENSE, scan_lag_s=0.2)
    goal_ned = place(flight, 80.0, 0.0)

    def straight_at_it(_):
        truth = flight.rig.rows["truth"][0]
        north, east = np.subtract(goal_ned, truth["pos_ned"])[:2]
        bearing = atan2(east, north) - yaw_of(truth["q_ned_from_frd"])
        return np.array([cos(bearing), sin(bearing), 0.0, 0.0], np.float32)

    monkeypatch.setattr(companion.skill._pilot, "act", straight_at_it)
    flight.rig.forget_impacts()
    send_goto(flight, goal_ned, COMPANION)
    advance(flight, 1.0)
    advance(flight, 20.0, lambda: companion.phase is not Phase.FLYING)
    advance(flight, 0.5)
    assert "Companion: hold: goto reached" in flight.drone.texts  # led round all of them
    assert companion.skill.guard.interventions["near something"] > 50
    assert float(flight.rig.rows["truth"][0]["impact_speed"]) == 0.0
