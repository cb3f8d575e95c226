"""Betaflight's packets, its clock and its sticks, read by a stand-in that is as strict as it."""

import numpy as np
import pytest

from autopilot.ports import SETPOINT_ATTITUDE, SETPOINT_RATE
from bench.standins.betaflight import MOTORS, ItsClock, parse
from common.airframe import load_airframe
from common.attitude import quat_of_roll_pitch_yaw, rotated
from sim.boards import betaflight_msp as msp
from sim.boards.betaflight_sticks import AT_REST_US, RATE_LIMIT_DEG_S, Sticks, lean
from sim.boards.betaflight_wire import PeerClock, motor_commands, state_packet, sticks_packet
from sim.boards.outside import PeerError

LEVEL = (0.0, 0.0, 0.0, 1.0)


def test_a_state_is_read_as_it_is_felt():
    q = quat_of_roll_pitch_yaw(0.1, -0.2, 0.3)
    state = parse(state_packet(2.5, (0.1, 0.2, 0.3), (1.0, 2.0, -9.8), q, 101_325.0))
    assert state.stamp_s == 2.5
    assert state.gyro_frd == pytest.approx((0.1, 0.2, 0.3))
    assert state.accel_turned == pytest.approx((-1.0, 2.0, -9.8))  # it turns them over: forward, left, up
    assert state.wxyz == pytest.approx((q[3], q[0], q[1], q[2]))
    assert state.pressure_pa == 101_325.0


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_a_number_that_is_none_is_never_sent(bad):
    with pytest.raises(PeerError, match="not a number"):
        state_packet(1.0, (0.0, bad, 0.0), (0.0, 0.0, -9.8), LEVEL, 101_325.0)


def test_its_motors_become_ours():
    rear_right, front_right, rear_left, front_left = 1100.0, 1200.0, 1300.0, 1400.0
    data = MOTORS.pack(4, rear_right, front_right, rear_left, front_left, *(0.0,) * 12)
    assert motor_commands(data) == pytest.approx([0.2, 0.3, 0.4, 0.1])
    wild = MOTORS.pack(4, 0.0, 3000.0, 1500.0, 1000.0, *(0.0,) * 12)
    assert motor_commands(wild) == pytest.approx([1.0, 0.5, 0.0, 0.0])


def test_what_holds_no_motors_is_not_read():
    data = MOTORS.pack(4, *(1000.0,) * 16)
    assert motor_commands(data[:-1]) is None
    assert motor_commands(data + b"\0") is None
    assert motor_commands(b"") is None
    assert motor_commands(MOTORS.pack(4, float("nan"), *(1000.0,) * 15)) is None
    with pytest.raises(PeerError, match="6 motors"):
        motor_commands(MOTORS.pack(6, *(1000.0,) * 16))


def test_sticks_have_sixteen_channels():
    assert len(AT_REST_US) == 16
    assert len(sticks_packet(0.0, AT_REST_US)) == 40


def flown_clock(delays_s, work_s=0.7e-3, loops=2_000):
    """Its clock after so many states, each after some work of ours and on its way for a while; runs 1 ms for each."""
    ours, its = PeerClock(), ItsClock(1.0)
    now_s, rng = 1.0, np.random.default_rng(1)
    arrived_s, leap_s = now_s, 0.0
    ours.stamp_s(1.0, now_s)
    for _ in range(loops):
        for rate, pause_s in ((1.0, work_s), (0.0, 1e-3)):
            now_s += pause_s
            arrived_s = max(arrived_s, now_s + rng.choice(delays_s))
            before_s = its.time_s
            its.state(ours.stamp_s(rate, now_s), arrived_s)
            leap_s = max(leap_s, its.time_s - before_s)
    return its.time_s, leap_s, its.rate


def test_its_clock_runs_between_state_and_answer_alone():
    time_s, _, rate = flown_clock([0.0])
    assert time_s == pytest.approx(2_000 * 1e-3, rel=0.01)  # and not through our work
    assert rate < 1e-5


def test_its_clock_leaps_by_little_when_states_arrive_together():
    _, leap_s, _ = flown_clock([0.0, 0.0, 0.0, 0.69e-3])
    assert leap_s < 1.0  # of its 20 s until it takes its link for lost


def test_its_clock_goes_on_after_a_long_pause():
    ours, its = PeerClock(), ItsClock(0.0)
    now_s = 1.0
    for pause_s in (0.0, 1e-3, 1e-3, 30.0, 4e-3, 4e-3, 4e-3):
        now_s += pause_s
        its.state(ours.stamp_s(1.0, now_s), now_s)
    assert 0.2 < its.rate <= 1.0


@pytest.mark.parametrize("yaw", [-2.0, 0.0, 3.0])
@pytest.mark.parametrize(("roll", "pitch"), [(0.0, 0.0), (0.3, 0.0), (0.0, -0.4), (0.5, 0.25)])
def test_lean_points_the_thrust_where_it_shall_point(roll, pitch, yaw):
    wanted = quat_of_roll_pitch_yaw(roll, pitch, yaw)
    flown = quat_of_roll_pitch_yaw(*lean(wanted, quat_of_roll_pitch_yaw(-0.1, 0.2, yaw + 0.7)), yaw + 0.7)
    assert rotated(flown, (0.0, 0.0, 1.0)) == pytest.approx(rotated(wanted, (0.0, 0.0, 1.0)), abs=1e-9)


@pytest.mark.parametrize("name", ["x500", "f450"])
@pytest.mark.parametrize("thrust", [0.1, 0.25, 0.5, 1.0])
def test_throttle_gives_the_thrust_that_is_asked_for(name, thrust):
    rotors = load_airframe(name).rotor_model
    stick_us = Sticks(load_airframe(name)).throttle_us(thrust)
    command = rotors.idle_command + (1.0 - rotors.idle_command) * (stick_us - 1050) / 950.0
    speed = rotors.command_curve * command + (1.0 - rotors.command_curve) * command**0.5
    assert speed**2 == pytest.approx(thrust, abs=0.003)


def row(kind=SETPOINT_ATTITUDE, q=LEVEL, omega=(0.0, 0.0, 0.0), thrust=0.4, **setpoint):
    actuators = {"q_sp_ned_from_frd": np.array(q), "omega_sp_frd": np.array(omega), "thrust_sp": thrust}
    return {"is_armed": 1, "is_landed": 0} | setpoint, {"kind": kind, "actuators": actuators}


def test_sticks_go_the_way_that_pilots_know():
    sticks = Sticks(load_airframe("x500"))
    roll, pitch, throttle, yaw, *aux = sticks.channels_us(
        *row(q=quat_of_roll_pitch_yaw(0.2, -0.2, 0.0), omega=(0.0, 0.0, 1.0)), LEVEL
    )
    assert roll > 1500  # right
    assert pitch > 1500  # forward: nose down
    assert 1050 < throttle < 2000
    assert yaw == round(1500 + 500 * 57.2958 / RATE_LIMIT_DEG_S)  # to the right
    assert aux[:3] == [2000, 2000, 2000]


def test_rates_are_flown_without_angle_mode():
    sticks = Sticks(load_airframe("x500"))
    channels = sticks.channels_us(*row(SETPOINT_RATE, omega=(0.5, 0.5, 0.0)), LEVEL)
    assert channels[0] == 3000 - channels[1] == round(1500 + 500 * 28.6479 / RATE_LIMIT_DEG_S)
    assert channels[5] == 1000


def test_throttle_is_low_on_the_ground_and_sticks_rest_when_disarmed():
    sticks = Sticks(load_airframe("x500"))
    assert sticks.channels_us(*row(is_landed=1), LEVEL)[2:7] == (1000, 1500, 2000, 2000, 1000)
    assert sticks.channels_us(*row(), LEVEL, is_low=True)[2] == 1000
    assert sticks.channels_us(*row(is_armed=0), LEVEL) == AT_REST_US


def test_answers_of_msp_are_checked():
    good = b"$M>\x03\x03\x04\x06\x00" + bytes((3 ^ 3 ^ 4 ^ 6,))
    assert msp.payload_of(b"noise$M" + good, 3) == b"\x04\x06\x00"
    assert msp.payload_of(good[:-1], 3) is None
    assert msp.payload_of(good[:-1] + b"\x55", 3) is None
    assert msp.payload_of(good, 2) is None
    assert msp.payload_of(good[:-1] + b"\x55" + good, 3) == b"\x04\x06\x00"


def test_reasons_are_named_as_it_names_them():
    head, tail = bytes(15), (1 << 7 | 1 << 28).to_bytes(4, "little")
    assert msp.arming_reasons(head + b"\x01\xff\x1d" + tail) == ["THROTTLE", "ARM_SWITCH"]
    assert msp.arming_reasons(head + b"\x01\xff\x1d" + tail[:3]) == []
    assert msp.arming_reasons(b"") == []


def test_lean_of_a_level_vehicle_is_its_own():
    assert lean(quat_of_roll_pitch_yaw(0.2, 0.1, 1.0), quat_of_roll_pitch_yaw(0.0, 0.0, 1.0)) == pytest.approx(
        (0.2, 0.1)
    )
