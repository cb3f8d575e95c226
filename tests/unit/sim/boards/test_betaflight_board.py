"""Betaflight as a board against a stand-in that is as strict as its parser, its clock and its time-outs."""

from contextlib import closing, contextmanager
from threading import Event, Thread

import numpy as np
import pytest

from autopilot.mavlink.transport.links import UdpLink
from autopilot.ports import SETPOINT_ATTITUDE
from bench.standins.betaflight import CALIB, CALIBRATION_S, RXLOSS, BetaflightStandIn
from common.airframe import load_airframe
from common.clock import wall_sleep_s
from common.kernels import SUBSTEPS
from sim.boards import betaflight
from sim.boards.betaflight import SETTLE_ANSWERS, BetaflightBoard
from sim.boards.outside import PeerError
from tests.unit.sim.boards.flown_by import rig_of


@contextmanager
def flown(patience_s=2.0, noise=1.0, **options):
    """A stand-in, the rig that it flies, and its board."""
    with (
        closing(BetaflightStandIn(**options)) as peer,
        rig_of(BetaflightBoard, noise=noise, patience_s=patience_s, peer=peer) as (rig, board),
    ):
        yield peer, rig, board


def fly(rig, ticks, *peers, step=lambda peer: peer.step(0.02)):
    """Advances while each of them does its part in a thread of its own."""
    is_over = Event()

    def work(peer):
        while not is_over.is_set():
            step(peer)

    threads = [Thread(target=work, args=(peer,)) for peer in peers]
    for thread in threads:
        thread.start()
    try:
        rig.advance(ticks)
    finally:
        is_over.set()
        for thread in threads:
            thread.join()


def arm(rig, thrust=0.0, is_landed=1):
    setpoint = rig.rows["autopilot.setpoint"][0]
    setpoint["kind"], setpoint["is_armed"], setpoint["is_landed"] = SETPOINT_ATTITUDE, 1, is_landed
    setpoint["q_ned_from_frd"], setpoint["thrust"] = (0.0, 0.0, 0.0, 1.0), thrust


def test_each_millisecond_is_one_loop_of_it():
    with flown() as (peer, rig, board):
        fly(rig, 100, peer)
        assert board.exchange_count == 100 * SUBSTEPS
        assert 0 <= peer.loop_count - SETTLE_ANSWERS - 100 * SUBSTEPS <= board.again_count
        assert peer.faults == []
        assert board.rubbish_count == board.foreign_count == board.restart_count == 0
        assert board.extra_count <= board.again_count  # the second answers to what was sent again


def test_sticks_wait_until_its_receiver_is_there():
    with flown() as (peer, rig, _):
        fly(rig, 100, peer)
        assert not peer.receiver.flags & RXLOSS
        assert peer.sticks_count >= 99


def test_it_is_told_what_the_estimator_believes_and_not_the_truth():
    with flown() as (peer, rig, _):
        fly(rig, 600, peer)
        x, y, z, w = rig.rows["autopilot.ekf.rows"][0]["estimate"]["q_ned_from_frd"]
        believed, true = np.array([w, x, y, z]), rig.truth_row()["q_ned_from_frd"][[3, 0, 1, 2]]
        assert np.array(peer.state.wxyz) == pytest.approx(believed, abs=1e-6)
        assert np.abs(believed - true).max() > 1e-4
        assert peer.state.accel_turned[2] == pytest.approx(-9.81, abs=1.0)
        assert peer.state.pressure_pa > 80_000.0


def test_it_is_armed_and_its_motors_are_those_that_are_logged():
    with flown() as (peer, rig, _):
        ticks = int(CALIBRATION_S * 250)
        fly(rig, ticks, peer)
        assert not peer.receiver.flags & CALIB
        arm(rig)
        fly(rig, 50, peer)
        assert peer.receiver.is_armed
        assert rig.board_commands.numpy()[0][:4] == pytest.approx([peer.idle] * 4)
        assert rig.rows["autopilot.control"][0]["actuators"]["command"][:4] == pytest.approx([peer.idle] * 4)


def test_throttle_that_is_asked_for_too_early_waits_until_it_has_armed():
    with flown() as (peer, rig, _):
        ticks = int(CALIBRATION_S * 250)
        fly(rig, ticks, peer)
        arm(rig, thrust=0.4, is_landed=0)
        fly(rig, 250, peer)
        assert peer.receiver.is_armed
        assert rig.truth_row()["pos_ned"][2] < -0.2  # it has left the ground


def test_who_does_not_arm_is_given_up_with_its_own_reasons(monkeypatch):
    monkeypatch.setattr(betaflight, "ARMS_US", 100_000)
    with flown() as (peer, rig, _):
        fly(rig, 10, peer)
        arm(rig)  # it calibrates still
        with pytest.raises(PeerError, match=r"does not arm \(CALIB ARM_SWITCH\)"):
            fly(rig, 100, peer)


def test_late_answers_are_waited_for():
    with flown() as (peer, rig, board):

        def tired(peer):
            if peer.loop_count == SETTLE_ANSWERS + 20:
                wall_sleep_s(0.05)
            peer.step(0.02)

        fly(rig, 10, peer, step=tired)
        assert board.exchange_count == 40
        assert board.again_count >= 1


def test_an_answer_that_comes_twice_is_taken_once():
    with flown() as (peer, rig, board):
        peer.answer = lambda data: [peer.send(data) for _ in range(2)]
        fly(rig, 10, peer)
        assert board.exchange_count == 40
        assert board.extra_count > 0


def test_rubbish_and_others_change_nothing():
    with (
        flown() as (peer, rig, board),
        closing(UdpLink(board.local_port)) as other,
        closing(BetaflightStandIn(board.local_port)) as stranger,
    ):

        def noisy(peer):
            peer.step(0.02)
            if peer.loop_count > SETTLE_ANSWERS:
                other.send(b"rubbish")
                other.send(b"")
                stranger.send(stranger.motors())

        fly(rig, 10, peer, step=noisy)
        assert board.exchange_count == 40
        assert board.rubbish_count >= 40
        assert board.restart_count == 0


def test_a_restart_is_noticed_and_it_is_not_armed_before_we_are_disarmed(monkeypatch):
    monkeypatch.setattr(betaflight, "SILENT_S", 0.05)
    with flown() as (peer, rig, board):
        ticks = int(CALIBRATION_S * 250)
        fly(rig, ticks, peer)
        arm(rig)
        fly(rig, 50, peer)
        peer.close()
        seconds = []

        def come_late(peer):
            if not seconds:
                wall_sleep_s(0.1)
                seconds.append(BetaflightStandIn(board.local_port, *peer.ports[1:], peer.msp_port))
            seconds[0].step(0.02)

        fly(rig, 50, peer, step=come_late)
        with closing(seconds[0]) as second:
            assert board.restart_count == 1
            assert second.faults == []
            assert not second.receiver.flags & RXLOSS
            assert second.receiver.channels[4] == 1000
            assert np.all(rig.board_commands.numpy()[0][:4] == 0.0)


def test_a_program_of_ours_is_flown_though_its_server_is_lost():
    with flown() as (peer, rig, board):
        peer.command_line.is_mute = board.is_ours = True
        fly(rig, 10, peer)
        assert board.exchange_count == 40


@pytest.mark.parametrize(("version", "told"), [((26, 6, 0), "26.6.0"), ((4, 5, 1), "4.5.1")])
def test_another_version_is_refused_before_it_gets_a_state(version, told):
    with flown(version=version) as (peer, rig, _):
        with pytest.raises(PeerError, match=rf"is BTFL {told}, and not Betaflight 4\.6"):
            rig.advance(1)
        assert not peer.step(0.05)


def test_another_number_of_motors_is_refused():
    with flown(motor_count=6) as (peer, rig, _), pytest.raises(PeerError, match="flies 6 motors"):
        fly(rig, 1, peer)


@pytest.mark.parametrize("is_mute", [True, False])
def test_who_never_comes_or_never_flies_is_given_up_with_a_sentence(is_mute):
    with flown(patience_s=0.15) as (peer, rig, _):
        peer.command_line.is_mute = is_mute
        with pytest.raises(PeerError, match="has been silent"):
            rig.advance(1)


def test_a_port_that_is_taken_and_other_vehicles_are_told():
    with flown() as (peer, rig, board), pytest.raises(PeerError, match="in use"):
        BetaflightBoard(rig, load_airframe("x500"), on_wait=lambda _: None, ports=(board.local_port, 0, 0))
    with pytest.raises(ValueError, match="4 motors in X"), rig_of(BetaflightBoard, "f550", peer=peer):
        pass
