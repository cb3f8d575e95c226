"""Failsafes: what each failure does, and that a stronger action is never replaced by a weaker one."""

import pytest

from autopilot.navigator.mission import MissionState
from autopilot.ports import POSITION_VALID
from autopilot.vehicle import Mode, Severity, Verdict
from tests.unit.autopilot.kinematic import Kinematic, geo, item

NAN = float("nan")


def drain_to(rig, share):
    """Sets the charge the estimator believes in."""
    rig.fc.commander._battery.remaining = share
    rig.battery_v = 0.0  # no more voltage samples


def flying_away(**params):
    rig = Kinematic(**params).flying()
    rig.fc.reposition(*geo(60.0, 0.0, 10.0), NAN, NAN)
    rig.run(20.0)
    return rig


@pytest.mark.parametrize(
    ("action", "share", "mode", "severity"),
    [
        (3, 0.10, Mode.HOLD, Severity.WARNING),
        (3, 0.06, Mode.RETURN, Severity.CRITICAL),
        (3, 0.04, Mode.LAND, Severity.EMERGENCY),
        (2, 0.06, Mode.LAND, Severity.CRITICAL),
        (1, 0.04, Mode.HOLD, Severity.EMERGENCY),
    ],
)
def test_battery_levels_lead_to_their_actions(action, share, mode, severity):
    rig = flying_away(COM_LOW_BAT_ACT=action)
    drain_to(rig, share)
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
    assert rig.fc.set_mode(Mode.HOLD).verdict is Verdict.ACCEPTED
    rig.run(2.0)
    assert rig.state.mode is Mode.HOLD
    assert not rig.state.is_failsafe


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
    assert rig.fc.set_mode(Mode.HOLD).reason == "no valid position"
    assert rig.fc.set_mode(Mode.RETURN).reason == "no valid position"


def test_silent_battery_sensor_is_told_once_and_its_charge_still_falls():
    rig = flying_away()
    rig.battery_v = 0.0
    before = rig.state.battery_remaining
    rig.run(60.0)
    assert sum("sensor silent" in text for _, text in rig.recorder.texts) == 1
    assert rig.state.battery_remaining < before - 0.02


def test_mission_that_a_failsafe_ended_is_not_complete():
    rig = Kinematic().flying()
    rig.fc.load_mission([item(0, 16, 50.0), item(1, 21, 50.0)])
    rig.fc.start_mission(0)
    rig.run(2.0)
    drain_to(rig, 0.04)
    rig.disarmed()
    assert rig.recorder.reached == []
    assert rig.state.mission_state == MissionState.PAUSED


@pytest.mark.parametrize(("jump_m", "is_told"), [(5.2, True), (0.2, False)])
def test_jump_of_the_position_is_told(jump_m, is_told):
    rig = Kinematic().flying()
    rig.estimate["pos_reset_ned"] = (0.0, jump_m, 0.0)
    rig.estimate["reset_count"] += 1
    rig.run(1.0)
    assert rig.recorder.has_text(f"position reset by {jump_m} m") == is_told
