"""The kinds of return: where they lead, which way, how high and how fast, and the way back along one's own track."""

import itertools
from math import hypot, nan

import numpy as np
import pytest

from autopilot.interface.client_requests import ChangeMode, GoTo, StartMission
from autopilot.interface.item_lists import ListKind
from autopilot.interface.vehicle_state import Mode, Verdict
from autopilot.navigator.fence.fence_items import FenceCommand
from autopilot.navigator.fence.rally_points import RALLY_POINT
from autopilot.navigator.paths.breadcrumbs import without_loops, without_straights
from tests.unit.autopilot.kinematic import Kinematic, do, geo, item, position_setpoint

LAND_START, WAYPOINT, LAND, TAKEOFF = 189, 16, 21, 22
BLOCK = ((20.0, -20.0), (20.0, 20.0), (40.0, 20.0), (40.0, -20.0))


def at(north, east, height=10.0, **params):
    """Flying at a place."""
    rig = Kinematic(**params).flying(height)
    go(rig, north, east, height)
    return rig


def go(rig, north, east, height=10.0):
    assert rig.fc.request(GoTo(*geo(north, east, height), nan, nan)).verdict is Verdict.ACCEPTED
    rig.run_until(lambda: hypot(rig.pos[0] - north, rig.pos[1] - east) < 0.5)
    rig.run(1.0)


def load_rally(rig, *positions):
    items = [item(i, RALLY_POINT, *position, frame=3) for i, position in enumerate(positions)]
    assert rig.fc.lists.load(ListKind.RALLY, items) is None


def load_block(rig, points=BLOCK):
    items = [item(i, FenceCommand.EXCLUSION_VERTEX, *p, 0.0, (len(points), 0, 0, 0), 5) for i, p in enumerate(points)]
    assert rig.fc.lists.load(ListKind.FENCE, items) is None


def returned(rig, mode=Mode.RETURN):
    """The track of the return, and where it ended."""
    start = len(rig.track)
    assert rig.fc.request(ChangeMode(mode)).verdict is Verdict.ACCEPTED
    rig.disarmed()
    return np.array(rig.track[start:])


def nearest_m(track, north, east):
    return float(np.min(np.hypot(track[:, 0] - north, track[:, 1] - east)))


@pytest.mark.parametrize(
    ("kind", "rally", "end"),
    [
        (0, [(50.0, 20.0, 15.0)], (50.0, 20.0)),
        (0, [(150.0, 20.0, 15.0)], (0.0, 0.0)),  # home is nearer
        (5, [(150.0, 20.0, 15.0)], (150.0, 20.0)),
        (5, [], (0.0, 0.0)),
        (1, [(150.0, 20.0, 15.0), (50.0, 20.0, 15.0)], (50.0, 20.0)),
        (3, [(50.0, 20.0, 15.0)], (50.0, 20.0)),
    ],
)
def test_return_ends_at_the_safe_point_that_its_type_chooses(kind, rally, end):
    rig = at(60.0, 0.0, RTL_TYPE=kind)
    load_rally(rig, *rally)
    returned(rig)
    assert rig.pos[:2] == pytest.approx(end, abs=0.5)


def test_way_to_a_rally_point_is_not_lower_than_the_point():
    rig = at(60.0, 0.0, RTL_RETURN_ALT=15.0)
    load_rally(rig, (30.0, 0.0, 25.0))
    assert returned(rig)[:, 2].min() == pytest.approx(-25.0, abs=0.6)
    assert rig.recorder.has_text("Return to rally point 1")


def test_rally_point_outside_the_fence_is_not_returned_to():
    rig = at(60.0, 0.0)
    load_block(rig)
    load_rally(rig, (30.0, 10.0, 15.0))
    returned(rig)
    assert rig.pos[:2] == pytest.approx((0.0, 0.0), abs=0.5)


def test_return_with_a_mission_landing_flies_it():
    rig = at(60.0, 0.0, RTL_TYPE=1)
    mission = [item(0, WAYPOINT, 200.0), do(1, LAND_START), item(2, WAYPOINT, 50.0, 40.0, 12.0),
               item(3, WAYPOINT, 20.0, 40.0, 8.0), item(4, LAND, 20.0, 30.0, 0.0)]  # fmt: skip
    assert rig.fc.lists.load(ListKind.MISSION, mission) is None
    track = returned(rig)
    assert rig.pos[:2] == pytest.approx((20.0, 30.0), abs=0.5)
    assert nearest_m(track, 50.0, 40.0) < 2.1
    assert nearest_m(track, 20.0, 40.0) < 2.1
    assert nearest_m(track, 200.0, 0.0) > 100.0


def test_return_along_the_mission_goes_back_over_its_places():
    rig = Kinematic(RTL_TYPE=2).ready()
    positions = ((0.0, 30.0), (40.0, 30.0), (40.0, 80.0))
    items = [item(0, TAKEOFF), *(item(i + 1, WAYPOINT, *position) for i, position in enumerate(positions))]
    assert rig.fc.lists.load(ListKind.MISSION, items) is None
    assert rig.fc.request(StartMission(0)).verdict is Verdict.ACCEPTED
    assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED
    rig.run_until(lambda: rig.pos[1] > 60.0)
    track = returned(rig)
    for north, east in positions[:2]:
        assert nearest_m(track, north, east) < 1.2
    assert rig.pos[:2] == pytest.approx((0.0, 0.0), abs=0.6)


def test_return_goes_around_what_the_fence_excludes():
    rig = at(0.0, 40.0)
    go(rig, 60.0, 40.0)
    go(rig, 60.0, 0.0)
    load_block(rig)
    track = returned(rig)
    assert not rig.state.fence.breach_count
    assert rig.pos[:2] == pytest.approx((0.0, 0.0), abs=0.5)
    assert nearest_m(track, 30.0, 0.0) > 20.0
    assert rig.recorder.has_text("Return around the fence, 2 corners")


def test_return_from_inside_a_zone_leaves_it_first():
    rig = at(30.0, 15.0, GF_ACTION=1)
    load_block(rig)
    rig.run(0.1)
    assert rig.state.fence.breached
    track = returned(rig)
    assert rig.pos[:2] == pytest.approx((0.0, 0.0), abs=0.5)
    inside = track[(track[:, 0] > 20.0) & (track[:, 0] < 40.0) & (np.abs(track[:, 1]) < 20.0)]
    assert inside[:, 1].min() > 10.0  # straight out to the east, not through the middle


def test_return_without_a_way_is_direct_and_says_so():
    rig = at(60.0, 0.0, GF_ACTION=1)
    wall = [item(0, FenceCommand.INCLUSION_CIRCLE, 0.0, 0.0, 0.0, (30.0, 0, 0, 0), 5),
            item(1, FenceCommand.INCLUSION_CIRCLE, 60.0, 0.0, 0.0, (20.0, 0, 0, 0), 5)]  # fmt: skip
    assert rig.fc.lists.load(ListKind.FENCE, wall) is None
    returned(rig)
    assert rig.recorder.has_text("No way back inside the fence")
    assert rig.pos[:2] == pytest.approx((0.0, 0.0), abs=0.5)


@pytest.mark.parametrize(("cone", "height"), [(0, 30.0), (45, 20.0), (65, 10.0), (90, 10.0)])
def test_cone_lowers_the_way_back_from_near(cone, height):
    rig = at(20.0, 0.0, 5.0, RTL_RETURN_ALT=30.0, RTL_CONE_ANG=cone)
    assert returned(rig)[:, 2].min() == pytest.approx(-height, abs=0.7)


def test_way_back_stays_below_the_ceiling():
    rig = at(60.0, 0.0, RTL_RETURN_ALT=30.0, GF_MAX_VER_DIST=20.0)
    assert returned(rig)[:, 2].min() > -18.6
    assert not rig.state.fence.breach_count


def test_return_has_a_speed_of_its_own():
    rig = at(60.0, 0.0, RTL_RETURN_SPD=3.0)
    rig.fc.request(ChangeMode(Mode.RETURN))
    rig.run_until(lambda: rig.pos[0] < 40.0)
    assert hypot(*rig.vel[:2]) == pytest.approx(3.0, abs=0.1)


# ---- smart return ----


def test_smart_return_goes_back_through_the_corner():
    rig = at(40.0, 0.0)
    go(rig, 40.0, 50.0)
    track = returned(rig, Mode.SMART_RETURN)
    assert nearest_m(track, 40.0, 0.0) < 2.0
    assert rig.pos[:2] == pytest.approx((0.0, 0.0), abs=2.0)


def test_smart_return_leaves_out_a_loop():
    rig = at(20.0, 0.0)
    for position in ((60.0, 0.0), (60.0, 40.0), (20.0, 40.0), (20.0, 1.0), (-10.0, 20.0)):
        go(rig, *position)
    track = returned(rig, Mode.SMART_RETURN)
    assert nearest_m(track, 60.0, 40.0) > 30.0
    assert nearest_m(track, 20.0, 0.0) < 3.0
    assert rig.pos[:2] == pytest.approx((0.0, 0.0), abs=2.0)


def test_smart_return_that_was_broken_off_goes_on_from_there():
    rig = at(40.0, 0.0)
    go(rig, 40.0, 50.0)
    rig.fc.request(ChangeMode(Mode.SMART_RETURN))
    rig.run_until(lambda: rig.pos[1] < 20.0)
    rig.fc.request(ChangeMode(Mode.HOLD))
    go(rig, 60.0, 20.0)
    track = returned(rig, Mode.SMART_RETURN)
    assert nearest_m(track, 40.0, 0.0) < 2.0
    assert nearest_m(track, 40.0, 50.0) > 25.0


def test_smart_return_without_a_track_is_refused():
    rig = at(0.0, 10.0)
    rig.fc.navigator.crumbs.points.clear()
    rig.fc.navigator.crumbs._next_us = 1 << 62
    reply = rig.fc.request(ChangeMode(Mode.SMART_RETURN))
    assert (reply.verdict, reply.reason) == (Verdict.TEMPORARILY_REJECTED, "no way back is known")


def test_track_longer_than_its_memory_is_tidied_and_then_given_up():
    rig = Kinematic(SRTL_POINTS=50).flying()
    crumbs = rig.fc.navigator.crumbs
    go(rig, 0.0, 150.0)  # straight on: 2 points are enough
    assert crumbs.refusal() == ""
    assert len(crumbs.points) < 50
    crumbs.points = [(10.0 * i, 15.0 * (i % 2), -10.0) for i in range(48)]  # a zigzag cannot be shortened
    go(rig, 0.0, 140.0)
    assert "too long" in crumbs.refusal()
    assert len(crumbs.points) <= 50


def test_straight_track_keeps_its_ends_and_its_corners():
    track = np.array([(float(i), 0.0, -10.0) for i in range(20)] + [(19.0, float(i), -10.0) for i in range(1, 20)])
    assert without_straights(track, 1.0).tolist() == [[0, 0, -10], [19, 0, -10], [19, 19, -10]]


def test_figure_of_eight_is_cut_where_it_crosses():
    track = np.array([(0, 0, 0), (50, 50, 0), (50, 0, 0), (25, 24.5, 0), (0, 50, 0)], dtype=float)
    dense = np.concatenate([np.linspace(a, b, 20, endpoint=False) for a, b in itertools.pairwise(track)])
    cut = without_loops(np.vstack((dense, track[-1:])), 2.0)
    length = np.sum(np.hypot(*np.diff(cut[:, :2], axis=0).T))
    assert length < 75.0  # 161 m with the loop
    assert cut[0].tolist() == [0, 0, 0]
    assert cut[-1].tolist() == [0, 50, 0]


# ---- goto ----


def test_goto_goes_around_what_the_fence_excludes_and_holds_there():
    rig = at(0.0, 0.0)
    load_block(rig)
    start = len(rig.track)
    assert rig.fc.request(GoTo(*geo(70.0, 0.0, 14.0), 1.0, nan)).verdict is Verdict.ACCEPTED
    rig.run_until(lambda: hypot(rig.pos[0] - 70.0, rig.pos[1]) < 0.3 and abs(rig.pos[2] + 14.0) < 0.3, 60.0)
    rig.run(3.0)
    assert nearest_m(np.array(rig.track[start:]), 30.0, 0.0) > 20.0
    assert not rig.state.fence.breach_count
    assert rig.yaw == pytest.approx(1.0, abs=0.05)
    rig.fc.request(ChangeMode(Mode.HOLD))
    rig.run(1.0)
    assert rig.pos[:2] == pytest.approx((70.0, 0.0), abs=0.3)


def test_goto_can_be_stopped_on_its_way_around():
    rig = at(0.0, 0.0)
    load_block(rig)
    rig.fc.request(GoTo(*geo(70.0, 0.0, 10.0), nan, nan))
    rig.run(3.0)
    assert rig.fc.request(GoTo()).verdict is Verdict.ACCEPTED
    rig.run(5.0)
    assert hypot(*rig.vel[:2]) < 0.05
    assert rig.pos[0] < 25.0


def test_goto_without_a_way_is_refused():
    rig = at(0.0, 0.0)
    wall = [item(i, FenceCommand.INCLUSION_CIRCLE, 100.0 * i, 0.0, 0.0, (30.0, 0, 0, 0), 5) for i in range(2)]
    assert rig.fc.lists.load(ListKind.FENCE, wall) is None
    reply = rig.fc.request(GoTo(*geo(100.0, 0.0, 10.0), nan, nan))
    assert (reply.verdict, reply.reason) == (Verdict.DENIED, "there is no way to the target inside the fence")


def test_guided_goto_goes_around_what_the_fence_excludes():
    rig = at(0.0, 0.0)
    load_block(rig)
    assert rig.fc.request(ChangeMode(Mode.GUIDED)).verdict is Verdict.ACCEPTED
    start = len(rig.track)
    assert rig.fc.request(GoTo(*geo(70.0, 0.0, 10.0), nan, nan, mode=Mode.GUIDED)).verdict is Verdict.ACCEPTED
    rig.run_until(lambda: hypot(rig.pos[0] - 70.0, rig.pos[1]) < 0.3, 60.0)
    assert nearest_m(np.array(rig.track[start:]), 30.0, 0.0) > 20.0
    assert (
        rig.fc.request(GoTo(*geo(30.0, 0.0, 10.0), nan, nan, mode=Mode.GUIDED)).reason
        == "target is outside fence: shapes"
    )
    rig.fc.request(GoTo(*geo(0.0, 0.0, 10.0), nan, nan, mode=Mode.GUIDED))
    rig.run(2.0)
    rig.fc.request(position_setpoint(60.0, 10.0, -10.0))  # a stream takes over at once
    rig.run_until(lambda: hypot(rig.pos[0] - 60.0, rig.pos[1] - 10.0) < 0.3, 30.0)
