"""Who moves the sticks, how channels are read, and when they are lost."""

import pytest

from autopilot.inputs.stick_params import STICK_PARAMETERS
from autopilot.inputs.sticks import CHANNELS, Sticks, curved, without_centre
from common.params import ParameterTable

PILOT, OTHER = (255, 190), (254, 190)
START_US = 1_000_000
LEAVE = None


def sticks_with(**params):
    table = ParameterTable(STICK_PARAMETERS)
    for name, value in params.items():
        table.set_exactly(name, value)
    return Sticks(table)


def joystick(sticks, now_us=START_US, sender=PILOT, roll=0.0, pitch=0.0, yaw=0.0, throttle=0.0):
    return sticks.joystick_moved(sender, now_us, (roll, pitch, yaw, throttle), 0)


def override(sticks, *pulses, now_us=START_US, sender=PILOT):
    return sticks.channels_overridden(sender, now_us, (*pulses, *([LEAVE] * (CHANNELS - len(pulses)))))


def test_nothing_is_heard_before_the_first_message():
    sticks = sticks_with()
    assert not sticks.is_heard(START_US)
    assert not sticks.is_lost(START_US)


def test_a_joystick_is_lost_after_its_time():
    sticks = sticks_with(COM_RC_LOSS_T=0.5)
    joystick(sticks)
    assert sticks.is_heard(START_US + 500_000)
    assert not sticks.is_heard(START_US + 500_001)
    assert sticks.is_lost(START_US + 500_001)


def test_overridden_channels_are_lost_after_theirs():
    sticks = sticks_with(COM_RC_IN_MODE=0)
    override(sticks, 1500, 1500, 1500, 1500)
    assert sticks.is_heard(START_US + 3_000_000)
    assert sticks.is_lost(START_US + 3_000_001)


def test_another_joystick_takes_over_only_when_the_first_is_silent():
    sticks = sticks_with()
    joystick(sticks, roll=0.3)
    joystick(sticks, START_US + 400_000, OTHER, roll=-1.0)
    assert sticks.input.roll == 0.3
    joystick(sticks, START_US + 600_000, OTHER, roll=-1.0)
    assert sticks.input.roll == -1.0
    joystick(sticks, START_US + 700_000, roll=0.3)
    assert sticks.input.roll == -1.0


@pytest.mark.parametrize(
    ("mode", "takes_joystick", "takes_channels"),
    [(0, False, True), (1, True, False), (2, True, True), (4, False, False)],
)
def test_in_mode_says_whose_sticks_count(mode, takes_joystick, takes_channels):
    sticks = sticks_with(COM_RC_IN_MODE=mode)
    refusal = joystick(sticks)
    assert sticks.is_heard(START_US) is takes_joystick
    assert bool(refusal) is not takes_joystick
    sticks = sticks_with(COM_RC_IN_MODE=mode)
    refusal = override(sticks, 1500)
    assert sticks.is_heard(START_US) is takes_channels
    assert bool(refusal) is not takes_channels


def test_the_kind_that_came_first_stays():
    sticks = sticks_with(COM_RC_IN_MODE=3)
    joystick(sticks)
    assert "radio" in override(sticks, 1500, now_us=START_US + 10_000_000)
    assert joystick(sticks, START_US + 10_000_000, OTHER) == ""
    assert sticks.is_heard(START_US + 10_000_000)


def test_an_axis_that_is_left_out_stays_where_it_was():
    sticks = sticks_with()
    joystick(sticks, roll=0.5, throttle=-1.0)
    sticks.joystick_moved(PILOT, START_US + 20_000, (None, 0.25, None, None), 0)
    now = sticks.input
    assert (now.roll, now.pitch, now.yaw, now.throttle) == (0.5, 0.25, 0.0, -1.0)


def test_channels_are_read_by_their_calibration():
    sticks = sticks_with(COM_RC_IN_MODE=0, RC1_MIN=1100, RC1_TRIM=1500, RC1_MAX=1900, RC1_DZ=0, RC4_REV=-1, RC4_DZ=0)
    override(sticks, 1700, 1505, 1000, 2000)
    now = sticks.input
    assert now.roll == pytest.approx(0.5)
    assert now.pitch == 0.0  # within its dead zone
    assert now.throttle == -1.0
    assert now.yaw == -1.0


def test_channels_follow_the_map():
    sticks = sticks_with(COM_RC_IN_MODE=0, RC_MAP_ROLL=7, RC_MAP_THROTTLE=0)
    override(sticks, 2000, 1500, 2000, 1500, 1500, 1500, 1000)
    assert sticks.input.roll == -1.0
    assert sticks.input.throttle == 0.0


def test_a_short_pulse_is_forward_in_ardupilot():
    sticks = sticks_with(COM_RC_IN_MODE=0)
    sticks.is_forward_low = True
    override(sticks, 1500, 1000, 1500, 1500)
    assert sticks.input.pitch == 1.0


def test_channels_that_are_left_out_stay_and_released_ones_rest_in_the_middle():
    sticks = sticks_with(COM_RC_IN_MODE=0)
    override(sticks, 2000, 2000, 1000, 1500)
    override(sticks, LEAVE, 0)
    assert (sticks.input.roll, sticks.input.pitch, sticks.input.throttle) == (1.0, 0.0, -1.0)


def test_a_switch_alone_is_no_pilot():
    sticks = sticks_with(COM_RC_IN_MODE=0)
    override(sticks, LEAVE, LEAVE, LEAVE, LEAVE, LEAVE, LEAVE, 1800)
    assert not sticks.is_heard(START_US)
    assert not sticks.is_lost(START_US + 10_000_000)
    assert sticks.switch_position(7, 3) == 3


def test_releasing_every_channel_leaves_no_pilot():
    sticks = sticks_with(COM_RC_IN_MODE=0)
    override(sticks, 1500, 1500)
    override(sticks, 0, 0)
    assert sticks.is_lost(START_US)


@pytest.mark.parametrize("value", [-1.0, -0.4, 0.0, 0.7, 1.0])
@pytest.mark.parametrize("is_forward_low", [False, True])
def test_a_joystick_is_shown_as_the_channels_that_would_mean_the_same(value, is_forward_low):
    sticks = sticks_with(RC2_MIN=1100, RC2_REV=-1)
    sticks.is_forward_low = is_forward_low
    joystick(sticks, roll=value, pitch=value, yaw=value, throttle=value)
    radio = sticks_with(COM_RC_IN_MODE=0, RC2_MIN=1100, RC2_REV=-1)
    radio.is_forward_low = is_forward_low
    override(radio, *sticks.input.channels[:4])
    now = radio.input
    assert (now.roll, now.pitch, now.yaw, now.throttle) == pytest.approx((value,) * 4, abs=0.002)


def test_a_failure_cuts_the_sticks_off():
    sticks = sticks_with()
    sticks.is_cut = True
    joystick(sticks)
    assert not sticks.is_heard(START_US)


def test_sticks_lost_before_can_be_forgotten_until_they_come_back():
    sticks = sticks_with()
    joystick(sticks)
    sticks.forget(START_US + 100_000)
    assert sticks.is_heard(START_US + 100_000)
    sticks.forget(START_US + 2_000_000)
    assert not sticks.is_lost(START_US + 2_000_000)
    joystick(sticks, START_US + 3_000_000)
    assert sticks.is_lost(START_US + 4_000_000)


RADIO = [1500, 1500, 1000, 1500, 1800, 1000, 1000, 1800]  # ArduPilot's SITL


def with_radio(**params):
    sticks = sticks_with(**params)
    sticks.follow_ardupilot()
    sticks.frame(START_US)
    return sticks


def test_a_radio_that_is_cut_right_after_it_was_released_is_lost_after_its_own_time():
    sticks = with_radio(COM_RC_LOSS_T=0.5)
    override(sticks, 1500, 1500, 1500, 1500)
    override(sticks, *([0] * CHANNELS))
    sticks.is_cut = True
    sticks.frame(START_US + 20_000)
    assert sticks.is_lost(START_US + 500_001)


def test_a_simulated_radio_is_heard_with_sticks_in_the_middle_and_throttle_down():
    sticks = with_radio()
    now = sticks.input
    assert sticks.is_heard(START_US)
    assert (now.roll, now.pitch, now.yaw, now.throttle) == (0.0, 0.0, 0.0, -1.0)
    assert now.channels[:8] == RADIO
    assert not now.has_pilot(START_US)
    assert not sticks_with().is_heard(START_US)  # in PX4's dialect there is none


@pytest.mark.parametrize("release", ["by the client", "by time", "joystick silent"])
def test_sticks_go_back_to_the_simulated_radio(release):
    sticks = with_radio()
    now_us = START_US
    if release == "joystick silent":
        joystick(sticks, roll=0.5, throttle=0.2)
    else:
        override(sticks, 1700, 1500, 1600, 1500, 1500, 2000)
    assert sticks.input.roll > 0.3
    assert sticks.input.has_pilot(now_us)
    if release == "by the client":
        override(sticks, 0, 0, 0, 0, 0, 0)
    else:
        now_us += 3_000_001
    sticks.frame(now_us)
    now = sticks.input
    assert now.channels[:8] == RADIO
    assert (now.roll, now.throttle) == (0.0, -1.0)
    assert sticks.is_heard(now_us)
    assert not sticks.is_lost(now_us)
    assert not now.has_pilot(now_us)


def test_channels_that_nobody_overrides_are_the_radios():
    sticks = with_radio()
    override(sticks, 0, 0, 1600)
    assert sticks.input.channels[:4] == [1500, 1500, 1600, 1500]
    assert sticks.input.has_pilot(START_US)
    override(sticks, LEAVE, LEAVE, 0, LEAVE, 1100)  # a switch is none
    assert sticks.input.channels[:5] == [1500, 1500, 1000, 1500, 1100]
    assert sticks.is_heard(START_US)
    assert not sticks.input.has_pilot(START_US)


def test_a_radio_that_is_cut_is_lost_and_comes_back():
    sticks = with_radio(COM_RC_LOSS_T=0.5)
    sticks.is_cut = True
    sticks.frame(START_US + 500_001)
    assert sticks.is_lost(START_US + 500_001)
    sticks.is_cut = False
    sticks.frame(START_US + 600_000)
    assert sticks.is_heard(START_US + 600_000)


def test_a_radio_cut_under_a_pilot_ends_his_sticks():
    sticks = with_radio()
    override(sticks, 1500, 1500, 1500, 1500)
    sticks.is_cut = True
    sticks.frame(START_US + 3_000_001)
    assert sticks.is_lost(START_US + 3_000_001)


def test_speed_is_that_of_the_fastest_stick_and_fades():
    sticks = sticks_with()
    joystick(sticks)
    joystick(sticks, START_US + 20_000, throttle=0.1)
    assert sticks.input.speed == pytest.approx(0.1 / 0.12)
    for i in range(2, 60):
        joystick(sticks, START_US + i * 20_000, throttle=0.1)
    assert sticks.input.speed < 0.01


def test_sticks_found_somewhere_else_after_a_silence_have_not_moved():
    sticks = sticks_with()
    joystick(sticks, throttle=-1.0)
    joystick(sticks, START_US + 5_000_000, throttle=1.0)
    assert sticks.input.speed == 0.0


def test_a_switch_has_positions_of_equal_width():
    sticks = sticks_with(COM_RC_IN_MODE=0)
    assert sticks.switch_position(5, 6) == 0
    positions = []
    for pulse_us in (1000, 1250, 1420, 1560, 1740, 2000):
        override(sticks, LEAVE, LEAVE, LEAVE, LEAVE, pulse_us)
        positions.append(sticks.switch_position(5, 6))
    assert positions == [1, 2, 3, 4, 5, 6]


def test_dead_zone_and_curve_keep_the_ends():
    assert without_centre(0.1, 0.1) == 0.0
    assert without_centre(-1.0, 0.1) == -1.0
    assert without_centre(0.55, 0.1) == pytest.approx(0.5)
    assert curved(1.0, 0.6, 0.7) == pytest.approx(1.0)
    assert curved(-0.5, 0.6) == pytest.approx(-(0.4 * 0.5 + 0.6 * 0.125))
    assert curved(0.5, 0.0, 0.7) == pytest.approx(0.5 * 0.3 / 0.65)
