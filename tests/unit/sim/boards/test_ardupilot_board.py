"""ArduPilot's JSON interface against a stand-in that is as strict as its parser, its clock and its time-outs."""

from contextlib import ExitStack, closing

import numpy as np
import pytest

from autopilot.mavlink.transport.links import UdpLink
from bench.standins.ardupilot import ArduPilotStandIn, Unreadable, parse
from common.clock import wall_sleep_s
from common.geodesy import DEFAULT_HOME
from sim.boards import ardupilot
from sim.boards.ardupilot import ArduPilotBoard
from sim.boards.json_wire import servo_packet, state_text
from sim.boards.outside import PeerError
from sim.truth import Truth
from tests.unit.sim.boards.flown_by import rig_of, running


@pytest.fixture(scope="module")
def truth():
    row = np.zeros((), Truth.numpy_dtype())
    row["pos_ned"], row["vel_ned"] = (1.5, -2.25, -30.125), (0.5, 0.25, -1e-7)
    row["q_ned_from_frd"] = (0.0, 0.0, np.sin(0.25), np.cos(0.25))
    return row


def test_the_strict_parser_reads_what_was_written(truth):
    state = parse(state_text(1_234_000_001, [0.1, -1e-9, 3.0], [0.0, 0.0, -9.80665], truth))
    assert state.timestamp == pytest.approx(1.234000001, abs=1e-12)
    assert state.gyro == pytest.approx((0.1, -1e-9, 3.0))
    assert state.accel_body == pytest.approx((0.0, 0.0, -9.80665))
    assert state.position == pytest.approx((1.5, -2.25, -30.125))
    assert state.velocity == pytest.approx((0.5, 0.25, -1e-7))
    assert state.quaternion == pytest.approx((np.cos(0.25), 0.0, 0.0, np.sin(0.25)))


def test_a_number_that_is_none_is_never_sent(truth):
    broken = truth.copy()
    broken["vel_ned"][1] = np.nan
    with pytest.raises(PeerError, match="not a number"):
        state_text(0, [0.0] * 3, [0.0] * 3, broken)


def test_the_parser_of_the_stand_in_is_as_strict_as_the_real_one():
    for text in (b"{}", b"\n{}\n", b'\n{"timestamp": 1.0}\n', b'\n{"timestamp":1,"imu":{"gyro": [0,0,0]}}\n'):
        with pytest.raises(Unreadable):
            parse(text)


@pytest.fixture
def sitl_at():
    """Makes stand-ins, which are closed in the end."""
    made = []

    def make(*arguments, **options):
        made.append(ArduPilotStandIn(*arguments, **options))
        return made[-1]

    yield make
    for each in made:
        each.close()


def test_servo_packets_have_sixteen_or_thirty_two_channels(sitl_at):
    for channels in (16, 32):
        sitl = sitl_at(1, lambda _: [1500, 1600], channels)
        packet = servo_packet(sitl.packet())
        assert packet is not None
        assert len(packet.pulses_us) == channels
        assert packet.pulses_us[:3] == (1500, 1600, 0)
        assert servo_packet(sitl.packet()[:-1]) is None
        assert servo_packet(b"\0" + sitl.packet()[1:]) is None


def fly(rig, *works):
    """Each of these works in a thread of its own, until the rig has nobody left to fly it."""
    with ExitStack() as threads:
        for work in works:
            threads.enter_context(running(work))
        with pytest.raises(PeerError):
            rig.advance(100_000)


def frames(sitl, count):
    return lambda: [sitl.frame() for _ in range(count)]


@pytest.mark.parametrize("name", ["x500", "rover", "plane"])
def test_its_clock_keeps_to_ours(name, sitl_at):
    with rig_of(ArduPilotBoard, name, patience_s=0.3) as (rig, board):
        sitl = sitl_at(board.local_port, lambda _: [1500] * 16)
        fly(rig, frames(sitl, 300))
        assert sitl.frame_count == 300
        step_us = 1000 if board.is_fast else 4000
        assert sitl.time_us == sitl.frame_count * step_us  # in whole microseconds, not one lost
        assert sitl.unreadable_count == 0
        assert board.lost_count == 0
        assert board.rubbish_count == 0


@pytest.mark.parametrize("name", ["x500", "plane"])
def test_a_lost_answer_is_sent_again(name, monkeypatch, sitl_at):
    monkeypatch.setattr(ardupilot, "RESEND_S", 0.02)
    with rig_of(ArduPilotBoard, name, patience_s=0.5) as (rig, board):
        sitl = sitl_at(board.local_port)

        def lossy():
            for k in range(40):
                if k % 10 == 5:  # the answer is lost: it asks again, and gets the same
                    lost = sitl.ask()
                    wall_sleep_s(0.03)
                    again = sitl.ask()
                    assert again == lost
                    sitl.take(again)
                else:
                    sitl.frame()

        fly(rig, lossy)
        assert sitl.frame_count == 40
        assert board.again_count == 4
        assert board.exchange_count in (39, 40)  # no step was taken twice
        assert sitl.time_us == 40 * (1000 if board.is_fast else 4000)


def test_a_question_that_crossed_the_answer_is_not_answered_twice(sitl_at):
    with rig_of(ArduPilotBoard, patience_s=0.3) as (rig, board):
        sitl = sitl_at(board.local_port)

        def hasty():
            for _ in range(20):
                sitl.send()
                sitl.frame()

        fly(rig, hasty)
        assert board.again_count == 0
        assert sitl.frame_count == 20
        assert sitl.time_us == 20_000  # with two answers to one question each would be read a frame late


def test_what_asked_again_while_others_held_us_up_is_not_answered_twice(monkeypatch, sitl_at):
    """As in a fleet: between an answer and the next waiting another's exchange may take long."""
    monkeypatch.setattr(ardupilot, "RESEND_S", 0.02)
    with rig_of(ArduPilotBoard, patience_s=0.5) as (rig, board):
        sitl = sitl_at(board.local_port)
        give = board.give

        def slowly(samples, truth):
            give(samples, truth)
            wall_sleep_s(0.05)

        monkeypatch.setattr(board, "give", slowly)

        def impatient():
            for _ in range(10):
                sitl.send()
                wall_sleep_s(0.01)
                sitl.frame()

        fly(rig, impatient)
        assert board.again_count == 0
        assert sitl.time_us == 10_000  # none is read a frame late


def test_rubbish_and_others_change_nothing(sitl_at):
    with rig_of(ArduPilotBoard, patience_s=0.3) as (rig, board), closing(UdpLink(board.local_port)) as other:
        sitl, stranger = sitl_at(board.local_port), sitl_at(board.local_port, lambda _: [2000] * 16)

        def noisy():
            for _ in range(20):
                sitl.frame()
                other.send(b"\x1a\x48rubbish")
                other.send(b"")
                stranger.send()

        fly(rig, noisy)
        assert sitl.frame_count == 20
        assert board.rubbish_count >= 20
        assert board.foreign_count >= 10
        assert board.restart_count == 0
        assert np.all(rig.board_commands.numpy()[0][:4] == 0.0)


@pytest.mark.parametrize("name", ["x500", "plane"])
def test_a_restart_is_noticed_and_its_clock_begins_anew(name, monkeypatch, sitl_at):
    monkeypatch.setattr(ardupilot, "RESEND_S", 0.02)
    with rig_of(ArduPilotBoard, name, patience_s=0.3) as (rig, board):
        fly(rig, frames(sitl_at(board.local_port), 10))
        second = sitl_at(board.local_port)
        fly(rig, frames(second, 10))
        assert board.restart_count == 1
        assert second.state.timestamp == pytest.approx(10 * (1e-3 if board.is_fast else 4e-3), abs=1e-6)
        assert not second.is_reset_seen


def test_who_never_comes_is_given_up_with_a_sentence():
    with rig_of(ArduPilotBoard, patience_s=0.05) as (rig, _), pytest.raises(PeerError, match="has been silent"):
        rig.advance(1)


def test_a_port_that_is_taken_is_told():
    with rig_of(ArduPilotBoard) as (rig, board), pytest.raises(PeerError, match="in use"):
        ArduPilotBoard(rig, channels=[], home=DEFAULT_HOME, on_wait=lambda _: None, port=board.local_port)


HEIGHT_M = 10.0


def hover(state):
    """A plain law: signs, units, axes and the numbers of the motors all have to be right."""
    if state is None:
        return [1000] * 4
    w, x, y, z = state.quaternion
    roll, pitch = 2.0 * (w * x + y * z), 2.0 * (w * y - x * z)
    thrust = 0.43 + 0.06 * (state.position[2] + HEIGHT_M) + 0.08 * state.velocity[2]
    right, forward, clockwise = (
        -gain * angle - rate_gain * rate
        for gain, angle, rate_gain, rate in zip(
            (0.2, 0.2, 0.0), (roll, pitch, 0.0), (0.05, 0.05, 0.05), state.gyro, strict=True
        )
    )
    motors = (
        thrust - right + forward + clockwise,  # front right, turns counter-clockwise: drives the nose clockwise
        thrust + right - forward + clockwise,  # rear left
        thrust + right + forward - clockwise,  # front left
        thrust - right - forward - clockwise,  # rear right
    )
    return [1000 + round(1000.0 * float(np.sqrt(np.clip(part, 0.0, 1.0)))) for part in motors]


def test_a_law_on_its_side_holds_height_and_level(sitl_at):
    with rig_of(ArduPilotBoard, patience_s=0.5) as (rig, board):
        sitl = sitl_at(board.local_port, hover)
        fly(rig, frames(sitl, 12_000))
        row = rig.truth_row()
        assert row["pos_ned"][2] == pytest.approx(-HEIGHT_M, abs=1.0)  # no integral, and the battery sags
        assert np.linalg.norm(row["vel_ned"]) < 0.5
        assert abs(row["q_ned_from_frd"][:2]).max() < 0.05
        assert sitl.state.position == pytest.approx(tuple(row["pos_ned"]), abs=1e-3)
        assert sitl.state.accel_body[2] == pytest.approx(-9.81, abs=2.0)


CRUISE_M_S, HIGH_M = 21.3, 40.0


def roll_pitch_yaw(quaternion):
    w, x, y, z = quaternion
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0)), yaw


def take_off(state):
    """A plain law that runs along the runway to the north, rotates and climbs: each channel has to have its sign."""
    if state is None or state.airspeed is None:
        return [1500, 1500, 1000, 1500, 1000]
    roll, pitch, yaw = roll_pitch_yaw(state.quaternion)
    p, q, r = state.gyro
    climb = 0.09 + 0.02 * (HIGH_M + state.position[2]) + 0.06 * state.velocity[2]
    runs = state.position[2] > -0.8 and state.airspeed < 19.0
    wanted_roll, wanted_pitch = np.clip(-yaw, -0.3, 0.3), np.clip(climb, -0.1, 0.25)
    ailerons = 0.0 if runs else 0.8 * (wanted_roll - roll) - 0.1 * p
    elevator = 0.0 if runs else 0.34 + 1.5 * (wanted_pitch - pitch) - 0.3 * q
    throttle = 0.6 + 0.2 * (CRUISE_M_S - state.airspeed)
    rudder = -0.8 * yaw - 0.2 * r if runs else 0.0
    return [
        *(1500 + round(500.0 * float(np.clip(part, -1.0, 1.0))) for part in (ailerons, elevator)),
        1000 + round(1000.0 * float(np.clip(throttle, 0.0, 1.0))),
        1500 + round(500.0 * float(np.clip(rudder, -1.0, 1.0))),
        1000,
    ]


def test_a_law_on_its_side_takes_a_plane_off(sitl_at):
    with rig_of(ArduPilotBoard, "plane", patience_s=0.5) as (rig, board):
        sitl = sitl_at(board.local_port, take_off)
        fly(rig, frames(sitl, 7_000))
        row, state = rig.truth_row(), sitl.state
        assert row["pos_ned"][2] == pytest.approx(-HIGH_M, abs=5.0)
        assert abs(row["pos_ned"][1]) < 0.1 * row["pos_ned"][0]
        assert state.airspeed == pytest.approx(np.linalg.norm(row["vel_ned"]), abs=1.0)  # true, in a calm
        assert state.airspeed == pytest.approx(CRUISE_M_S, abs=1.5)


@pytest.mark.parametrize(
    ("channel", "pulse_us", "index", "axis"),
    [(0, 1700, 0, "ailerons"), (1, 1900, 1, "elevator"), (3, 1700, 2, "rudder")],
)
def test_more_pulse_turns_a_plane_right_and_up(channel, pulse_us, index, axis, sitl_at):
    with rig_of(ArduPilotBoard, "plane", noise=0.0, patience_s=0.3) as (rig, board):
        sitl = sitl_at(board.local_port, take_off)
        fly(rig, frames(sitl, 2_500))
        before = sitl.state.gyro[index]

        def push(state):
            pulses = take_off(state)
            pulses[channel] = pulse_us
            return pulses

        sitl._control = push
        fly(rig, frames(sitl, 60))
        assert sitl.state.gyro[index] > before + 0.05, axis


def test_the_nose_wheel_turns_with_the_rudder_and_the_brake_has_a_channel(sitl_at):
    with rig_of(ArduPilotBoard, "plane", patience_s=0.3) as (rig, board):
        sitl = sitl_at(board.local_port, lambda _: [1500, 1500, 1000, 2000, 1750])
        fly(rig, frames(sitl, 5))
        commands = rig.board_commands.numpy()[0]
        assert commands[:6] == pytest.approx([0.0, 0.0, 0.0, 1.0, 1.0, 0.75])


def test_a_copter_sends_no_airspeed(sitl_at):
    with rig_of(ArduPilotBoard, patience_s=0.3) as (rig, board):
        sitl = sitl_at(board.local_port)
        fly(rig, frames(sitl, 30))
        assert sitl.state.airspeed is None
        assert sitl.state.rng_1 is not None
