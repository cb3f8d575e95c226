"""Taking over, lost sticks, arming by sticks and the mode switch, over the kinematic stand-in."""

from math import nan

import pytest

from autopilot.interface.client_requests import ChangeMode, TakeOff
from autopilot.interface.item_lists import ListKind
from autopilot.interface.vehicle_state import LandedState, Mode, Verdict
from autopilot.ports import POSITION_VALID, VELOCITY_VALID
from tests.unit.autopilot.kinematic import ORIGIN, Kinematic, item, position_setpoint

WAYPOINT = 16
STICK_MODES = [Mode.STABILIZED, Mode.ACRO, Mode.ALTITUDE, Mode.POSITION]
AUTO_MODES = [Mode.HOLD, Mode.MISSION, Mode.RETURN, Mode.LAND]


def in_mode(mode, **params):
    """In the air with a pilot, in a mode."""
    rig = Kinematic(**params)
    if mode is Mode.MISSION:
        rig.fc.lists.load(ListKind.MISSION, [item(i, WAYPOINT, 500.0 * (i + 1), 0.0, 20.0) for i in range(2)])
    rig.flying(20.0)
    rig.piloted(0.2)
    if mode is Mode.OFFBOARD:
        rig.fc.request(position_setpoint(0.0, 0.0, -20.0))
    if mode is not rig.state.mode:
        assert rig.fc.request(ChangeMode(mode)).verdict is Verdict.ACCEPTED
    rig.piloted(0.5)
    assert rig.state.mode is mode
    return rig


def lose(rig, seconds=6.0):
    """Without sticks, until COM_FAIL_ACT_T is over."""
    for _ in range(round(seconds / 0.02)):
        if rig.state.mode is Mode.OFFBOARD:
            rig.fc.request(position_setpoint(0.0, 0.0, -20.0))
        rig.frame()


@pytest.mark.parametrize("mode", [*STICK_MODES, Mode.HOLD, Mode.MISSION, Mode.OFFBOARD])
@pytest.mark.parametrize(("action", "expected"), [(1, Mode.HOLD), (2, Mode.RETURN), (3, Mode.LAND)])
def test_lost_sticks_do_what_the_parameter_says(mode, action, expected):
    rig = in_mode(mode, NAV_RCL_ACT=action)
    lose(rig)
    assert rig.state.mode is expected
    assert rig.recorder.has_text("Sticks lost")
    assert rig.state.is_failsafe


def test_lost_sticks_are_waited_for_in_hold_before_they_lead_home():
    rig = in_mode(Mode.POSITION)
    lose(rig, 5.3)  # 0.5 s until they are lost, and 5 s
    assert rig.state.mode is Mode.HOLD
    assert rig.recorder.has_text("Sticks lost: hold")
    lose(rig, 0.4)
    assert rig.state.mode is Mode.RETURN
    assert rig.recorder.has_text("Sticks lost: return")


def test_the_wait_for_sticks_is_a_parameter():
    rig = in_mode(Mode.POSITION, COM_FAIL_ACT_T=0.0)
    lose(rig, 0.7)
    assert rig.state.mode is Mode.RETURN


def test_sticks_that_come_back_in_time_are_no_failsafe():
    rig = in_mode(Mode.POSITION)
    lose(rig, 3.0)
    rig.piloted(6.0)
    assert rig.state.mode is Mode.HOLD
    assert not rig.recorder.has_text("Sticks lost: return")


def test_a_mode_chosen_while_the_sticks_are_waited_for_is_flown():
    rig = in_mode(Mode.POSITION)
    lose(rig, 3.0)
    assert rig.fc.request(ChangeMode(Mode.LAND)).verdict is Verdict.ACCEPTED
    lose(rig, 6.0)
    assert rig.state.mode is Mode.LAND


@pytest.mark.parametrize("mode", STICK_MODES)
def test_a_mode_flown_by_sticks_returns_without_them_even_if_no_action_is_chosen(mode):
    rig = in_mode(mode, NAV_RCL_ACT=0)
    lose(rig)
    assert rig.state.mode is Mode.RETURN


@pytest.mark.parametrize("mode", [Mode.HOLD, Mode.MISSION, Mode.OFFBOARD])
def test_other_modes_go_on_if_no_action_is_chosen(mode):
    rig = in_mode(mode, NAV_RCL_ACT=0)
    lose(rig)
    assert rig.state.mode is mode
    assert rig.recorder.has_text("Sticks lost")


@pytest.mark.parametrize(("mode", "bit"), [(Mode.MISSION, 1), (Mode.HOLD, 2), (Mode.OFFBOARD, 4)])
def test_excepted_modes_go_on_without_sticks(mode, bit):
    rig = in_mode(mode, COM_RCL_EXCEPT=bit)
    lose(rig)
    assert rig.state.mode is mode
    rig = in_mode(mode, COM_RCL_EXCEPT=7 - bit)
    lose(rig)
    assert rig.state.mode is Mode.RETURN


def test_disarm_action_stops_the_motors():
    rig = in_mode(Mode.POSITION, NAV_RCL_ACT=6)
    lose(rig)
    assert not rig.state.is_armed


def test_without_a_position_lost_sticks_end_in_a_landing():
    rig = in_mode(Mode.ALTITUDE)
    rig.flags &= ~(POSITION_VALID | VELOCITY_VALID)
    rig.piloted(2.0)
    assert rig.state.mode is Mode.ALTITUDE
    lose(rig)
    assert rig.state.mode is Mode.LAND


def test_sticks_that_come_back_do_not_change_the_mode_back():
    rig = in_mode(Mode.POSITION)
    lose(rig)
    rig.piloted(2.0)
    assert rig.state.mode is Mode.RETURN
    assert rig.recorder.has_text("Sticks are back")


def test_a_failure_of_the_radio_is_a_loss():
    rig = in_mode(Mode.POSITION)
    rig.fc.sticks.is_cut = True
    rig.piloted(6.0)
    assert rig.state.mode is Mode.RETURN


def test_a_vehicle_that_never_had_sticks_does_not_miss_them():
    rig = Kinematic().flying()
    rig.run(10.0)
    assert rig.state.mode is Mode.HOLD
    assert not rig.recorder.has_text("Sticks")


def test_sticks_that_were_lost_before_arming_are_not_missed():
    rig = Kinematic().ready()
    rig.piloted(0.5)
    rig.run(2.0)
    rig.flying()
    rig.run(5.0)
    assert rig.state.mode is Mode.HOLD


def test_one_stick_message_before_arming_makes_sticks_not_compulsory():
    rig = Kinematic().ready()
    rig.pilot()
    assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED
    rig.frame()
    assert rig.fc.request(TakeOff(ORIGIN.alt_m + 5.0, nan)).verdict is Verdict.ACCEPTED
    rig.run(8.0)
    assert rig.state.landed_state is LandedState.IN_AIR
    assert not rig.recorder.has_text("Sticks lost")
    rig.pilot()
    rig.frame()
    assert rig.fc.request(ChangeMode(Mode.POSITION)).verdict is Verdict.ACCEPTED
    lose(rig)
    assert rig.state.mode is Mode.RETURN  # now they are missed


def test_a_vehicle_armed_in_a_mode_flown_by_sticks_misses_them_at_once():
    rig = Kinematic().ready()
    rig.pilot(throttle=-1.0)
    rig.fc.request(ChangeMode(Mode.POSITION))
    assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED
    rig.run(1.0)
    assert rig.recorder.has_text("Sticks lost")
    assert rig.state.is_armed
    rig.run(5.0)
    assert not rig.state.is_armed


@pytest.mark.parametrize("mode", AUTO_MODES)
def test_moving_a_stick_takes_over_from_auto_modes(mode):
    rig = in_mode(mode)
    rig.piloted(0.2, roll=0.3)
    assert rig.state.mode is Mode.POSITION
    assert rig.recorder.has_text("Pilot took over")


def test_sticks_that_rest_somewhere_do_not_take_over():
    rig = Kinematic().flying()
    rig.piloted(5.0, throttle=-1.0)
    assert rig.state.mode is Mode.HOLD


@pytest.mark.parametrize(("bits", "expected"), [(1, Mode.OFFBOARD), (2, Mode.POSITION)])
def test_offboard_is_left_only_if_its_bit_is_set(bits, expected):
    rig = in_mode(Mode.OFFBOARD, COM_RC_OVERRIDE=bits)
    rig.piloted(0.2, yaw=0.5)
    assert rig.state.mode is expected


def test_taking_over_can_be_switched_off():
    rig = in_mode(Mode.HOLD, COM_RC_OVERRIDE=0)
    rig.piloted(1.0, roll=1.0)
    assert rig.state.mode is Mode.HOLD


def test_without_a_position_taking_over_ends_in_altitude_mode():
    rig = in_mode(Mode.LAND)
    rig.flags &= ~(POSITION_VALID | VELOCITY_VALID)
    rig.piloted(1.0)
    rig.piloted(0.2, roll=0.5)
    assert rig.state.mode is Mode.ALTITUDE


def test_a_pilot_flies_on_in_altitude_mode_when_the_position_is_lost():
    rig = in_mode(Mode.POSITION)
    rig.flags &= ~(POSITION_VALID | VELOCITY_VALID)
    rig.piloted(1.0)
    assert rig.state.mode is Mode.ALTITUDE


def test_throttle_down_and_yaw_right_arms_and_yaw_left_disarms():
    rig = Kinematic().ready()
    rig.piloted(0.2, throttle=-1.0)
    rig.fc.request(ChangeMode(Mode.POSITION))
    rig.piloted(0.9, throttle=-1.0, yaw=1.0)
    assert not rig.state.is_armed
    rig.piloted(0.3, throttle=-1.0, yaw=1.0)
    assert rig.state.is_armed
    rig.piloted(1.2, throttle=-1.0, yaw=-1.0)
    assert not rig.state.is_armed


def test_the_gesture_arms_only_in_a_mode_flown_by_sticks():
    rig = Kinematic().ready()
    rig.piloted(1.5, throttle=-1.0, yaw=1.0)
    assert not rig.state.is_armed
    assert rig.recorder.has_text("Arm: not in a mode flown by sticks")


def test_the_gesture_arms_in_hold_where_the_sticks_steer_it():
    rig = Kinematic().ready()
    rig.fc.follow_ardupilot()
    rig.piloted(1.5, throttle=-1.0, yaw=1.0)
    assert rig.state.is_armed


def test_letting_the_channels_go_does_not_take_over():
    rig = Kinematic(COM_RC_IN_MODE=0, NAV_RCL_ACT=0).flying(20.0)

    def override(roll_us):
        rig.fc.sticks.channels_overridden((255, 190), rig.time_us, (roll_us,))
        rig.frame()

    override(1500)
    assert rig.fc.request(ChangeMode(Mode.POSITION)).verdict is Verdict.ACCEPTED
    override(1900)
    assert rig.fc.request(ChangeMode(Mode.HOLD)).verdict is Verdict.ACCEPTED
    override(0)
    assert rig.state.mode is Mode.HOLD


def test_the_gesture_does_not_disarm_in_the_air():
    rig = in_mode(Mode.POSITION)
    rig.piloted(1.5, throttle=-1.0, yaw=-1.0)
    assert rig.state.is_armed
    assert rig.state.landed_state is LandedState.IN_AIR


def test_the_gesture_can_be_switched_off():
    rig = Kinematic(MAN_ARM_GESTURE=0).ready()
    rig.piloted(0.2, throttle=-1.0)
    rig.fc.request(ChangeMode(Mode.POSITION))
    rig.piloted(1.5, throttle=-1.0, yaw=1.0)
    assert not rig.state.is_armed


def test_the_mode_switch_chooses_the_mode_when_it_moves():
    rig = Kinematic(COM_RC_IN_MODE=0, RC_MAP_FLTMODE=5, COM_FLTMODE1=2, COM_FLTMODE6=5, COM_RC_OVERRIDE=0)
    rig.flying(20.0)
    middle = (1500, 1500, 1500, 1500)

    def switch(pulse_us):
        rig.fc.sticks.channels_overridden((255, 190), rig.time_us, (*middle, pulse_us))
        rig.run(0.1)

    switch(1000)
    assert rig.state.mode is Mode.POSITION
    switch(1500)  # COM_FLTMODE4 is not assigned
    assert rig.state.mode is Mode.POSITION
    switch(2000)
    assert rig.state.mode is Mode.RETURN
    assert rig.fc.request(TakeOff(ORIGIN.alt_m + 30.0, 0.0)).verdict is Verdict.ACCEPTED
    switch(2000)  # it has not moved
    assert rig.state.mode is Mode.TAKEOFF
