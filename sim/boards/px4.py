"""PX4's SITL as a board, by MAVLink's HIL messages over TCP: we are the server, and its clock is ours.

After each tick of 4 ms we send what the sensors have, and wait for its actuators. It answers when a control module has
run: a copter to every sample of the gyro, a rover at 100 Hz and only while armed. So who has answered each tick is
waited for, a second at most; who answers seldom, as long as that has lately taken; and while it does not answer at all,
time runs at the wall's pace.
"""

import socket
from collections import deque
from typing import Any

from autopilot.mavlink.wire.codec import FrameReader
from common.clock import wall_time_s
from common.geodesy import GeoPoint
from common.kernels import TICK_S, TICK_US
from sim.boards.channels import Channel, commands_of
from sim.boards.hil_wire import ACTUATORS_ID, SAFETY_ARMED, HilWriter
from sim.boards.live_rows import LiveRows
from sim.boards.outside import POLL_S, OnWait, PeerError
from sim.rig import Rig

PORT = 4560  # of the first instance; the next ones are 1 further each
STEADY_S = 1.0  # of wall clock time, that who answers each tick is waited for: then it says "poll timeout" itself
ANSWER_S = 0.02  # and who answers seldom
PERIOD_TICKS_MAX = 5  # guess: beyond it the answers are no lockstep
READ_MAX = 65_536
TRUTH_TICKS = 2  # it asks for the truth at 200 Hz, for its log; 125 Hz do


class Px4Board:
    """See sim/boards/board.py.

    Args:
        rig: of one vehicle, on the CPU, whose body it flies.
        channels: which of its actuator controls moves which actuator.
        home: origin of ned.
        on_wait: what is done while it is not connected; who is may be silent: a rover is, while it is not armed.
        port: where it connects to; 0: any free one.
        address: of this machine.

    Raises:
        PeerError: the port is taken.
    """

    is_fast = False

    def __init__(
        self,
        rig: Rig,
        *,
        channels: list[Channel | None],
        home: GeoPoint,
        on_wait: OnWait,
        port: int = PORT,
        address: str = "127.0.0.1",
    ) -> None:
        if rig.vehicle_count != 1:
            raise ValueError("an autopilot of others flies one vehicle")
        self.restart_count = 0
        self.exchange_count = 0
        self.unanswered_count = 0
        self.is_armed = False
        self._channels, self._on_wait = channels, on_wait
        self._server = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._server.bind((address, port))
        except OSError as error:
            self._server.close()
            raise PeerError(f"TCP port {port} for PX4 is in use ({error.strerror})") from error
        self._server.listen(1)
        self._server.settimeout(POLL_S)
        self.local_port: int = self._server.getsockname()[1]
        self._writer = HilWriter(home)
        self._truth = rig.arrays.truth.numpy()[0]  # live
        self._sample_rows, self._command_rows = LiveRows(), LiveRows()
        self._sent_us = dict.fromkeys(("mag", "baro", "gnss", "range", "airspeed"), 0)  # times of the samples sent last
        self._peer: socket.socket | None = None
        self._given_s = 0.0  # when samples were sent last
        self._was_there = False
        self._begin()

    def _begin(self) -> None:
        """What is known of a PX4 that has just connected."""
        self._reader = FrameReader()
        self._time_us = 0
        self._answered_us = 0  # which sample it has answered last
        self._periods: deque[int] = deque(maxlen=4)  # [ticks] between its last answers; empty: it does not answer

    @property
    def is_there(self) -> bool:
        """It is connected."""
        return self._peer is not None

    @property
    def rubbish_count(self) -> int:
        """Bytes that were no message."""
        return self._reader.bad_byte_count

    def boot(self, is_chosen: Any) -> None:
        """It is powered by whoever starts it."""

    def give(self, samples: Any, truth: Any) -> None:  # noqa: ARG002  (the rig's, as when made)
        if self._peer is None:
            self._accept()
        self._time_us += TICK_US
        self._given_s = wall_time_s()
        self._send(self._sample_rows.of(samples)[0])

    def take(self, commands: Any) -> None:
        row = self._command_rows.of(commands)[0]
        if self._answered_us == 0:  # who has just connected commands nothing
            row[:] = 0.0
        self._listen(row, self._given_s)
        self.exchange_count += 1

    def _accept(self) -> None:
        begun_s = wall_time_s()
        while self._peer is None:
            try:
                self._peer, _ = self._server.accept()
            except TimeoutError:
                self._on_wait(wall_time_s() - begun_s)
        self._peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.restart_count += self._was_there
        self._was_there = True
        self._begin()

    def _send(self, samples: Any) -> None:
        is_new = {name: self._is_new(name, samples[name]) for name in self._sent_us}
        data = self._writer.gnss(self._time_us, samples["gnss"]) if is_new["gnss"] else b""
        if is_new["range"]:
            data += self._writer.distance(self._time_us, samples["range"])
        if self._time_us // TICK_US % TRUTH_TICKS == 0:
            data += self._writer.truth(self._time_us, self._truth)
        has = {f"has_{name}": is_new[name] for name in ("mag", "baro", "airspeed")}
        data += self._writer.sensors(self._time_us, samples, **has)
        try:
            if self._peer is not None:
                self._peer.settimeout(STEADY_S)
                self._peer.sendall(data)
        except OSError:
            self._lose()

    def _is_new(self, name: str, sample: Any) -> bool:
        time_us = int(sample["time_us"])
        if time_us == self._sent_us[name]:
            return False
        self._sent_us[name] = time_us
        return True

    def _listen(self, row: Any, begun_s: float) -> None:
        """Takes its actuators: those that answer this tick, if that is due; else what has come in."""
        limit_s = TICK_S
        if self._periods:
            limit_s = STEADY_S if max(self._periods) == 1 else ANSWER_S
        is_due = self._time_us - self._answered_us >= TICK_US * max(self._periods, default=0)
        while self._peer is not None:
            left_s = limit_s - (wall_time_s() - begun_s) if is_due else 0.0
            if self._receive(row, min(max(left_s, 0.0), POLL_S)):
                return
            if left_s <= 0.0:
                break
            if self._periods:
                self._on_wait(wall_time_s() - begun_s)
        if is_due:
            self.unanswered_count += bool(self._periods)
            if self._time_us - self._answered_us >= TICK_US * PERIOD_TICKS_MAX:
                self._periods.clear()

    def _receive(self, row: Any, wait_s: float) -> bool:
        """Reads what comes in within a time; returns whether this tick has been answered."""
        if self._peer is None:
            return False
        self._peer.settimeout(wait_s)
        try:
            data = self._peer.recv(READ_MAX)
        except (TimeoutError, BlockingIOError):
            return False
        except OSError:
            data = b""
        if not data:
            self._lose()
            return False
        for frame in self._reader.feed(data):
            if frame.kind.msg_id == ACTUATORS_ID:
                self._take(frame.kind.unpack(frame.payload), row)
        return self._answered_us >= self._time_us

    def _take(self, fields: Any, row: Any) -> None:
        """One HIL_ACTUATOR_CONTROLS."""
        time_us = min(int(fields.time_usec), self._time_us)
        passed = (time_us - self._answered_us) // TICK_US
        if self._answered_us and 0 < passed <= PERIOD_TICKS_MAX:
            self._periods.append(passed)
        self._answered_us = time_us
        self.is_armed = bool(fields.mode & SAFETY_ARMED)
        controls = [value if value == value else 0.0 for value in fields.controls]
        row[: len(self._channels)] = commands_of(self._channels, controls)

    def _lose(self) -> None:
        """It has gone; it may come again."""
        if self._peer is not None:
            self._peer.close()
            self._peer = None

    def close(self) -> None:
        self._lose()
        self._server.close()
