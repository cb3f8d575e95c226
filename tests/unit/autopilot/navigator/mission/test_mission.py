"""Missions: items, legs, speed, jumps, pause and resume, over the kinematic stand-in."""

from math import nan, radians

import numpy as np
import pytest

from autopilot.interface.client_requests import ChangeMode, GoTo, SetCurrentItem, StartMission
from autopilot.interface.item_lists import ListKind
from autopilot.interface.vehicle_state import LandedState, Mode, Verdict
from autopilot.navigator.mission.mission import MissionState
from tests.unit.autopilot.kinematic import Kinematic, do, geo, heading_error, item

WAYPOINT, LOITER, LOITER_TIME, RETURN, LAND, TAKEOFF, DELAY, JUMP, SPEED, HOME = (
    16,
    17,
    19,
    20,
    21,
    22,
    93,
    177,
    178,
    179,
)


def started(rig, *items):
    assert rig.fc.lists.load(ListKind.MISSION, items) is None
    assert rig.fc.request(ChangeMode(Mode.MISSION)).verdict is Verdict.ACCEPTED
    if not rig.state.is_armed:
        assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED
    return rig


def test_mission_from_takeoff_to_landing():
    rig = started(
        Kinematic().ready(),
        item(0, TAKEOFF, height=8.0),
        item(1, WAYPOINT, 20.0, 0.0, 8.0),
        item(2, WAYPOINT, 20.0, 20.0, 12.0),
        item(3, LAND, 0.0, 20.0, 0.0),
    )
    assert rig.state.mission_state == MissionState.ACTIVE
    rig.disarmed()
    assert rig.recorder.reached == [0, 1, 2, 3]
    assert rig.pos[:2] == pytest.approx((0.0, 20.0), abs=0.4)
    assert rig.state.mission_state == MissionState.COMPLETE
    assert rig.history == [
        LandedState.ON_GROUND,
        LandedState.TAKEOFF,
        LandedState.IN_AIR,
        LandedState.LANDING,
        LandedState.ON_GROUND,
    ]


def test_mission_without_takeoff_item_climbs_before_it_leaves():
    rig = started(Kinematic().ready(), item(0, WAYPOINT, 30.0, 0.0, 12.0))
    rig.run_until(lambda: rig.recorder.reached == [0])
    low = [p for p in rig.track if p[2] > -11.0]
    assert max(p[0] for p in low) < 0.1


def test_last_waypoint_is_held_when_the_mission_is_complete():
    rig = started(Kinematic().flying(), item(0, WAYPOINT, 30.0, 0.0))
    rig.run(15.0)
    assert rig.state.mode is Mode.HOLD
    assert rig.recorder.has_text("Mission complete")
    assert rig.pos == pytest.approx((30.0, 0.0, -10.0), abs=0.1)


def test_legs_are_straight_lines_between_the_waypoints():
    rig = started(
        Kinematic().flying(), item(0, WAYPOINT, 30.0, 0.0), item(1, WAYPOINT, 30.0, 40.0), item(2, LOITER, 0, 40)
    )
    rig.run_until(lambda: rig.recorder.reached == [0])
    assert rig.sp("path_start_ned") == pytest.approx([30.0, 0.0, -10.0], abs=0.05)
    assert rig.sp("pos_ned") == pytest.approx([30.0, 40.0, -10.0], abs=0.05)
    assert heading_error(rig.sp("yaw"), radians(90.0)) < 0.01


def test_fly_through_speed_falls_with_the_turn():
    def exit_speed(north, east):
        rig = started(Kinematic().flying(), item(0, WAYPOINT, 50.0, 0.0), item(1, WAYPOINT, north, east))
        rig.run(0.1)
        return rig.sp("exit_speed")

    straight, gentle, square, back = (
        exit_speed(100.0, 0.0), exit_speed(100.0, 25.0), exit_speed(50.0, 50.0), exit_speed(0.0, 0.0),
    )  # fmt: skip
    assert straight == pytest.approx(5.0)
    assert straight >= gentle > square > back
    assert back == 0.0
    assert square == pytest.approx(np.sqrt(0.5 * 4.0 * 2.0), rel=0.02)


def test_stop_waypoints_are_not_flown_through():
    for items in (
        (item(0, WAYPOINT, 50.0, 0.0, params=(1.0, 0, 0, nan)), item(1, WAYPOINT, 100.0, 0.0)),
        (item(0, WAYPOINT, 50.0, 0.0), do(1, DELAY, 2.0), item(2, WAYPOINT, 100.0, 0.0)),
        (item(0, WAYPOINT, 50.0, 0.0),),
        (item(0, WAYPOINT, 50.0, 0.0), do(1, RETURN)),
    ):
        rig = started(Kinematic().flying(), *items)
        rig.run(0.1)
        assert rig.sp("exit_speed") == 0.0


def test_fly_through_sees_past_speed_items():
    rig = started(
        Kinematic().flying(), item(0, WAYPOINT, 50.0, 0.0), do(1, SPEED, 1, 8, -1), item(2, WAYPOINT, 100.0, 0.0)
    )
    rig.run(0.1)
    assert rig.sp("exit_speed") == pytest.approx(5.0)


@pytest.mark.parametrize("command", [WAYPOINT, LOITER_TIME])
def test_hold_time_is_kept(command):
    rig = started(Kinematic().flying(), item(0, command, 20.0, 0.0, params=(6.0, 0, 0, nan)))
    rig.run_until(lambda: abs(rig.pos[0] - 20.0) < 2.0)
    assert rig.run_until(lambda: rig.recorder.reached == [0]) == pytest.approx(6.0, abs=0.1)


def test_delay_holds_where_the_vehicle_is():
    rig = started(Kinematic().flying(), do(0, DELAY, 4.0), item(1, WAYPOINT, 20.0, 0.0))
    rig.run(3.9)
    assert abs(rig.pos[0]) < 0.1
    rig.run_until(lambda: rig.recorder.reached == [0, 1])


def test_acceptance_radius_of_the_item_counts():
    rig = started(
        Kinematic().flying(), item(0, WAYPOINT, 50.0, 0.0, params=(0, 6, 0, nan)), item(1, WAYPOINT, 50.0, 50.0)
    )
    rig.run_until(lambda: rig.recorder.reached == [0])
    assert 50.0 - rig.pos[0] == pytest.approx(6.0, abs=0.2)


def test_waypoint_is_not_reached_below_its_height():
    rig = started(Kinematic(MPC_Z_V_AUTO_UP=0.5).flying(), item(0, WAYPOINT, 5.0, 0.0, 30.0))
    rig.run_until(lambda: rig.recorder.reached == [0])
    assert rig.pos[2] < -29.0


def test_speed_item_changes_the_speed_of_the_legs_after_it():
    rig = started(
        Kinematic().flying(),
        item(0, WAYPOINT, 20.0),
        do(1, SPEED, 1, 2.0, -1),
        item(2, WAYPOINT, 80.0),
        item(3, LOITER, 90.0),
    )
    rig.run_until(lambda: rig.recorder.reached == [0, 1])
    rig.run(8.0)
    assert rig.vel[0] == pytest.approx(2.0, abs=0.1)


def test_jump_repeats_its_items_and_then_goes_on():
    rig = started(
        Kinematic().flying(),
        item(0, WAYPOINT, 10.0),
        item(1, WAYPOINT, 20.0),
        do(2, JUMP, 0, 2),
        item(3, WAYPOINT, 30.0),
    )
    rig.run_until(lambda: rig.state.mode is Mode.HOLD)
    assert rig.recorder.reached == [0, 1, 2, 0, 1, 2, 0, 1, 2, 3]


def test_jumps_in_a_circle_end_the_mission():
    rig = started(Kinematic().flying(), do(0, JUMP, 2, -1), item(1, WAYPOINT, 10.0), do(2, JUMP, 0, -1))
    rig.run(1.0)
    assert rig.state.mode is Mode.HOLD
    assert rig.recorder.has_text("jumps in a circle")
    assert rig.state.mission_state == MissionState.PAUSED


def test_landing_in_an_endless_loop_on_the_ground_does_not_hang():
    rig = started(Kinematic().ready(), do(0, DELAY, 0.0), do(1, JUMP, 0, -1))
    rig.run(12.0)
    assert not rig.state.is_armed


def test_return_item_changes_to_return_and_is_not_announced_as_reached():
    rig = started(Kinematic().flying(), item(0, WAYPOINT, 20.0), do(1, RETURN))
    rig.run_until(lambda: rig.state.mode is Mode.RETURN)
    assert rig.recorder.reached == [0]
    assert rig.state.mission_current == 1
    assert rig.state.mission_state == MissionState.COMPLETE
    rig.disarmed()


def test_last_item_without_a_place_is_reached_too():
    rig = started(Kinematic().flying(), item(0, WAYPOINT, 20.0), do(1, SPEED, 1, 3.0, -1))
    rig.run_until(lambda: rig.state.mode is Mode.HOLD)
    assert rig.recorder.reached == [0, 1]
    assert rig.state.mission_current == 1


def test_pause_holds_and_resume_goes_on_along_the_same_leg():
    rig = started(
        Kinematic().flying(), item(0, WAYPOINT, 20.0), item(1, WAYPOINT, 100.0), item(2, WAYPOINT, 100.0, 20.0)
    )
    rig.run_until(lambda: rig.pos[0] > 50.0)
    assert rig.fc.guidance.pause().verdict is Verdict.ACCEPTED
    assert rig.state.mission_state == MissionState.PAUSED
    rig.run(8.0)
    stopped = rig.pos.copy()
    rig.run(3.0)
    assert rig.pos == pytest.approx(stopped, abs=0.05)
    assert rig.fc.request(StartMission(-1)).verdict is Verdict.ACCEPTED
    rig.frame()
    assert rig.state.mission_current == 1
    assert rig.sp("path_start_ned") == pytest.approx([20.0, 0.0, -10.0], abs=0.1)
    rig.run_until(lambda: rig.state.mode is Mode.HOLD)
    assert rig.recorder.reached == [0, 1, 2]


def test_resume_far_from_the_leg_goes_straight_to_the_item():
    rig = started(Kinematic().flying(), item(0, WAYPOINT, 100.0), item(1, WAYPOINT, 100.0, 20.0))
    rig.run_until(lambda: rig.pos[0] > 50.0)
    lat, lon, _ = geo(50.0, 40.0)
    assert rig.fc.request(GoTo(lat, lon, nan, nan, nan)).verdict is Verdict.ACCEPTED
    rig.run(15.0)
    assert rig.fc.request(StartMission(-1)).verdict is Verdict.ACCEPTED
    rig.frame()
    assert rig.sp("path_start_ned") == pytest.approx([50.0, 40.0, -10.0], abs=0.2)


def test_pause_without_a_mission_is_refused():
    rig = Kinematic().flying()
    assert rig.fc.guidance.pause().verdict is Verdict.TEMPORARILY_REJECTED


def test_mission_starts_at_the_item_asked_for_and_a_complete_one_starts_again():
    rig = Kinematic().flying()
    rig.fc.lists.load(ListKind.MISSION, [item(0, WAYPOINT, 20.0), item(1, WAYPOINT, 0.0, 20.0)])
    assert rig.fc.request(StartMission(1)).verdict is Verdict.ACCEPTED
    rig.run_until(lambda: rig.state.mode is Mode.HOLD)
    assert rig.recorder.reached == [1]
    assert rig.fc.request(StartMission(-1)).verdict is Verdict.ACCEPTED
    rig.run_until(lambda: rig.state.mode is Mode.HOLD)
    assert rig.recorder.reached == [1, 0, 1]


def test_current_item_can_be_changed_in_flight():
    rig = started(Kinematic().flying(), item(0, WAYPOINT, 100.0), item(1, WAYPOINT, 0.0, 100.0), item(2, LOITER, 0, 0))
    rig.run(3.0)
    assert rig.fc.request(SetCurrentItem(1)).verdict is Verdict.ACCEPTED
    rig.frame()
    assert rig.sp("pos_ned")[1] == pytest.approx(100.0, abs=0.1)
    reply = rig.fc.request(SetCurrentItem(7))
    assert (reply.verdict, reply.reason) == (Verdict.DENIED, "there is no item 8")


def test_a_new_mission_in_flight_replaces_the_one_being_flown():
    rig = started(Kinematic().flying(), item(0, WAYPOINT, 100.0))
    rig.run(2.0)
    assert rig.fc.lists.load(ListKind.MISSION, [item(0, WAYPOINT, 0.0, 50.0), item(1, LOITER, 0.0, 60.0)]) is None
    rig.run(1.0)
    assert rig.state.mode is Mode.MISSION
    assert rig.sp("pos_ned")[1] == pytest.approx(50.0, abs=0.1)
    assert rig.fc.lists.load(ListKind.MISSION, []) is None
    rig.run(0.1)
    assert rig.state.mode is Mode.HOLD
    assert rig.state.mission_state == MissionState.NO_MISSION


def test_mission_without_items_or_too_far_away_is_refused():
    rig = Kinematic().flying()
    reply = rig.fc.request(ChangeMode(Mode.MISSION))
    assert (reply.verdict, reply.reason) == (Verdict.TEMPORARILY_REJECTED, "no mission is loaded")
    rig.fc.lists.load(ListKind.MISSION, [item(0, WAYPOINT, 20_000.0)])
    assert "km away" in rig.fc.request(ChangeMode(Mode.MISSION)).reason


def test_item_without_autocontinue_waits_in_hold():
    rig = started(Kinematic().flying(), item(0, WAYPOINT, 20.0, autocontinue=False), item(1, WAYPOINT, 40.0))
    rig.run_until(lambda: rig.state.mode is Mode.HOLD)
    assert rig.state.mission_state == MissionState.PAUSED
    assert rig.state.mission_current == 1
    rig.fc.request(StartMission(-1))
    rig.run_until(lambda: rig.state.mode is Mode.HOLD)
    assert rig.recorder.reached == [0, 1]


def test_home_item_moves_home():
    rig = started(Kinematic().flying(), item(0, WAYPOINT, 30.0), do(1, HOME, 1), do(2, RETURN))
    rig.disarmed()
    assert rig.pos[0] == pytest.approx(30.0, abs=2.5)


def test_heading_of_an_item_is_flown():
    rig = started(Kinematic().flying(), item(0, LOITER, 30.0, params=(0, 0, 0, 200.0)))
    rig.run(15.0)
    assert heading_error(rig.yaw, radians(200.0)) < 0.02


def test_takeoff_item_elsewhere_climbs_then_goes_there():
    rig = started(Kinematic().ready(), item(0, TAKEOFF, 15.0, 0.0, 8.0))
    rig.run_until(lambda: rig.recorder.reached == [0])
    assert max(p[0] for p in rig.track if p[2] > -7.0) < 0.1
    assert rig.pos[0] > 12.5


def test_mission_that_ends_with_a_return_is_announced_as_complete():
    rig = started(Kinematic().flying(), item(0, WAYPOINT, 30.0, 0.0), do(1, RETURN))
    rig.run_until(lambda: rig.state.mode is Mode.RETURN)
    assert [text for _, text in rig.recorder.texts].count("Mission complete") == 1
    assert rig.state.mission_state == MissionState.COMPLETE
    assert rig.recorder.reached == [0]


@pytest.mark.parametrize(
    ("height", "command", "is_reported"), [(-20.0, WAYPOINT, True), (-4.0, WAYPOINT, False), (-20.0, LAND, False)]
)
def test_item_far_below_home_is_taken_with_a_warning(height, command, is_reported):
    rig = Kinematic().ready()
    assert rig.fc.lists.load(ListKind.MISSION, [item(0, TAKEOFF), item(1, command, 30.0, 0.0, height)]) is None
    assert rig.recorder.has_text("Mission: item 2 is 20 m below home") == is_reported
