"""Failsafes: what each failure does, and that a stronger action is never replaced by a weaker one."""

import pytest

from autopilot.interface.client_requests import ChangeMode, GoTo, StartMission
from autopilot.interface.item_lists import ListKind
from autopilot.interface.vehicle_state import BatteryLevel, LandedState, Mode, Severity, Verdict
from autopilot.navigator.mission.mission import MissionState
from autopilot.ports import DEAD_RECKONING, POSITION_VALID, WIND_VALID
from tests.unit.autopilot.kinematic import Kinematic, geo, item

NAN = float("nan")


def drain_to(rig, fraction):
    """Sets the charge the estimator believes in."""
    rig.fc.commander._battery.remaining = fraction
    rig.battery_v = 0.0  # no more voltage samples


def flying_away(**params):
    rig = Kinematic(**params).flying()
    rig.fc.request(GoTo(*geo(60.0, 0.0, 10.0), NAN, NAN))
    rig.run(20.0)
    return rig


@pytest.mark.parametrize(
    ("action", "fraction", "mode", "severity"),
    [
        (3, 0.10, Mode.HOLD, Severity.WARNING),
        (3, 0.06, Mode.RETURN, Severity.CRITICAL),
        (3, 0.04, Mode.LAND, Severity.EMERGENCY),
        (2, 0.06, Mode.LAND, Severity.CRITICAL),
        (1, 0.04, Mode.HOLD, Severity.EMERGENCY),
    ],
)
def test_battery_levels_lead_to_their_actions(action, fraction, mode, severity):
    rig = flying_away(COM_LOW_BAT_ACT=action)
    drain_to(rig, fraction)
    rig.run(0.1)
    assert rig.state.mode is mode
    assert any(level is severity and "attery" in text for level, text in rig.recorder.texts)


def test_emergency_replaces_return_by_landing_but_not_the_other_way_round():
    rig = flying_away()
    drain_to(rig, 0.06)
    rig.run(1.0)
    assert rig.state.mode is Mode.RETURN
    drain_to(rig, 0.04)
    rig.run(0.1)
    assert rig.state.mode is Mode.LAND
    drain_to(rig, 0.06)
    rig.run(0.1)
    assert rig.state.mode is Mode.LAND


def test_pilot_may_take_over_from_a_failsafe():
    rig = flying_away()
    drain_to(rig, 0.06)
    rig.run(0.5)
    assert rig.state.is_failsafe
    assert rig.fc.request(ChangeMode(Mode.HOLD)).verdict is Verdict.ACCEPTED
    rig.run(2.0)
    assert rig.state.mode is Mode.HOLD
    assert not rig.state.is_failsafe


def test_a_pilot_who_takes_over_in_the_same_mode_is_told_of_by_a_heartbeat_at_once():
    rig = flying_away()
    rig.flags &= ~POSITION_VALID
    rig.run(1.0)
    assert (rig.state.mode, rig.state.is_failsafe) == (Mode.LAND, True)
    count = rig.recorder.heartbeats
    assert rig.fc.request(ChangeMode(Mode.LAND)).verdict is Verdict.ACCEPTED
    assert not rig.state.is_failsafe
    assert rig.recorder.heartbeats > count


def test_critical_battery_without_position_lands():
    rig = flying_away()
    rig.flags &= ~POSITION_VALID
    drain_to(rig, 0.06)
    rig.run(1.0)
    assert rig.state.mode is Mode.LAND


def test_short_loss_of_position_changes_nothing():
    rig = flying_away()
    flags = rig.flags
    rig.flags &= ~POSITION_VALID
    rig.run(0.4)
    rig.flags = flags
    rig.run(2.0)
    assert rig.state.mode is Mode.HOLD
    assert not rig.state.is_failsafe


def test_position_lost_on_the_ground_disarms_instead_of_flying():
    rig = Kinematic().ready()
    rig.fc.arm(force=False)
    rig.flags &= ~POSITION_VALID
    rig.run(1.0)
    assert not rig.state.is_armed


def test_position_modes_are_refused_while_it_is_lost():
    rig = flying_away()
    rig.flags &= ~POSITION_VALID
    rig.run(1.0)
    assert rig.fc.request(ChangeMode(Mode.HOLD)).reason == "no valid position"
    assert rig.fc.request(ChangeMode(Mode.RETURN)).reason == "no valid position"


def test_silent_battery_sensor_is_told_once_and_its_charge_still_falls():
    rig = flying_away()
    rig.battery_v = 0.0
    before = rig.state.battery_remaining
    rig.run(60.0)
    assert sum("sensor silent" in text for _, text in rig.recorder.texts) == 1
    assert rig.state.battery_remaining < before - 0.02


def test_mission_that_a_failsafe_ended_is_not_complete():
    rig = Kinematic().flying()
    rig.fc.lists.load(ListKind.MISSION, [item(0, 16, 50.0), item(1, 21, 50.0)])
    rig.fc.request(StartMission(0))
    rig.run(2.0)
    drain_to(rig, 0.04)
    rig.disarmed()
    assert rig.recorder.reached == []
    assert rig.state.mission_state == MissionState.PAUSED


@pytest.mark.parametrize(("jump_m", "is_reported"), [(5.2, True), (0.2, False)])
def test_jump_of_the_position_is_told(jump_m, is_reported):
    rig = Kinematic().flying()
    rig.estimate["pos_reset_ned"] = (0.0, jump_m, 0.0)
    rig.estimate["reset_count"] += 1
    rig.run(1.0)
    assert rig.recorder.has_text(f"position reset by {jump_m} m") == is_reported


STATION_LOSS_S = 5.0


def with_station(action, loss_s=STATION_LOSS_S, **params):
    """A vehicle on its way, whose ground station has just sent its last heartbeat."""
    rig = flying_away(NAV_DLL_ACT=action, COM_DL_LOSS_T=loss_s, **params)
    rig.fc.station.heard(rig.time_us)
    return rig


@pytest.mark.parametrize(
    ("action", "mode", "is_failsafe"),
    [
        (0, Mode.HOLD, False),
        (1, Mode.HOLD, True),
        (2, Mode.RETURN, True),
        (3, Mode.LAND, True),
        (5, Mode.TERMINATION, True),
    ],
)
def test_loss_of_the_ground_station_leads_to_the_action_of_nav_dll_act(action, mode, is_failsafe):
    rig = with_station(action)
    rig.run(STATION_LOSS_S - 0.1)
    assert rig.state.mode is Mode.HOLD
    assert not rig.recorder.has_text("Ground station lost")
    rig.run(0.5)
    assert rig.state.mode is mode
    assert rig.state.is_failsafe == is_failsafe
    assert rig.recorder.has_text("Ground station lost")


def test_loss_of_the_ground_station_can_disarm():
    rig = with_station(6)
    rig.run(STATION_LOSS_S + 0.5)
    assert not rig.state.is_armed


@pytest.mark.parametrize("loss_s", [5.0, 10.0])
def test_ground_station_is_lost_after_its_time(loss_s):
    rig = with_station(2, loss_s)
    assert rig.run_until(lambda: rig.state.mode is Mode.RETURN) == pytest.approx(loss_s, abs=0.25)


def test_ground_station_that_comes_back_does_not_change_the_mode():
    rig = with_station(2)
    rig.run(STATION_LOSS_S + 1.0)
    rig.fc.station.heard(rig.time_us)
    rig.run(1.0)
    assert rig.recorder.has_text("Ground station is back")
    assert rig.state.mode is Mode.RETURN
    assert rig.fc.request(ChangeMode(Mode.HOLD)).verdict is Verdict.ACCEPTED
    rig.run(STATION_LOSS_S + 1.0)  # lost again: acts again
    assert rig.state.mode is Mode.RETURN


def test_vehicle_that_never_heard_a_ground_station_flies_on():
    rig = flying_away(NAV_DLL_ACT=2, COM_DL_LOSS_T=5.0)
    rig.run(30.0)
    assert rig.state.mode is Mode.HOLD
    assert not rig.recorder.has_text("Ground station")


def test_pilot_may_take_over_while_the_ground_station_is_still_lost():
    rig = with_station(2)
    rig.run(STATION_LOSS_S + 1.0)
    assert rig.fc.request(ChangeMode(Mode.HOLD)).verdict is Verdict.ACCEPTED
    rig.run(10.0)
    assert rig.state.mode is Mode.HOLD


@pytest.mark.parametrize(("mode", "bits"), [(Mode.MISSION, 1), (Mode.HOLD, 2)])
def test_excepted_modes_go_on_without_a_ground_station(mode, bits):
    rig = with_station(2, COM_DLL_EXCEPT=bits)
    if mode is Mode.MISSION:
        rig.fc.lists.load(ListKind.MISSION, [item(0, 16, 200.0)])
        rig.fc.request(StartMission(0))
    rig.run(STATION_LOSS_S + 2.0)
    assert rig.state.mode is mode


@pytest.mark.parametrize(("mode", "action"), [(Mode.LAND, 2), (Mode.RETURN, 1), (Mode.LAND, 1)])
def test_weaker_action_does_not_end_a_return_or_a_landing(mode, action):
    rig = with_station(action)
    rig.fc.request(ChangeMode(mode))
    rig.run(STATION_LOSS_S + 1.0)
    assert rig.state.mode is mode


def test_ground_station_lost_on_the_ground_disarms():
    rig = Kinematic(NAV_DLL_ACT=2, COM_DL_LOSS_T=1.0).ready()
    rig.fc.station.heard(rig.time_us)
    rig.fc.arm(force=False)
    rig.run(2.0)
    assert not rig.state.is_armed


def test_return_without_a_position_becomes_a_landing():
    rig = with_station(2)
    rig.flags &= ~POSITION_VALID
    rig.run(STATION_LOSS_S + 1.0)
    assert rig.state.mode is Mode.LAND


@pytest.mark.parametrize(
    ("action", "mode"),
    [(0, Mode.HOLD), (1, Mode.HOLD), (3, Mode.RETURN), (5, Mode.LAND)],
)
def test_wind_above_its_limit_leads_to_its_action(action, mode):
    rig = flying_away(COM_WIND_MAX=12.0, COM_WIND_MAX_ACT=action, COM_WIND_WARN=8.0)
    rig.flags |= WIND_VALID
    rig.estimate["wind_ned"] = (6.0, 8.0, 0.0)
    rig.run(10.0)
    assert rig.recorder.has_text("Strong wind")
    assert rig.state.mode is Mode.HOLD
    rig.estimate["wind_ned"] = (9.0, 12.0, 0.0)
    rig.run(5.0)
    assert rig.state.mode is mode
    assert rig.recorder.has_text("Wind above its limit")
    rig.estimate["wind_ned"] = (0.0, 0.0, 0.0)
    rig.run(5.0)
    assert rig.recorder.has_text("Wind is below its limit again")


def test_wind_without_a_limit_or_a_valid_estimate_is_not_judged():
    rig = flying_away()
    rig.flags |= WIND_VALID
    rig.estimate["wind_ned"] = (20.0, 0.0, 0.0)
    rig.run(5.0)
    assert not rig.recorder.has_text("ind")
    rig = flying_away(COM_WIND_MAX=5.0, COM_WIND_MAX_ACT=3)
    rig.estimate["wind_ned"] = (20.0, 0.0, 0.0)
    rig.run(5.0)
    assert rig.state.mode is Mode.HOLD


def test_flight_time_is_told_and_then_ends_the_flight_at_home():
    rig = Kinematic(COM_FLT_TIME_MAX=60.0).flying()
    rig.fc.request(GoTo(*geo(60.0, 0.0, 10.0), NAN, NAN))
    rig.run_until(lambda: rig.recorder.has_text("Flight time is nearly over"), 60.0)
    assert rig.state.mode is Mode.HOLD
    rig.run_until(lambda: rig.state.mode is Mode.RETURN, 10.0)
    assert "flight time" in rig.fc.request(ChangeMode(Mode.HOLD)).reason
    assert rig.fc.request(ChangeMode(Mode.LAND)).verdict is Verdict.ACCEPTED
    rig.disarmed()
    rig.ready()  # the next flight has its own time


@pytest.mark.parametrize(("action", "mode"), [(0, Mode.HOLD), (3, Mode.LAND), (5, Mode.TERMINATION)])
def test_flight_time_has_an_action_of_its_own(action, mode):
    rig = Kinematic(COM_FLT_TIME_MAX=40.0, COM_FLT_TIME_ACT=action).flying()
    rig.run_until(lambda: rig.recorder.has_text("Flight time is over"), 60.0)
    rig.run(0.1)
    assert rig.state.mode is mode
    if action == 0:
        assert rig.fc.request(ChangeMode(Mode.RETURN)).verdict is Verdict.ACCEPTED
        assert rig.fc.request(ChangeMode(Mode.HOLD)).verdict is Verdict.ACCEPTED


@pytest.mark.parametrize(("action", "mode"), [(3, Mode.LAND), (5, Mode.TERMINATION)])
def test_lost_position_has_an_action_of_its_own(action, mode):
    rig = flying_away(COM_POS_LOST_ACT=action)
    rig.flags &= ~POSITION_VALID
    rig.run(1.0)
    assert rig.state.mode is mode


def test_dead_reckoning_is_told_and_so_is_its_end():
    rig = flying_away()
    rig.flags |= DEAD_RECKONING
    rig.run(1.0)
    assert rig.recorder.has_text("No position source: dead reckoning")
    rig.flags &= ~DEAD_RECKONING
    rig.run(4.0)
    assert rig.recorder.has_text("Position source is back")
    assert rig.state.mode is Mode.HOLD


def test_terminated_flight_stops_its_motors_and_disarms_once_it_is_down():
    rig = flying_away()
    assert rig.fc.terminate().verdict is Verdict.ACCEPTED
    rig.run(0.1)
    assert rig.state.mode is Mode.TERMINATION
    assert rig.state.is_armed
    assert not rig.sp("is_armed")
    assert rig.state.landed_state is not LandedState.ON_GROUND
    assert rig.fc.request(ChangeMode(Mode.HOLD)).reason == "the flight is terminated"
    fall_s = (2.0 * 10.0 / 9.81) ** 0.5
    assert rig.disarmed() < fall_s + 2.0
    assert rig.state.mode is Mode.HOLD


def test_termination_is_refused_on_the_ground_and_as_a_mode():
    rig = Kinematic().ready()
    assert rig.fc.terminate().reason == "not armed"
    rig = flying_away()
    assert "by command" in rig.fc.request(ChangeMode(Mode.TERMINATION)).reason
    assert rig.state.mode is Mode.HOLD


def test_charge_level_is_known_before_and_after_arming():
    rig = Kinematic().ready()
    assert rig.state.battery_level is BatteryLevel.OK
    for fraction, level in ((0.1, BatteryLevel.LOW), (0.06, BatteryLevel.CRITICAL), (0.04, BatteryLevel.EMERGENCY)):
        drain_to(rig, fraction)
        rig.run(0.1)
        assert rig.state.battery_level is level


def test_estimate_that_jumps_again_and_again_is_not_believed():
    rig = flying_away()
    rig.estimate["pos_reset_ned"] = (0.0, 10.0, 0.0)
    for count in range(1, 4):
        assert rig.state.mode is Mode.HOLD
        rig.estimate["reset_count"] = count
        rig.run(5.0)
    assert rig.recorder.has_text("Estimator failure: land")
    assert rig.state.mode is Mode.LAND


def test_estimator_failure_has_an_action_of_its_own():
    rig = flying_away(COM_EST_FAIL_ACT=0)
    rig.estimate["pos_reset_ned"] = (0.0, 10.0, 0.0)
    for count in range(1, 4):
        rig.estimate["reset_count"] = count
        rig.run(5.0)
    assert rig.recorder.has_text("Estimator failure")
    assert rig.state.mode is Mode.HOLD


def test_vehicle_that_holds_stays_where_it_is_when_the_estimate_jumps():
    rig = Kinematic().flying()
    before = rig.fc.navigator.modes[Mode.HOLD].target_ned
    rig.estimate["pos_reset_ned"] = (100.0, -50.0, 0.0)
    rig.estimate["reset_count"] += 1
    rig.frame()
    after = rig.fc.navigator.modes[Mode.HOLD].target_ned
    assert after == pytest.approx((before[0] + 100.0, before[1] - 50.0, before[2]))
    assert rig.sp("pos_ned")[:2] == pytest.approx(after[:2], abs=1e-3)
    rig.fc.request(GoTo(*geo(30.0, 0.0, 10.0), NAN, NAN))
    sent_to = rig.fc.navigator.modes[Mode.HOLD].target_ned
    rig.estimate["reset_count"] += 1
    rig.run(0.1)
    assert rig.fc.navigator.modes[Mode.HOLD].target_ned == sent_to


def test_lost_station_sends_the_vehicle_back_along_its_track_or_directly_where_none_is_known():
    for is_known, mode in ((True, Mode.SMART_RETURN), (False, Mode.RETURN)):
        rig = flying_away(NAV_DLL_ACT=7)
        if not is_known:
            rig.fc.navigator.crumbs.clear()
            rig.fc.navigator.crumbs.points = []
            rig.fc.navigator.crumbs._is_full = True
        rig.fc.station.heard(rig.time_us)
        rig.run(10.5)
        assert rig.state.mode is mode


def test_a_charge_estimate_that_wavers_does_not_take_control_from_the_pilot_again():
    rig = flying_away()
    drain_to(rig, 0.0695)
    rig.run(0.1)
    assert rig.state.mode is Mode.RETURN
    assert rig.fc.request(ChangeMode(Mode.HOLD)).verdict is Verdict.ACCEPTED
    for fraction in (0.0705, 0.0695, 0.0705, 0.0695):
        drain_to(rig, fraction)
        rig.run(0.1)
    assert rig.state.mode is Mode.HOLD
    assert sum("Battery critical" in text for _, text in rig.recorder.texts) == 1
