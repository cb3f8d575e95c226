"""PX4's HIL messages against a stand-in that is as strict as its parser, its clock and its time-outs."""

import socket
from contextlib import ExitStack

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from autopilot.ports import Samples
from bench.standins.px4 import Px4StandIn
from common.clock import wall_sleep_s, wall_time_s
from common.geodesy import DEFAULT_HOME
from sim.boards.hil_wire import HilWriter
from sim.boards.outside import PeerError
from sim.boards.px4 import Px4Board
from tests.unit.sim.boards.flown_by import rig_of, running

TICK_US = 4_000


def fly(rig, work):
    """Until nobody is left to fly it."""
    with ExitStack() as threads:
        threads.enter_context(running(work))
        with pytest.raises(PeerError):
            rig.advance(100_000)


def until_us(px4, end_us):
    """Answers until its clock has got so far, and leaves."""
    while px4.time_us < end_us and px4.step():
        pass
    px4.close()


def connected(board, made, end_us, **options):
    def work():
        made.append(Px4StandIn(board.local_port, **options))
        until_us(made[-1], end_us)

    return work


def test_every_sample_is_answered_in_step():
    with rig_of(Px4Board, patience_s=0.3) as (rig, board):
        made = []
        fly(rig, connected(board, made, 4_000_000))
        px4 = made[0]
        assert px4.faults == []
        assert px4.time_us == px4.counts["sensor"] * TICK_US
        assert px4.counts["answers"] == px4.counts["sensor"] == 1000
        assert board.unanswered_count <= 1  # the last
        assert px4.counts["mag"] == pytest.approx(100, abs=3)
        assert px4.counts["baro"] == pytest.approx(200, abs=3)
        assert 10 <= px4.counts["gps"] <= 20  # 5 Hz, from the first fix on
        assert px4.counts["truth"] == 500


def test_what_it_reads_is_what_the_vehicle_feels():
    with rig_of(Px4Board, patience_s=0.3, noise=0.01) as (rig, board):
        made = []
        fly(rig, connected(board, made, 2_000_000))
        sensor, gps, truth = made[0].sensor, made[0].gps, made[0].truth
        assert (sensor.xacc, sensor.yacc, sensor.zacc) == pytest.approx((0.0, 0.0, -9.80665), abs=0.01)
        assert sensor.abs_pressure == pytest.approx(
            1013.25 * (1.0 - DEFAULT_HOME.alt_m / 44_330.8) ** 5.2559, abs=0.3
        )  # ISO 2533
        assert sensor.pressure_alt == pytest.approx(DEFAULT_HOME.alt_m, abs=1.0)
        assert np.linalg.norm((sensor.xmag, sensor.ymag, sensor.zmag)) == pytest.approx(0.5, abs=0.2)
        assert gps.lat == pytest.approx(DEFAULT_HOME.lat_deg * 1e7, abs=100)
        assert gps.fix_type >= 3
        assert gps.satellites_visible >= 6
        assert gps.alt == pytest.approx(truth.alt, abs=500)


def test_the_pitot_tube_of_a_plane_is_read_in_hectopascals():
    samples = np.zeros(1, dtype=Samples.numpy_dtype())[0]
    samples["airspeed"]["pressure_pa"] = 278.0  # of 21.3 m/s at sea level
    wire = mavlink.MAVLink(None)
    for has_airspeed, expected in ((True, (2.78, 0x400)), (False, (0.0, 0))):
        frame = HilWriter(DEFAULT_HOME).sensors(4_000, samples, has_mag=False, has_baro=True, has_airspeed=has_airspeed)
        message = wire.parse_buffer(frame)[0]
        assert (message.diff_pressure, message.fields_updated & 0x400) == pytest.approx(expected)


@pytest.mark.parametrize(("name", "count"), [("plane", 50), ("x500", 0)])
def test_a_pitot_tube_is_read_where_there_is_one(name, count):
    with rig_of(Px4Board, name, patience_s=0.3) as (rig, board):
        made = []
        fly(rig, connected(board, made, 1_000_000))
        assert made[0].faults == []
        assert made[0].counts["airspeed"] == pytest.approx(count, abs=2)
        assert abs(made[0].pressure_pa) < 15.0  # it stands


@pytest.mark.parametrize(
    ("name", "moved"),
    [("rover", [0.1, 0.2, 0.0]), ("rover-skid", [0.1, 0.2, 0.0]), ("plane", [0.1, 0.2, 0.3, 0.4, 0.5, 0.0])],
)
def test_its_controls_move_what_we_have_in_our_order_but_brakes(name, moved):
    with rig_of(Px4Board, name, patience_s=0.3) as (rig, board):
        fly(rig, connected(board, [], 100_000, control=lambda _: [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]))
        assert rig.board_commands.numpy()[0][: len(moved)] == pytest.approx(moved)


def test_its_controls_reach_the_motors_of_their_numbers():
    with rig_of(Px4Board, patience_s=0.3) as (rig, board):
        fly(rig, connected(board, [], 100_000, control=lambda _: [0.1, 0.2, 0.3, float("nan"), 0.9]))
        assert rig.board_commands.numpy()[0][:4] == pytest.approx([0.1, 0.2, 0.3, 0.0])


@pytest.mark.parametrize("is_armed", [True, False])
def test_who_answers_seldom_or_never_does_not_stall_the_world(is_armed):
    with rig_of(Px4Board, "rover", patience_s=0.3) as (rig, board):
        made = []
        fly(rig, connected(board, made, 800_000, is_rover=True, is_armed=is_armed))
        px4 = made[0]
        assert px4.faults == []
        assert px4.counts["sensor"] >= 200
        assert (px4.counts["answers"] > 0) == is_armed


def test_late_answers_are_waited_for_and_then_not():
    with rig_of(Px4Board, patience_s=0.5) as (rig, board):
        made = []

        def tired(px4):
            if px4.counts["answers"] in (50, 51):
                wall_sleep_s(0.05)  # longer than an answer is waited for
            return [0.0] * 16

        fly(rig, connected(board, made, 400_000, control=tired))
        assert made[0].faults == []
        assert board.unanswered_count >= 1
        assert made[0].counts["answers"] == made[0].counts["sensor"]


def test_rubbish_between_its_messages_is_skipped():
    with rig_of(Px4Board, patience_s=0.3) as (rig, board):
        made = []

        def rude():
            px4 = Px4StandIn(board.local_port)
            made.append(px4)
            px4.step()
            px4.socket.sendall(b"\xfd\x00rubbish")  # it might begin a frame
            while px4.time_us < 200_000 and px4.step():
                px4.socket.sendall(b"rubbish")
            px4.close()

        fly(rig, rude)
        assert made[0].faults == []
        assert made[0].counts["answers"] == 50
        assert board.rubbish_count > 0


def test_it_may_go_and_come_again():
    with rig_of(Px4Board, patience_s=0.3) as (rig, board):
        made = []
        fly(rig, connected(board, made, 100_000))
        fly(rig, connected(board, made, 100_000))
        assert board.restart_count == 1
        assert made[1].faults == []
        assert made[1].time_us == 100_000  # its clock began anew


def test_who_never_comes_is_given_up_and_a_port_that_is_taken_is_told():
    with rig_of(Px4Board, patience_s=0.05) as (rig, board):
        with pytest.raises(PeerError, match="has been silent"):
            rig.advance(1)
        with pytest.raises(PeerError, match="in use"):
            Px4Board(rig, channels=[], home=DEFAULT_HOME, on_wait=lambda _: None, port=board.local_port)


def test_with_who_connects_and_says_nothing_time_goes_on_by_the_wall():
    with rig_of(Px4Board) as (rig, board):
        mute = socket.create_connection(("127.0.0.1", board.local_port))
        with mute:
            before_s = wall_time_s()
            rig.advance(50)
            assert 0.15 < wall_time_s() - before_s < 2.0
