"""Circles, splines, changes of height, conditions, tags, payload: each item over the kinematic stand-in."""

from math import atan2, hypot, nan, pi, radians

import numpy as np
import pytest

from autopilot.interface.client_requests import ChangeMode, LandingTargetReport, SetHome
from autopilot.interface.item_lists import ListKind
from autopilot.interface.vehicle_state import ACCEPTED, Mode, Reply, Verdict
from tests.unit.autopilot.kinematic import Kinematic, do, heading_error, item

WAYPOINT, LOITER, TURNS, LAND, TAKEOFF, CHANGE_ALT, TO_ALT, SPLINE, DELAY = 16, 17, 18, 21, 22, 30, 31, 82, 93
AFTER, NEAR, YAW, JUMP, SPEED, ROI_AT, ROI_NONE, ROI, TAG, TO_TAG, GATE = (
    112, 114, 115, 177, 178, 195, 197, 201, 600, 601, 4501,
)  # fmt: skip
CAMERA = 203


class Camera:
    """A payload that takes pictures, and keeps what it was told and when."""

    def __init__(self, rig, commands=(CAMERA,), reply=ACCEPTED):
        self.rig, self.commands, self.reply, self.shots = rig, commands, reply, []
        rig.fc.payload.add(self)

    def takes(self, command):
        return command in self.commands

    def run(self, command, params, x, y, z):
        self.shots.append((command, *params, x, y, z, *self.rig.pos))
        return self.reply


def started(rig, *items):
    assert rig.fc.lists.load(ListKind.MISSION, items) is None
    assert rig.fc.request(ChangeMode(Mode.MISSION)).verdict is Verdict.ACCEPTED
    if not rig.state.is_armed:
        assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED
    return rig


def finished(rig, seconds=300.0):
    rig.run_until(lambda: rig.state.mode is Mode.HOLD, seconds)
    return rig


def flown(rig, since=0):
    return np.array(rig.track[since:])


@pytest.mark.parametrize(("radius", "direction"), [(15.0, 1.0), (-15.0, -1.0)])
def test_turns_are_flown_round_their_centre_in_the_direction_asked_for(radius, direction):
    rig = Kinematic().flying()
    start = len(rig.track)
    started(rig, item(0, TURNS, 40.0, 0.0, params=(2.0, 0, radius, nan)), item(1, WAYPOINT, 40.0, 60.0))
    rig.run_until(lambda: rig.recorder.reached == [0])
    path = flown(rig, start)[:, :2] - (40.0, 0.0)
    away = np.hypot(*path.T)
    first = np.argmax(away < 15.5)
    angles = np.unwrap(np.arctan2(path[first:, 1], path[first:, 0]))
    assert angles[-1] - angles[0] == pytest.approx(direction * 4.0 * pi, abs=0.15)
    assert np.abs(away[first + 100 :] - 15.0).max() < 0.8
    finished(rig)


def test_turns_without_a_radius_take_the_parameter_and_face_the_centre():
    rig = started(Kinematic(NAV_LOITER_RAD=20.0).flying(), item(0, TURNS, 0.0, 0.0, params=(1.0, 0, 0, nan)))
    rig.run(20.0)
    assert hypot(rig.pos[0], rig.pos[1]) == pytest.approx(20.0, abs=0.8)
    assert heading_error(rig.yaw, atan2(-rig.pos[1], -rig.pos[0])) < 0.1


def test_spline_goes_through_its_points_without_stopping():
    rig = Kinematic().flying()
    started(
        rig,
        item(0, WAYPOINT, 20.0, 0.0),
        item(1, SPLINE, 50.0, 20.0, 14.0),
        item(2, SPLINE, 50.0, 60.0),
        item(3, SPLINE, 10.0, 60.0),
        item(4, LOITER, -20.0, 60.0),
    )
    rig.run_until(lambda: rig.recorder.reached == [0])
    since = len(rig.track)
    slowest = 9.0
    while rig.recorder.reached[-1] != 3:
        rig.frame()
        slowest = min(slowest, float(np.hypot(*rig.vel[:2])))
    assert slowest > 2.0
    path = flown(rig, since)
    for point in ((50.0, 20.0, -14.0), (50.0, 60.0, -10.0), (10.0, 60.0, -10.0)):
        assert np.linalg.norm(path - point, axis=1).min() < 0.8
    turn = np.diff(np.unwrap(np.arctan2(*np.diff(path[:, :2], axis=0).T[::-1])))
    assert np.abs(turn).max() / 0.02 < 1.2  # [rad/s]: no corner


def test_last_spline_point_is_held():
    rig = finished(started(Kinematic().flying(), item(0, SPLINE, 20.0, 10.0), item(1, SPLINE, 40.0, 0.0)))
    rig.run(5.0)
    assert rig.recorder.reached == [0, 1]
    assert rig.pos == pytest.approx((40.0, 0.0, -10.0), abs=0.2)


def test_loiter_to_altitude_goes_there_first_and_then_changes_its_height():
    rig = Kinematic().flying()
    since = len(rig.track)
    finished(started(rig, item(0, TO_ALT, 30.0, 0.0, 25.0)))
    path = flown(rig, since)
    assert path[path[:, 0] < 25.0][:, 2].min() > -10.3
    assert rig.pos[2] == pytest.approx(-25.0, abs=1.0)


def test_change_of_altitude_goes_on_in_the_same_direction():
    rig = Kinematic().flying()
    fly_on = item(1, CHANGE_ALT, 0.0, 0.0, 20.0, params=(1.0, 0, 0, 0))
    started(rig, item(0, WAYPOINT, 40.0, 0.0, params=(0, 4.0, 0, nan)), fly_on, item(2, WAYPOINT, 0.0, 0.0, 20.0))
    rig.run_until(lambda: rig.recorder.reached == [0])
    rig.run_until(lambda: rig.recorder.reached == [0, 1])
    assert rig.pos[2] == pytest.approx(-20.0, abs=1.0)
    assert abs(rig.pos[1]) < 0.5
    finished(rig)


def test_condition_delays_what_follows_and_not_the_flight():
    rig = Kinematic().flying()
    camera = Camera(rig)
    started(rig, item(0, WAYPOINT, 10.0), do(1, AFTER, 4.0), do(2, CAMERA, 7.0), item(3, WAYPOINT, 60.0))
    rig.run_until(lambda: rig.recorder.reached == [0])
    assert rig.run_until(lambda: bool(camera.shots)) == pytest.approx(4.0, abs=0.1)
    assert rig.recorder.reached == [0, 1, 2]
    assert rig.pos[0] > 20.0
    finished(rig)


def test_condition_of_distance_waits_until_the_next_place_is_near():
    rig = Kinematic().flying()
    camera = Camera(rig)
    finished(started(rig, item(0, WAYPOINT, 10.0), do(1, NEAR, 15.0), do(2, CAMERA), item(3, WAYPOINT, 60.0)))
    assert camera.shots[0][-3] == pytest.approx(45.0, abs=0.3)


def test_gate_is_passed_where_the_vehicle_crosses_its_plane():
    rig = Kinematic().flying()
    camera = Camera(rig)
    gate = item(1, GATE, 30.0, 8.0, params=(0, 1, 0, 0))
    finished(started(rig, item(0, WAYPOINT, 10.0), gate, do(2, CAMERA), item(3, WAYPOINT, 80.0, 0.0)))
    n, e = 80.0 - 30.0, -8.0  # normal of the plane
    assert (camera.shots[0][-3] - 30.0) * n + (camera.shots[0][-2] - 8.0) * e == pytest.approx(0.0, abs=8.0)


def test_what_is_still_delayed_when_the_item_is_done_is_left_out():
    rig = Kinematic().flying()
    camera = Camera(rig)
    finished(started(rig, item(0, WAYPOINT, 10.0), do(1, AFTER, 60.0), do(2, CAMERA), item(3, WAYPOINT, 30.0)))
    assert camera.shots == []
    assert rig.recorder.reached == [0, 3]
    assert rig.recorder.has_text("Mission item 2 did not come true: 1 more left out")


@pytest.mark.parametrize(
    ("params", "heading_deg"), [((90, 0, 0, 0), 90.0), ((200, 0, 1, 0), 200.0), ((30, 0, -1, 1), None)]
)
def test_condition_of_heading_turns_the_vehicle_on_its_leg(params, heading_deg):
    rig = Kinematic().flying()
    started(rig, item(0, WAYPOINT, 10.0), do(1, YAW, *params), do(2, SPEED, 1, 4.0, -1), item(3, WAYPOINT, 90.0))
    rig.run_until(lambda: rig.recorder.reached == [0])
    before = rig.yaw
    rig.run_until(lambda: rig.recorder.reached == [0, 1, 2])
    goal = before - radians(30.0) if heading_deg is None else radians(heading_deg)
    assert heading_error(rig.yaw, goal) < radians(3.0)
    assert rig.pos[0] < 80.0


def test_turn_keeps_its_rate_and_its_direction():
    rig = Kinematic().flying()
    before = rig.yaw
    assert rig.fc.navigator.context.heading.turn(90.0, 20.0, -1.0, is_relative=False) is ACCEPTED
    rig.run(6.0)
    assert heading_error(rig.yaw, before - radians(120.0)) < 0.2  # the rig lags behind
    rig.run(10.0)
    assert heading_error(rig.yaw, radians(90.0)) < 0.02


def test_region_of_interest_is_looked_at_until_it_is_taken_back():
    rig = Kinematic().flying()
    started(
        rig, item(0, WAYPOINT, 10.0), item(1, ROI_AT, 50.0, 50.0), item(2, WAYPOINT, 60.0), do(3, ROI_NONE),
        item(4, WAYPOINT, 120.0),
    )  # fmt: skip
    rig.run_until(lambda: rig.pos[0] > 40.0)
    assert heading_error(rig.yaw, atan2(50.0 - rig.pos[1], 50.0 - rig.pos[0])) < 0.15
    rig.run_until(lambda: rig.pos[0] > 80.0)
    assert heading_error(rig.yaw, 0.0) < 0.05


@pytest.mark.parametrize(("mode", "heading_deg"), [(0, 90.0), (1, -135.0), (2, 45.0), (3, 90.0)])
def test_yaw_mode_chooses_the_heading_of_legs(mode, heading_deg):
    rig = started(Kinematic(MPC_YAW_MODE=mode).flying(), item(0, WAYPOINT, 50.0, 0.0), item(1, WAYPOINT, 50.0, 100.0))
    rig.run_until(lambda: rig.pos[1] > 50.0)
    assert heading_error(rig.yaw, radians(heading_deg)) < 0.1


def test_jump_to_a_tag_repeats_its_items():
    rig = finished(
        started(
            Kinematic().flying(), do(0, TAG, 5), item(1, WAYPOINT, 10.0), item(2, WAYPOINT, 20.0), do(3, TO_TAG, 5, 1)
        )
    )
    assert rig.recorder.reached == [0, 1, 2, 3, 0, 1, 2, 3]


def test_payload_gets_the_altitude_above_sea_level_and_a_refusal_does_not_stop_the_mission():
    rig = Kinematic().flying()
    camera = Camera(rig, (ROI_AT,), Reply(Verdict.FAILED, "the gimbal is stuck"))
    finished(started(rig, item(0, WAYPOINT, 10.0), item(1, ROI_AT, 50.0, 50.0, 3.0), item(2, WAYPOINT, 20.0)))
    assert camera.shots[0][7] == pytest.approx(rig.state.home.alt_m + 3.0)
    assert rig.recorder.has_text("Mission item 2: the gimbal is stuck")


def test_items_for_the_payload_are_refused_unless_something_takes_them():
    rig = Kinematic().ready()
    mission = [item(0, WAYPOINT, 10.0), do(1, CAMERA)]
    refusal = rig.fc.lists.load(ListKind.MISSION, mission)
    assert (refusal.seq, refusal.result, refusal.reason) == (1, 3, "no payload takes command 203")
    Camera(rig)
    assert rig.fc.lists.load(ListKind.MISSION, mission) is None


def test_waypoint_missed_by_a_change_of_home_is_turned_back_to():
    rig = started(Kinematic().flying(), item(0, WAYPOINT, 40.0, 0.0), item(1, WAYPOINT, 80.0, 0.0))
    rig.run_until(lambda: rig.pos[0] > 37.0)
    home = rig.state.home
    assert rig.fc.request(SetHome(home.lat_deg, home.lon_deg, home.alt_m + 15.0)).verdict is Verdict.ACCEPTED
    furthest = 0.0
    while 0 not in rig.recorder.reached:
        rig.frame()
        furthest = max(furthest, rig.pos[0])
    assert rig.pos == pytest.approx((40.0, 0.0, -25.0), abs=2.0)
    assert abs(rig.pos[2] + 25.0) < 0.8
    assert furthest < 46.0
    finished(rig)


def test_speed_item_counts_at_once_also_behind_a_condition():
    rig = Kinematic().flying()
    started(rig, item(0, WAYPOINT, 10.0), do(1, NEAR, 40.0), do(2, SPEED, 1, 2.0, -1), item(3, WAYPOINT, 90.0))
    rig.run_until(lambda: rig.pos[0] > 40.0)
    assert rig.vel[0] == pytest.approx(5.0, abs=0.1)
    rig.run_until(lambda: rig.pos[0] > 54.0)
    assert rig.vel[0] == pytest.approx(2.0, abs=0.2)


def test_same_current_item_in_a_new_mission_is_flown_on():
    rig = started(Kinematic().flying(), item(0, WAYPOINT, 20.0), item(1, WAYPOINT, 80.0), item(2, WAYPOINT, 80.0, 30.0))
    rig.run_until(lambda: rig.state.mission_current == 1 and rig.pos[0] > 40.0)
    new = [item(0, WAYPOINT, 20.0), item(1, WAYPOINT, 80.0), item(2, WAYPOINT, 120.0, 0.0), item(3, LOITER, 150.0)]
    assert rig.fc.lists.load(ListKind.MISSION, new) is None
    rig.run(1.0)
    assert rig.state.mission_current == 1
    assert rig.vel[0] == pytest.approx(5.0, abs=0.2)
    assert rig.sp("exit_speed") == pytest.approx(5.0)
    rig.run_until(lambda: rig.recorder.reached == [0, 1, 2])


@pytest.mark.parametrize(("restart", "reached"), [(0, [0, 1]), (1, [0, 0, 1])])
def test_mission_entered_again_begins_anew_if_asked_to(restart, reached):
    rig = started(Kinematic(MIS_RESTART=restart).flying(), item(0, WAYPOINT, 20.0), item(1, WAYPOINT, 60.0))
    rig.run_until(lambda: rig.pos[0] > 40.0)
    assert rig.fc.request(ChangeMode(Mode.HOLD)).verdict is Verdict.ACCEPTED
    rig.run(4.0)
    finished(started_again(rig))
    assert rig.recorder.reached == reached


def started_again(rig):
    assert rig.fc.request(ChangeMode(Mode.MISSION)).verdict is Verdict.ACCEPTED
    rig.frame()
    return rig


@pytest.mark.parametrize(
    ("asked", "has_takeoff", "has_landing", "lacks"),
    [
        (0, False, False, None), (1, False, True, "no take-off"), (2, True, False, "no landing"),
        (3, True, True, None), (4, False, False, None), (4, True, False, "no landing"), (4, False, True, "no take-off"),
    ],
)  # fmt: skip
def test_mission_needs_the_ends_that_the_parameter_asks_for(asked, has_takeoff, has_landing, lacks):
    rig = Kinematic(MIS_TKO_LAND_REQ=asked).ready()
    positions = [TAKEOFF] * has_takeoff + [WAYPOINT] + [LAND] * has_landing
    assert (
        rig.fc.lists.load(ListKind.MISSION, [item(seq, command, 10.0) for seq, command in enumerate(positions)]) is None
    )
    reply = rig.fc.request(ChangeMode(Mode.MISSION))
    assert (reply.verdict is Verdict.ACCEPTED) == (lacks is None)
    assert (lacks or "") in reply.reason


def test_fence_is_switched_on_the_way():
    rig = Kinematic(GF_MAX_HOR_DIST=500.0).flying()
    fence = rig.fc.fence
    assert fence.is_active
    started(
        rig, item(0, WAYPOINT, 10.0), do(1, 207, 0), item(2, WAYPOINT, 40.0), do(3, 207, 1), item(4, WAYPOINT, 60.0)
    )
    rig.run_until(lambda: rig.recorder.reached == [0, 1])
    assert not fence.is_active
    finished(rig)
    assert fence.is_active


def test_landing_item_lands_on_a_target_that_is_seen():
    rig = Kinematic().flying()
    land = item(1, LAND, 20.0, 0.0, 0.0, params=(0, 1, 0, nan))
    started(rig, item(0, WAYPOINT, 10.0), land)
    while rig.state.is_armed:
        rig.frame()
        rig.fc.request(LandingTargetReport((21.0, 1.5, 0.0)))
    assert rig.pos[:2] == pytest.approx((21.0, 1.5), abs=0.3)
    assert rig.recorder.reached == [0, 1]
