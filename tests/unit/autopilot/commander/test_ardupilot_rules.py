"""Modes by ArduPilot's rules, over the kinematic stand-in: on the ground, at arming, after a landing."""

import pytest

from autopilot.interface.client_requests import ChangeMode
from autopilot.interface.vehicle_state import LandedState, Mode, Verdict
from autopilot.ports import POSITION_VALID, VELOCITY_VALID
from tests.unit.autopilot.kinematic import Kinematic

STICK_MODES = [Mode.STABILIZED, Mode.ACRO, Mode.ALTITUDE, Mode.POSITION]
NOT_ARMABLE = [Mode.RETURN, Mode.LAND, Mode.ORBIT, Mode.BRAKE, Mode.FOLLOW]


def vehicle(**params):
    rig = Kinematic(**params)
    rig.fc.follow_ardupilot()
    return rig.ready()


@pytest.mark.parametrize("mode", [*STICK_MODES, *NOT_ARMABLE, Mode.HOLD, Mode.GUIDED])
def test_a_disarmed_vehicle_takes_any_mode_with_and_without_a_position(mode):
    rig = vehicle()
    assert rig.fc.request(ChangeMode(mode)).verdict is Verdict.ACCEPTED
    rig.run(2.0)
    assert rig.state.mode is mode
    rig.flags &= ~(POSITION_VALID | VELOCITY_VALID)
    rig.fc.request(ChangeMode(Mode.STABILIZED))
    rig.run(10.0)
    assert rig.fc.request(ChangeMode(mode)).verdict is Verdict.ACCEPTED


@pytest.mark.parametrize("mode", NOT_ARMABLE)
def test_arming_asks_for_a_mode_to_take_off_in(mode):
    rig = vehicle()
    rig.fc.request(ChangeMode(mode))
    rig.run(1.0)
    assert rig.state.is_ready_to_arm  # nothing else is wrong
    reply = rig.fc.arm(force=False)
    assert (reply.verdict, reply.reason) == (Verdict.TEMPORARILY_REJECTED, "Mode not armable")
    rig.fc.request(ChangeMode(Mode.GUIDED))
    assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED


@pytest.mark.parametrize("mode", NOT_ARMABLE)
def test_arming_by_force_in_such_a_mode_lifts_nothing(mode):
    rig = vehicle()
    rig.fc.request(ChangeMode(mode))
    assert rig.fc.arm(force=True).verdict is Verdict.ACCEPTED
    rig.run(30.0)
    assert not rig.state.is_armed
    assert rig.history == [LandedState.ON_GROUND]


@pytest.mark.parametrize("mode", STICK_MODES)
def test_an_untouched_radio_arms_and_lifts_nothing(mode):
    rig = vehicle()
    assert rig.fc.request(ChangeMode(mode)).verdict is Verdict.ACCEPTED
    assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED
    rig.run(30.0)
    assert not rig.state.is_armed
    assert rig.state.mode is mode
    assert rig.history == [LandedState.ON_GROUND]
    assert not rig.recorder.has_text("Sticks lost")


@pytest.mark.parametrize("mode", [Mode.LAND, Mode.RETURN])
def test_after_a_landing_the_mode_stays(mode):
    rig = vehicle().flying(10.0)
    assert rig.fc.request(ChangeMode(mode)).verdict is Verdict.ACCEPTED
    rig.run_until(lambda: not rig.state.is_armed)
    rig.run(5.0)
    assert rig.state.mode is mode
    assert rig.state.is_ready_to_arm


def test_a_smart_return_needs_a_track_on_the_ground_too():
    assert vehicle().fc.request(ChangeMode(Mode.SMART_RETURN)).verdict is Verdict.TEMPORARILY_REJECTED


def test_loiter_holds_beside_a_radio_that_nobody_touches():
    rig = vehicle().flying(20.0)
    rig.run(10.0)
    assert rig.fc.request(ChangeMode(Mode.HOLD)).verdict is Verdict.ACCEPTED
    rig.run(10.0)
    assert rig.pos[2] == pytest.approx(-20.0, abs=0.5)
    assert not rig.recorder.has_text("Sticks lost")


def test_a_radio_that_fails_brings_it_home():
    rig = vehicle(NAV_RCL_ACT=2).flying(20.0)
    rig.fc.sticks.is_cut = True
    rig.run(1.0)
    assert rig.state.mode is Mode.RETURN
    assert rig.recorder.has_text("Sticks lost: return")


def test_released_overrides_are_no_failure():
    rig = vehicle(NAV_RCL_ACT=2).flying(20.0)
    rig.fc.request(ChangeMode(Mode.HOLD))
    rig.piloted(2.0, pitch=1.0)
    rig.run(10.0)
    assert rig.state.mode is Mode.HOLD
    assert not rig.recorder.has_text("Sticks lost")
