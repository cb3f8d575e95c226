"""Where to look, pausing, landing sequences, aborted landings: over the kinematic stand-in."""

from math import atan2, degrees, nan

import pytest

from autopilot.interface.client_requests import ChangeMode, GoTo, StartMission
from autopilot.interface.item_lists import ListKind
from autopilot.interface.vehicle_state import Mode, Reply, Verdict
from tests.unit.autopilot.kinematic import Kinematic, do, geo, heading_error, item, position_setpoint

WAYPOINT, LAND, RETURN_PATH, LAND_START = 16, 21, 188, 189


def test_region_of_interest_is_faced_while_holding_and_after_going_elsewhere():
    rig = Kinematic().flying()
    lat, lon, _ = geo(30.0, 40.0)
    assert rig.fc.guidance.look_at(195, lat, lon, nan).verdict is Verdict.ACCEPTED
    rig.run(3.0)
    assert heading_error(rig.yaw, atan2(40.0, 30.0)) < 0.02
    rig.fc.request(GoTo(*geo(30.0, 0.0)[:2], nan, nan, nan))
    rig.run(15.0)
    assert heading_error(rig.yaw, atan2(40.0, 0.0)) < 0.02
    assert rig.fc.guidance.look_ahead(197, 0.0).verdict is Verdict.ACCEPTED
    rig.fc.request(GoTo(*geo(0.0, 0.0)[:2], nan, nan, nan))
    rig.run(10.0)
    assert heading_error(rig.yaw, atan2(0.0, -1.0)) < 0.05


@pytest.mark.parametrize("command", [195, 201])
def test_region_of_interest_is_handed_to_a_gimbal(command):
    seen = []

    class Gimbal:
        def takes(self, number):
            return number in (command, 197)

        def run(self, number, params, x, y, z):
            seen.append((number, params[0], x, y, z))
            return Reply(Verdict.DENIED, "somebody else points it")

    rig = Kinematic().flying()
    rig.fc.payload.add(Gimbal())
    reply = rig.fc.guidance.look_at(command, 47.0, 8.0, 500.0)
    assert reply.reason == "somebody else points it"
    assert rig.fc.guidance.look_ahead(196, 0.0).verdict is Verdict.ACCEPTED
    assert seen == [(command, 3.0, 47.0, 8.0, 500.0)]


def test_turn_is_refused_on_the_ground_and_ends_with_the_next_place():
    rig = Kinematic().ready()
    assert rig.fc.guidance.turn(90.0, 0.0, 0.0, is_relative=False).verdict is Verdict.TEMPORARILY_REJECTED
    rig.flying()
    assert rig.fc.guidance.turn(90.0, 0.0, 0.0, is_relative=False).verdict is Verdict.ACCEPTED
    rig.run(6.0)
    assert degrees(rig.yaw) == pytest.approx(90.0, abs=1.0)
    rig.fc.request(GoTo(*geo(-30.0, 0.0)[:2], nan, nan, nan))
    rig.run(6.0)
    assert heading_error(rig.yaw, atan2(0.0, -1.0)) < 0.05


def test_paused_setpoints_of_a_client_are_gone_on_with():
    rig = Kinematic().flying()

    def stream(seconds):
        for _ in range(round(seconds / 0.02)):
            rig.fc.request(position_setpoint(200.0, 0.0, -10.0))
            rig.frame()

    stream(0.5)
    assert rig.fc.request(ChangeMode(Mode.OFFBOARD)).verdict is Verdict.ACCEPTED
    stream(4.0)
    assert rig.vel[0] > 3.0
    assert rig.fc.guidance.pause().verdict is Verdict.ACCEPTED
    stream(5.0)
    assert abs(rig.vel[0]) < 0.1
    assert rig.fc.guidance.resume().verdict is Verdict.ACCEPTED
    stream(4.0)
    assert rig.state.mode is Mode.OFFBOARD
    assert rig.vel[0] > 3.0


def test_pause_without_anything_to_pause_is_refused():
    assert Kinematic().flying().fc.guidance.pause().verdict is Verdict.TEMPORARILY_REJECTED


def test_mission_goes_on_at_its_nearest_landing_sequence():
    rig = Kinematic().flying()
    assert rig.fc.guidance.fly_landing_sequence().verdict is Verdict.FAILED
    rig.fc.lists.load(ListKind.MISSION,
        [
            item(0, WAYPOINT, 300.0), item(1, LAND_START, 200.0), item(2, WAYPOINT, 200.0), item(3, LAND, 220.0),
            do(4, LAND_START), item(5, WAYPOINT, 30.0, 20.0), item(6, LAND, 40.0, 20.0, 0.0),
        ]
    )  # fmt: skip
    assert rig.fc.guidance.fly_landing_sequence().verdict is Verdict.ACCEPTED
    rig.disarmed()
    assert rig.recorder.reached == [4, 5, 6]
    assert rig.pos[:2] == pytest.approx((40.0, 20.0), abs=0.4)


def test_return_path_is_joined_at_its_nearest_leg():
    rig = Kinematic().flying()
    mission = [item(0, WAYPOINT, 0.0, 100.0), do(1, RETURN_PATH)]
    mission += [item(2, WAYPOINT, -20.0, 90.0), item(3, WAYPOINT, -10.0, -60.0), item(4, LAND, 0.0, -80.0, 0.0)]
    rig.fc.lists.load(ListKind.MISSION, mission)
    assert rig.fc.guidance.fly_return_path().verdict is Verdict.ACCEPTED
    rig.disarmed()
    assert rig.recorder.reached == [3, 4]


@pytest.mark.parametrize(("height_m", "reached_m"), [(nan, 2.5), (15.0, 15.0)])
def test_landing_can_be_aborted(height_m, reached_m):
    rig = Kinematic().flying()
    assert rig.fc.guidance.abort_landing(height_m).verdict is Verdict.TEMPORARILY_REJECTED
    rig.fc.request(ChangeMode(Mode.LAND))
    rig.run_until(lambda: rig.pos[2] > -1.5)
    assert rig.fc.guidance.abort_landing(height_m).verdict is Verdict.ACCEPTED
    rig.run(20.0)
    assert rig.state.mode is Mode.HOLD
    assert -rig.pos[2] == pytest.approx(reached_m, abs=0.1)


@pytest.mark.parametrize("height_m", [10_100.0, 1e6])
def test_landing_is_not_aborted_into_the_stratosphere(height_m):
    rig = landing()
    reply = rig.fc.guidance.abort_landing(height_m)
    assert (reply.verdict, reply.reason) == (Verdict.DENIED, "altitude is out of range")
    rig.disarmed()


def test_landing_is_not_aborted_through_the_ceiling():
    rig = landing(GF_ACTION=1, GF_MAX_VER_DIST=20.0)
    assert "fence" in rig.fc.guidance.abort_landing(30.0).reason
    assert rig.fc.guidance.abort_landing(15.0).verdict is Verdict.ACCEPTED


def landing(**params):
    rig = Kinematic(**params).flying()
    rig.fc.request(ChangeMode(Mode.LAND))
    rig.run_until(lambda: rig.pos[2] > -1.5)
    return rig


def test_mission_ends_after_the_last_item_asked_for():
    rig = Kinematic().flying()
    rig.fc.lists.load(ListKind.MISSION, [item(i, WAYPOINT, 10.0 * (i + 1)) for i in range(4)])
    assert rig.fc.request(StartMission(1, 2)).verdict is Verdict.ACCEPTED
    rig.run_until(lambda: rig.state.mode is Mode.HOLD)
    assert rig.recorder.reached == [1, 2]
    assert rig.fc.request(StartMission(1, 7)).verdict is Verdict.DENIED
