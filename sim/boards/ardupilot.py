"""ArduPilot's SITL as a board, by its JSON interface: in lockstep, with all that goes wrong on the way.

SITL sends its servos to our UDP port and waits; we move the body by a step and answer with its state, from which SITL
makes its own sensors but IMU, pitot tube and range finder, which are ours. Its main loop asks for 400 Hz of a copter,
so that copters are exchanged each millisecond. Who has to be answered how: sim/boards/json_wire.py and `FrameCounter`.
"""

import socket
from enum import Enum, auto
from struct import Struct
from typing import Any

from common.clock import wall_time_s
from common.geodesy import GeoPoint
from common.kernels import MAX_MOTORS, SUBSTEPS, TICK_US
from sim.boards.channels import Channel, commands_of
from sim.boards.fast_imu import FastImu
from sim.boards.json_wire import ServoPacket, airspeed_key, range_key, servo_packet, state_text
from sim.boards.live_rows import LiveRows
from sim.boards.outside import POLL_S, OnWait, PeerError
from sim.rig import Rig

PORT = 9002  # of the first instance; the next ones are 10 further each
RESEND_S = 0.5  # of silence; what comes again sooner was on its way when we answered; SITL asks again after 1 s
DATAGRAM_MAX = 4096
_WAIT = Struct("ll").pack(int(POLL_S), round(POLL_S % 1.0 * 1e6))  # seconds and microseconds, as of struct timeval
ROUNDING_NS = 1  # a step: SITL cuts its length to whole microseconds, and would lose one of most


class Verdict(Enum):
    """What a servo packet is."""

    FIRST = auto()
    """Of an autopilot that has just started."""
    NEXT = auto()
    AGAIN = auto()
    """Of the frame that was answered last."""
    FOREIGN = auto()
    """Of another autopilot than that which flies here."""


class FrameCounter:
    """Tells by the numbers of frames, and by who sends them, what a servo packet is."""

    def __init__(self) -> None:
        self.lost_count = 0
        self._last = -1
        self._sender: Any = None

    def judge(self, packet: ServoPacket, sender: Any, silent_s: float) -> Verdict:
        """What a packet is, after so long [s] without one from who flies here, though it was waited for."""
        if self._sender is not None and sender != self._sender and silent_s < RESEND_S:
            return Verdict.FOREIGN
        is_first = sender != self._sender or packet.frame_count < self._last
        if not is_first and packet.frame_count == self._last:
            return Verdict.AGAIN
        if not is_first:
            self.lost_count += packet.frame_count - self._last - 1
        self._last, self._sender = packet.frame_count, sender
        return Verdict.FIRST if is_first else Verdict.NEXT


class ArduPilotBoard:
    """See sim/boards/board.py.

    Args:
        rig: of one vehicle, on the CPU, whose body it flies.
        channels: which of its channels moves which actuator.
        home: origin of ned.
        on_wait: what is done while it is silent.
        port: where it sends its servos to; 0: any free one.
        start_ne_m: where its vehicle boots [m], which is its home: its positions count from there.
        address: of this machine.

    Raises:
        PeerError: the port is taken.
    """

    def __init__(
        self,
        rig: Rig,
        *,
        channels: list[Channel | None],
        home: GeoPoint,
        on_wait: OnWait,
        port: int = PORT,
        start_ne_m: tuple[float, float] = (0.0, 0.0),
        address: str = "127.0.0.1",
    ) -> None:
        if rig.vehicle_count != 1:
            raise ValueError("an autopilot of others flies one vehicle")
        self.is_fast = rig.body.substep is not None
        self.restart_count = 0
        self.exchange_count = 0
        self.again_count = 0
        self.rubbish_count = 0
        self.foreign_count = 0
        self._channels, self._home, self._start_ne_m = channels, home, start_ne_m
        self._on_wait = on_wait
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((address, port))
        except OSError as error:
            self._socket.close()
            raise PeerError(f"UDP port {port} for ArduPilot is in use ({error.strerror})") from error
        # the kernel waits: Python's own time-outs take a call more for each packet
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, _WAIT)
        self.local_port: int = self._socket.getsockname()[1]
        step_us = TICK_US // SUBSTEPS if self.is_fast else TICK_US
        self._step_ns = 1000 * step_us + ROUNDING_NS
        self._time_ns = 0
        self._counter = FrameCounter()
        self._sender: Any = None
        self._answer = b""
        self._silent_s = 0.0  # of waiting, since it was heard
        self._truth = rig.arrays.truth.numpy()  # live
        self._sample_rows, self._command_rows = LiveRows(), LiveRows()
        self._imu = FastImu(rig) if self.is_fast else None

    @property
    def lost_count(self) -> int:
        """Servo packets that never came."""
        return self._counter.lost_count

    @property
    def is_there(self) -> bool:
        """It has been heard."""
        return self._sender is not None

    def boot(self, is_chosen: Any) -> None:
        """It is powered by whoever starts it."""

    def give(self, samples: Any, truth: Any) -> None:  # noqa: ARG002  (the rig's, as when made)
        if self._sender is None:
            self._await([0.0] * MAX_MOTORS)  # which only begins the exchange
        self._time_ns += self._step_ns
        row, truth_row = self._sample_rows.of(samples)[0], self._truth[0]
        felt = self._felt(row["imu"])
        extras = airspeed_key(row["airspeed"], self._home.alt_m - truth_row["pos_ned"][2]) + range_key(row["range"])
        self._answer = state_text(self._time_ns, *felt, truth_row, extras, self._start_ne_m)
        self._send()

    def take(self, commands: Any) -> None:
        self._await(self._command_rows.of(commands)[0])
        self.exchange_count += 1

    def _felt(self, sample: Any) -> tuple[list[float], list[float]]:
        """Rate [rad/s] and specific force [m/s²] since the last exchange, of the IMU at 250 Hz or the faster one."""
        if self._imu is not None:
            self._imu.read()
            sample = self._imu.samples[0]
        return sample["gyro_frd"].tolist(), sample["accel_frd"].tolist()

    def _send(self) -> None:
        try:
            self._socket.sendto(self._answer, self._sender)
        except OSError:  # it is gone; it says so by its silence
            return

    def _await(self, row: Any) -> None:
        """Waits for the next servos, as long as `on_wait` lets it."""
        begun_s = looked_s = heard_s = wall_time_s()
        while True:
            received = self._receive()
            now_s = wall_time_s()
            if now_s - looked_s >= POLL_S:
                looked_s = now_s
                self._on_wait(now_s - begun_s)
            if received is not None:
                waited_s, heard_s = now_s - heard_s, now_s
                if self._is_taken(*received, row, waited_s):
                    return

    def _is_taken(self, packet: ServoPacket, sender: Any, row: Any, waited_s: float) -> bool:
        """Whether the packet, which was waited for so long, has brought the next servos."""
        verdict = self._counter.judge(packet, sender, self._silent_s)
        if verdict is Verdict.FOREIGN:
            self.foreign_count += 1
            return False
        self._silent_s = 0.0
        if verdict is Verdict.AGAIN:
            self._answer_again(waited_s)
            return False
        if verdict is Verdict.FIRST:
            self._begin()
        self._sender = sender
        row[: len(self._channels)] = commands_of(self._channels, packet.pulses_us)
        return True

    def _begin(self) -> None:
        """An autopilot has started: its clock begins, and what it flies shall stand where it boots."""
        if self._sender is not None:
            self.restart_count += 1
        self._time_ns = 0

    def _answer_again(self, waited_s: float) -> None:
        """Our answer was lost, or late: then it has read it by now, and would be a frame behind with two.

        It was late if what asks again was there before it was waited for: others have held up the exchange.
        """
        if self._answer and waited_s >= RESEND_S:
            self.again_count += 1
            self._send()

    def _receive(self) -> tuple[ServoPacket, Any] | None:
        """The next packet and who sent it; None: nothing in time, or rubbish."""
        try:
            data, sender = self._socket.recvfrom(DATAGRAM_MAX)
        except BlockingIOError:  # nothing in time
            self._silent_s += POLL_S
            return None
        except ConnectionError:  # an earlier answer found nobody
            return None
        packet = servo_packet(data)
        self.rubbish_count += packet is None
        return None if packet is None else (packet, sender)

    def close(self) -> None:
        self._socket.close()
