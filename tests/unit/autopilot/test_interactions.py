"""What one mode was asked for, or had begun, does no harm when another takes over: whole sequences on flat ground."""

from dataclasses import replace
from math import hypot, nan

from autopilot.commander.failsafe import BATTERY_CRITICAL, BATTERY_EMERGENCY
from autopilot.interface.client_requests import (
    ChangeMode,
    GoTo,
    LandAt,
    LandingTargetReport,
    OrbitRequest,
    SetHome,
    TakeOff,
    TargetReport,
)
from autopilot.interface.item_lists import ListKind
from autopilot.interface.mode_spec import mode_table
from autopilot.interface.vehicle_state import Mode, Verdict
from autopilot.navigator.mission.mission import MissionState
from autopilot.navigator.modes.follow import Follow
from autopilot.ports import POSITION_VALID, VELOCITY_VALID
from autopilot.vehicles.multirotor.vehicle import MULTIROTOR
from tests.unit.autopilot.kinematic import DT_S, ORIGIN, Kinematic, do, geo, item, position_setpoint

WAYPOINT, LAND, TAKEOFF, LAND_START = 16, 21, 22, 189
INCLUSION_CIRCLE = 5003


def position(north, east, height=10.0):
    lat, lon, _ = geo(north, east)
    return lat, lon, ORIGIN.alt_m + height


class TestLeftOver:
    def test_a_landing_place_given_up_is_not_flown_to_by_the_next_landing(self):
        rig = Kinematic().flying()
        lat, lon, _ = position(200.0, 0.0)
        assert rig.fc.request(LandAt(lat, lon, nan)).verdict is Verdict.ACCEPTED
        rig.run(3.0)
        rig.fc.request(ChangeMode(Mode.HOLD))
        rig.run(5.0)
        north = rig.pos[0]
        rig.fc.request(ChangeMode(Mode.LAND))
        rig.disarmed(60.0)
        assert abs(rig.pos[0] - north) < 5.0

    def test_a_goto_refused_leaves_no_place_behind(self):
        rig = Kinematic(COM_FLT_TIME_MAX=30.0).flying()
        rig.run_until(lambda: rig.state.mode is Mode.RETURN, 60.0)
        assert rig.fc.request(GoTo(*position(300.0, 0.0), nan, nan)).verdict is Verdict.TEMPORARILY_REJECTED
        assert rig.fc.navigator.context.next_hold is None

    def test_an_orbit_refused_is_not_the_next_one(self):
        rig = Kinematic(COM_FLT_TIME_MAX=30.0).flying()
        rig.run_until(lambda: rig.state.mode is Mode.RETURN, 60.0)
        lat, lon, _ = position(300.0, 0.0)
        assert rig.fc.request(OrbitRequest(20.0, 3.0, lat_deg=lat, lon_deg=lon)).verdict is Verdict.TEMPORARILY_REJECTED
        rig.table.set("COM_FLT_TIME_MAX", -1.0)
        rig.run(1.0)
        assert rig.fc.request(ChangeMode(Mode.ORBIT)).verdict is Verdict.ACCEPTED
        circle = rig.fc.navigator.modes[Mode.ORBIT].circle
        assert hypot(circle.centre_ned[0] - rig.pos[0], circle.centre_ned[1] - rig.pos[1]) < 50.0

    def test_a_takeoff_height_given_up_is_not_climbed_to_by_the_next_takeoff(self):
        rig = Kinematic().ready()
        rig.fc.request(TakeOff(ORIGIN.alt_m + 60.0, nan))
        rig.fc.arm(force=False)
        rig.run(5.0)
        rig.fc.request(ChangeMode(Mode.LAND))
        rig.disarmed(60.0)
        rig.fc.request(ChangeMode(Mode.TAKEOFF))
        rig.run(1.0)
        assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED
        rig.run_until(lambda: rig.state.mode is Mode.HOLD, 60.0)
        assert -rig.pos[2] < 10.0


class TestLowHover:
    def test_a_hover_close_above_the_ground_goes_on(self):
        rig = Kinematic().ready()
        rig.fc.request(position_setpoint(0.0, 0.0, -0.35))
        assert rig.fc.request(ChangeMode(Mode.OFFBOARD)).verdict is Verdict.ACCEPTED
        assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED
        for _ in range(round(20.0 / DT_S)):
            rig.fc.request(position_setpoint(0.0, 0.0, -0.35))
            rig.frame()
        assert rig.state.is_armed
        assert -rig.pos[2] > 0.2


class TestLandingGoesOn:
    def descending(self):
        rig = Kinematic(COM_LOW_BAT_ACT=3).flying(20.0)
        rig.fc.lists.load(ListKind.MISSION, [item(0, WAYPOINT, 30.0), item(1, LAND, 30.0, height=0.0)])
        rig.fc.request(ChangeMode(Mode.MISSION))
        rig.run_until(lambda: rig.fc.navigator.is_landing and -rig.pos[2] < 4.0, 120.0)
        return rig

    def test_a_critical_battery_does_not_call_a_landing_mission_back_up(self):
        rig = self.descending()
        rig.fc.commander.guard.act(BATTERY_CRITICAL)
        assert rig.state.mode is Mode.MISSION
        rig.disarmed(30.0)
        assert abs(rig.pos[0] - 30.0) < 3.0

    def test_an_emergency_ends_the_way_to_a_landing_place(self):
        rig = Kinematic(COM_LOW_BAT_ACT=3).flying(10.0)
        lat, lon, _ = position(2000.0, 0.0)
        rig.fc.request(LandAt(lat, lon, nan))
        rig.run(5.0)
        rig.fc.commander.guard.act(BATTERY_EMERGENCY)
        rig.disarmed(60.0)
        assert rig.pos[0] < 200.0


class TestReturnByMission:
    def home_by_mission(self):
        rig = Kinematic(RTL_TYPE=1).flying(20.0)
        items = [item(0, WAYPOINT, 60.0), do(1, LAND_START), item(2, WAYPOINT, 50.0), item(3, LAND, 40.0, height=0.0)]
        assert rig.fc.lists.load(ListKind.MISSION, items) is None
        rig.fc.request(ChangeMode(Mode.RETURN))
        return rig

    def test_a_return_whose_mission_is_taken_away_goes_home(self):
        rig = self.home_by_mission()
        rig.run_until(lambda: rig.state.mission_state == MissionState.ACTIVE, 200.0)
        assert rig.state.mode is Mode.RETURN
        assert rig.fc.lists.load(ListKind.MISSION, []) is None
        rig.disarmed(200.0)

    def test_a_return_to_a_mission_taken_away_on_the_way_goes_home(self):
        rig = self.home_by_mission()
        rig.run(2.0)
        assert rig.fc.lists.load(ListKind.MISSION, []) is None
        rig.disarmed(200.0)

    def test_a_return_that_has_landed_by_the_mission_does_not_take_off_again(self):
        rig = Kinematic(RTL_TYPE=1, COM_DISARM_LAND=5.0).flying(20.0)
        items = [
            do(0, LAND_START), item(1, WAYPOINT, 30.0), item(2, LAND, 30.0, height=0.0), item(3, TAKEOFF, 30.0),
            item(4, WAYPOINT, 90.0),
        ]  # fmt: skip
        assert rig.fc.lists.load(ListKind.MISSION, items) is None
        rig.fc.request(ChangeMode(Mode.RETURN))
        rig.disarmed(200.0)
        assert abs(rig.pos[0] - 30.0) < 3.0


class TestHoldAgain:
    def test_a_fence_that_asks_to_hold_stops_a_goto(self):
        rig = Kinematic(GF_ACTION=2).flying(10.0)
        rig.fc.request(GoTo(*position(300.0, 0.0), nan, nan))
        rig.run(5.0)
        fence = [item(0, INCLUSION_CIRCLE, params=(60.0, 0.0, 0.0, 0.0), frame=0)]
        assert rig.fc.lists.load(ListKind.FENCE, fence) is None
        rig.run(60.0)
        assert rig.pos[0] < 90.0


class TestPrecisionLandingFromTheGround:
    def test_it_climbs_before_it_goes_to_a_target_beside(self):
        rig = Kinematic().flying(10.0)
        rig.fc.request(ChangeMode(Mode.LAND))
        rig.run_until(lambda: -rig.pos[2] < 0.3)
        rig.fc.request(LandingTargetReport((8.0, 0.0, 0.0)))
        assert rig.fc.request(ChangeMode(Mode.PRECISION_LAND)).verdict is Verdict.ACCEPTED
        highest = 0.0
        for _ in range(round(60.0 / DT_S)):
            rig.fc.request(LandingTargetReport((8.0, 0.0, 0.0)))
            rig.frame()
            highest = max(highest, -rig.pos[2])
        assert highest > 0.6
        assert not rig.state.is_armed
        assert abs(rig.pos[0] - 8.0) < 0.5


class TestPrecisionLandingWithoutPosition:
    def test_it_lands_blind(self):
        rig = Kinematic().flying(10.0)
        rig.fc.request(LandingTargetReport((0.0, 0.0, 0.0)))
        rig.fc.request(ChangeMode(Mode.PRECISION_LAND))
        rig.run(0.5)
        rig.flags &= ~(POSITION_VALID | VELOCITY_VALID)
        rig.disarmed(90.0)


class TestOrbitNearTheGround:
    def test_an_orbit_on_or_below_the_ground_is_refused(self):
        rig = Kinematic().flying()
        for height in (0.5, -20.0):
            reply = rig.fc.request(OrbitRequest(20.0, 3.0, alt_amsl_m=ORIGIN.alt_m + height))
            assert reply.verdict is Verdict.DENIED
            assert "above the ground" in reply.reason

    def test_an_orbit_begun_close_to_the_ground_climbs_first(self):
        rig = Kinematic().flying()
        rig.fc.request(ChangeMode(Mode.LAND))
        rig.run_until(lambda: -rig.pos[2] < 0.4)
        assert rig.fc.request(ChangeMode(Mode.ORBIT)).verdict is Verdict.ACCEPTED
        start = rig.pos[:2].copy()
        rig.run_until(lambda: -rig.pos[2] > 0.48, 20.0)
        assert hypot(*(rig.pos[:2] - start)) < 0.2
        rig.run(20.0)
        assert hypot(*(rig.pos[:2] - start)) > 1.0

    def test_a_pilot_cannot_push_an_orbit_into_the_ground(self):
        rig = Kinematic().flying(5.0)
        assert rig.fc.request(OrbitRequest(20.0, 3.0)).verdict is Verdict.ACCEPTED
        rig.run(20.0)
        rig.piloted(30.0, throttle=-1.0)
        assert rig.state.mode is Mode.ORBIT
        assert -rig.pos[2] > 0.7


class TestArmingIntoAFailsafe:
    def test_a_ground_station_that_is_lost_forbids_arming_where_its_loss_has_an_action(self):
        rig = Kinematic(NAV_DLL_ACT=2).ready()
        assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED  # there has never been one
        assert rig.fc.disarm(force=False).verdict is Verdict.ACCEPTED
        rig.fc.station.heard(rig.time_us)
        rig.run(15.0)
        reply = rig.fc.arm(force=False)
        assert (reply.verdict, reply.reason) == (Verdict.TEMPORARILY_REJECTED, "ground station lost")
        rig.fc.station.heard(rig.time_us)
        assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED


class TestArmedInTheAir:
    def test_motors_started_again_in_a_fall_leave_home_where_it_was_and_catch_the_vehicle(self):
        rig = Kinematic().flying(40.0)
        home, home_ned, stand_ned = rig.state.home, rig.state.home_ned, rig.state.stand_ned
        assert rig.fc.disarm(force=True).verdict is Verdict.ACCEPTED
        rig.run(0.5)
        assert rig.fc.arm(force=True).verdict is Verdict.ACCEPTED
        assert (rig.state.home, rig.state.home_ned, rig.state.stand_ned) == (home, home_ned, stand_ned)
        rig.run(15.0)
        assert rig.state.is_armed
        assert -rig.pos[2] > 20.0
        assert rig.fc.request(ChangeMode(Mode.RETURN)).verdict is Verdict.ACCEPTED
        rig.disarmed(200.0)


class TestHome:
    def test_home_is_not_set_where_no_return_could_lead(self):
        rig = Kinematic().flying()
        lat, lon, alt = position(60_000.0, 0.0)
        assert rig.fc.request(SetHome(lat, lon, alt)).verdict is Verdict.DENIED
        lat, lon, _ = position(10.0, 0.0)
        assert rig.fc.request(SetHome(lat, lon, ORIGIN.alt_m + 20_000.0)).verdict is Verdict.DENIED


class TestOtherTables:
    """Classes of vehicles whose modes take other requests than the multirotor's."""

    def test_what_no_mode_takes_is_refused_and_changes_nothing(self):
        specs = MULTIROTOR.modes.values()
        modes = mode_table(*(replace(spec, takes=tuple({*spec.takes} - {GoTo})) for spec in specs))
        rig = Kinematic(replace(MULTIROTOR, modes=modes)).flying()
        rig.fc.request(ChangeMode(Mode.GUIDED))
        reply = rig.fc.request(GoTo(*position(30.0, 0.0)))
        assert (reply.verdict, reply.reason) == (Verdict.UNSUPPORTED, "no mode of this vehicle does that")
        assert rig.state.mode is Mode.GUIDED

    def test_a_report_reaches_an_object_that_flies_two_modes_once(self, monkeypatch):
        follow = MULTIROTOR.modes[Mode.FOLLOW]
        twin = replace(MULTIROTOR.modes[Mode.BRAKE], build=follow.build, takes=follow.takes)
        modes = mode_table(*({**MULTIROTOR.modes, Mode.BRAKE: twin}).values())
        rig, taken = Kinematic(replace(MULTIROTOR, modes=modes)).ready(), []
        monkeypatch.setattr(Follow, "take", lambda _, report: taken.append(report))
        rig.fc.request(TargetReport((10.0, 0.0, 0.0), None, 1.0, 1.0))
        assert len(taken) == 1

    def test_shared_modes_move_within_the_limits_that_the_class_names(self):
        limits = replace(MULTIROTOR.limits, speed_max="MPC_LAND_SPEED")  # 0.7 m/s
        rig = Kinematic(replace(MULTIROTOR, limits=limits)).flying()
        reply = rig.fc.request(OrbitRequest(radius_m=20.0, speed_m_s=5.0))
        assert reply.reason == "5.0 m/s is too fast for this circle: 0.7 m/s at most"
