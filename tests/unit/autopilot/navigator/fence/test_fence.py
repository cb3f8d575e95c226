"""The geofence in flight: what breaches it, what that leads to, and where it lets nobody go."""

from math import nan
from timeit import repeat

import pytest

from autopilot.interface.client_requests import ChangeMode, GoTo, LandAt, OffboardSetpoint, TakeOff
from autopilot.interface.item_lists import ListKind
from autopilot.interface.vehicle_state import FenceLimit, Mode, Severity, Verdict
from autopilot.navigator.fence.fence_items import FenceCommand
from autopilot.ports import SETPOINT_TRAJECTORY
from tests.unit.autopilot.kinematic import ORIGIN, Kinematic, geo, item

SQUARE = ((-50.0, -50.0), (-50.0, 50.0), (50.0, 50.0), (50.0, -50.0))


def polygon(points, command=FenceCommand.INCLUSION_VERTEX):
    params = (len(points), 0.0, 0.0, 0.0)
    return [item(i, command, north, east, 0.0, params, 5) for i, (north, east) in enumerate(points)]


def fenced(rig, items):
    assert rig.fc.lists.load(ListKind.FENCE, items) is None
    return rig


@pytest.mark.parametrize(
    ("action", "mode"),
    [(1, Mode.HOLD), (2, Mode.HOLD), (3, Mode.RETURN), (5, Mode.LAND), (4, Mode.TERMINATION), (6, Mode.SMART_RETURN)],
)
def test_breach_leads_to_the_action_that_is_set(action, mode):
    rig = fenced(Kinematic(GF_ACTION=action).flying(), polygon(SQUARE))
    assert not rig.state.fence.breached
    rig.pos[0] = 55.0
    rig.run(0.1)
    assert rig.state.fence.breached == FenceLimit.SHAPES
    assert rig.state.mode is mode
    assert any(level is Severity.CRITICAL and "Geofence breached" in text for level, text in rig.recorder.texts)
    assert rig.recorder.has_text("outside shapes")


def test_fence_without_an_action_is_none():
    rig = fenced(Kinematic(GF_ACTION=0).flying(), polygon(SQUARE))
    rig.pos[0] = 55.0
    rig.run(0.1)
    assert not rig.state.fence.is_active
    assert not rig.state.fence.breached
    assert rig.fc.request(GoTo(*geo(80.0, 0.0, 10.0), nan, nan)).verdict is Verdict.ACCEPTED


def test_breach_is_over_once_the_vehicle_is_well_inside_and_counts_again():
    rig = fenced(Kinematic(GF_ACTION=1).flying(), polygon(SQUARE))
    for expected in (1, 2):
        rig.pos[0] = 52.0
        rig.run(0.1)
        assert rig.state.fence.breach_count == expected
        rig.pos[0] = 49.8  # inside, but by less than the hysteresis
        rig.frame()
        assert rig.state.fence.breached
        rig.pos[0] = 40.0
        rig.run(0.1)
        assert not rig.state.fence.breached


@pytest.mark.parametrize(
    ("params", "pos", "limit"),
    [
        ({"GF_MAX_HOR_DIST": 30.0}, (0.0, 31.0, -10.0), FenceLimit.RADIUS),
        ({"GF_MAX_VER_DIST": 20.0}, (0.0, 0.0, -21.0), FenceLimit.CEILING),
        ({"GF_MIN_ALT": 5.0}, (0.0, 0.0, -4.0), FenceLimit.FLOOR),
    ],
)
def test_limits_around_home_are_watched(params, pos, limit):
    rig = Kinematic(GF_ACTION=3, **params).flying()
    assert rig.state.fence.is_active
    rig.run(1.0)
    assert not rig.state.fence.breached
    rig.pos[:] = pos
    rig.run(0.1)
    assert rig.state.fence.last_breach == limit
    assert rig.state.mode is Mode.RETURN


def test_floor_does_not_hold_back_take_off_and_landing():
    rig = Kinematic(GF_ACTION=3, GF_MIN_ALT=8.0).flying(height_m=12.0)
    rig.fc.request(ChangeMode(Mode.LAND))
    rig.disarmed()
    assert rig.state.fence.breach_count == 0


def test_prediction_stops_the_vehicle_inside():
    rig = fenced(Kinematic(GF_PREDICT=1, GF_MARGIN=3.0).flying(), polygon(SQUARE))

    def fly_north():
        rig.fc.request(OffboardSetpoint(rig.time_us, int(SETPOINT_TRAJECTORY), vel_ned=(8.0, 0.0, 0.0)))
        return rig.recorder.has_text("close to shapes")

    fly_north()
    assert rig.fc.request(ChangeMode(Mode.OFFBOARD)).verdict is Verdict.ACCEPTED
    rig.run_until(fly_north, 20.0)
    rig.run(10.0)
    assert 35.0 < max(pos[0] for pos in rig.track) < 50.0
    assert rig.state.mode is Mode.HOLD


def test_vehicle_outside_may_not_be_armed():
    rig = fenced(Kinematic(), polygon([(north + 200.0, east) for north, east in SQUARE]))
    rig.run(1.0)
    assert rig.fc.check_arming() == ["outside fence: shapes"]
    assert rig.fc.arm(force=False).verdict is Verdict.TEMPORARILY_REJECTED
    assert rig.fc.lists.load(ListKind.FENCE, []) is None
    assert rig.fc.check_arming() == []


def test_places_outside_are_refused():
    rig = fenced(Kinematic(GF_MAX_VER_DIST=30.0).flying(), polygon(SQUARE))
    for position, part in (((60.0, 0.0, 10.0), "shapes"), ((0.0, 0.0, 31.0), "ceiling")):
        reply = rig.fc.request(GoTo(*geo(*position), nan, nan))
        assert reply.verdict is Verdict.DENIED
        assert f"target is outside fence: {part}" in reply.reason
    assert rig.fc.request(LandAt(*geo(60.0, 0.0)[:2], nan)).verdict is Verdict.DENIED
    assert rig.fc.request(GoTo(*geo(40.0, 0.0, 20.0), nan, nan)).verdict is Verdict.ACCEPTED


def test_take_off_above_the_ceiling_is_refused():
    rig = Kinematic(GF_MAX_VER_DIST=30.0).ready()
    reply = rig.fc.request(TakeOff(ORIGIN.alt_m + 40.0, nan))
    assert (reply.verdict, reply.reason) == (Verdict.DENIED, "takeoff would end outside fence: ceiling")
    assert rig.fc.request(TakeOff(ORIGIN.alt_m + 20.0, nan)).verdict is Verdict.ACCEPTED


def test_mission_with_an_item_outside_is_not_started():
    rig = fenced(Kinematic().flying(), polygon(SQUARE))
    assert rig.fc.lists.load(ListKind.MISSION, [item(0, 16, 20.0), item(1, 16, 60.0), item(2, 20, frame=2)]) is None
    assert rig.recorder.has_text("Mission: item 2 is outside fence: shapes")
    reply = rig.fc.request(ChangeMode(Mode.MISSION))
    assert reply.verdict is Verdict.TEMPORARILY_REJECTED
    assert reply.reason == "item 2 is outside fence: shapes"
    fenced(rig, polygon([(1.5 * north, east) for north, east in SQUARE]))
    assert rig.fc.request(ChangeMode(Mode.MISSION)).verdict is Verdict.ACCEPTED


def test_fence_is_switched_by_command_and_as_a_whole_by_its_parameter():
    rig = fenced(Kinematic(GF_ACTION=1).flying(), polygon(SQUARE))
    rig.table.set("GF_MAX_VER_DIST", 5.0)
    rig.run(0.1)
    assert rig.state.fence.breached == FenceLimit.CEILING
    rig.fc.fence.disable(FenceLimit.CEILING)
    rig.run(0.1)
    assert not rig.state.fence.breached
    rig.fc.fence.enable(FenceLimit.CEILING)
    rig.run(0.1)
    assert rig.state.fence.breached == FenceLimit.CEILING
    rig.table.set("GF_ENABLE", 0)
    assert not rig.state.fence.is_active
    rig.table.set("GF_ENABLE", 1)
    rig.table.set("GF_TYPES", 4)
    rig.run(0.1)
    assert rig.state.fence.is_active
    assert not rig.state.fence.breached


def test_refused_fence_leaves_the_old_one_watched():
    rig = fenced(Kinematic(GF_ACTION=1).flying(), polygon(SQUARE))
    assert rig.fc.lists.load(ListKind.FENCE, polygon(SQUARE[:2])) is not None
    assert len(rig.fc.lists.items(ListKind.FENCE)) == 4
    rig.pos[0] = 55.0
    rig.run(0.1)
    assert rig.state.fence.breached


def test_gnss_can_be_what_is_watched():
    rig = fenced(Kinematic(GF_ACTION=1, GF_SOURCE=1).flying(), polygon(SQUARE))
    rig.samples["gnss"]["pos_ned"] = (60.0, 0.0, -10.0)
    rig.run(0.1)
    assert rig.state.fence.breached


def test_lost_position_is_no_breach():
    rig = fenced(Kinematic(GF_ACTION=3).flying(), polygon(SQUARE))
    rig.flags = 0
    rig.pos[0] = 60.0
    rig.frame()
    assert not rig.state.fence.breached


def test_fence_costs_next_to_nothing_away_from_its_borders():
    def cost_us(rig):
        return min(repeat(rig.fc.fence.frame, number=1000, repeat=20)) * 1e3

    rig = Kinematic().flying()
    assert cost_us(rig) < 1.0  # 0.04 us measured: there is no fence
    fenced(rig, polygon(SQUARE))
    rig.run(0.1)
    assert cost_us(rig) < 8.0  # 0.6 us measured, and 60 us where the distance is computed anew
