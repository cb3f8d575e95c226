"""The flight log as a stream, as PX4 sends it: definitions one by one and acknowledged, then data as it comes.

In: LOGGING_START, LOGGING_STOP, LOGGING_ACK; whole ULog records from the host. Out: LOGGING_DATA_ACKED, LOGGING_DATA.
A client that falls behind loses whole records and is told so by ULog's own dropout record.
"""

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.platform import LogStream
from autopilot.interface.vehicle_state import ACCEPTED, Reply, Severity, Verdict
from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.service import Command, CommandHandler, Handler, Service, denied
from autopilot.mavlink.wire.codec import known_type

PIECE_BYTES = 249
PIECES_PER_FRAME = 16  # per client: 199 KB/s, three times what a flight log grows by
RESEND_US = 200_000
GIVE_UP_US = 30_000_000  # a client whose clock runs slower than ours has as long as this
QUEUE_BYTES_MAX = 1 << 20
CLIENTS_MAX = 4
NO_START = 255  # first_message_offset of a piece in which no record begins
_FILE_HEADER_BYTES = 16
_RECORD_HEADER_BYTES = 3  # size and kind

_LOGGING_DATA = known_type("LOGGING_DATA")
_LOGGING_DATA_ACKED = known_type("LOGGING_DATA_ACKED")

Piece = tuple[int, bytes]  # first_message_offset, data


class PieceCutter:
    """Cuts a stream of whole records into pieces that say where the first record in them begins."""

    def __init__(self) -> None:
        self._rest = bytearray()
        self._cut = 0  # bytes taken so far
        self._starts: deque[int] = deque()  # of records not yet taken, counted from the stream's beginning

    def add(self, records: bytes, start: int = 0) -> None:
        """Appends whole records; the first stands at `start`, and what is in front of it is a record of its own."""
        base = self._cut + len(self._rest)
        if start:
            self._starts.append(base)
        at = start
        while at < len(records):
            self._starts.append(base + at)
            at += _RECORD_HEADER_BYTES + int.from_bytes(records[at : at + 2], "little")
        self._rest += records

    def take(self, *, is_last: bool) -> Piece | None:
        """The next full piece; what is left over only if nothing will follow soon."""
        if len(self._rest) < (1 if is_last else PIECE_BYTES):
            return None
        data = bytes(self._rest[:PIECE_BYTES])
        del self._rest[:PIECE_BYTES]
        first = self._starts[0] - self._cut if self._starts else NO_START
        self._cut += len(data)
        while self._starts and self._starts[0] < self._cut:
            self._starts.popleft()
        return first if first < len(data) else NO_START, data


class _Stream:
    """What one client gets."""

    def __init__(self, sender: Sender, send: Callable[[Any, bytes], None]) -> None:
        self.sender = sender
        self._send = send
        self._definitions: deque[Piece] = deque()
        self._cutter = PieceCutter()
        self._records: deque[bytes] = deque()
        self._queued_bytes = 0
        self._is_dropping = False
        self._seq = 0
        self._sent_us = -1  # the definition that waits for its acknowledgement; -1: none has been sent
        self._waiting_since_us = 0

    def begin(self, header: bytes, time_us: int) -> None:
        cutter = PieceCutter()
        cutter.add(header, _FILE_HEADER_BYTES)
        while (piece := cutter.take(is_last=True)) is not None:
            self._definitions.append(piece)
        self._waiting_since_us = time_us

    def data(self, records: bytes) -> None:
        """Takes whole records; too many are dropped."""
        if self._queued_bytes + len(records) > QUEUE_BYTES_MAX:
            self._is_dropping = True
            return
        if self._is_dropping:
            self._is_dropping = False
            self._queue(_dropout())
        self._queue(records)

    def _queue(self, records: bytes) -> None:
        self._records.append(records)
        self._queued_bytes += len(records)

    def acknowledged(self, seq: int, time_us: int) -> None:
        if self._definitions and self._sent_us >= 0 and seq == self._seq:
            self._definitions.popleft()
            self._seq = self._seq + 1 & 0xFFFF
            self._sent_us = -1
            self._waiting_since_us = time_us
            self.frame(time_us)

    def frame(self, time_us: int) -> bool:
        """Sends what is due; False: the client does not answer."""
        if self._definitions:
            if self._sent_us < 0 or time_us - self._sent_us >= RESEND_US:
                self._send_piece(_LOGGING_DATA_ACKED, self._definitions[0])
                self._sent_us = time_us
            return time_us - self._waiting_since_us < GIVE_UP_US
        for _ in range(PIECES_PER_FRAME):
            piece = self._next_piece()
            if piece is None:
                break
            self._send_piece(_LOGGING_DATA, piece)
            self._seq = self._seq + 1 & 0xFFFF
        return True

    def _next_piece(self) -> Piece | None:
        piece = self._cutter.take(is_last=not self._records)
        while piece is None and self._records:
            records = self._records.popleft()
            self._queued_bytes -= len(records)
            self._cutter.add(records)
            piece = self._cutter.take(is_last=not self._records)
        return piece

    def _send_piece(self, kind: Any, piece: Piece) -> None:
        first, data = piece
        content = tuple(data.ljust(PIECE_BYTES, b"\0"))
        self._send(kind, kind.pack(self.sender.sysid, self.sender.compid, self._seq, len(data), first, content))


class LogStreamingService(Service):
    """Streams the running flight's log to clients."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._streams: dict[Sender, _Stream] = {}
        self._beginning: dict[Sender, _Stream] = {}  # of which the definitions are not made yet

    def messages(self) -> Mapping[str, Handler]:
        return {"LOGGING_ACK": self.acknowledged}

    def commands(self) -> Mapping[int, CommandHandler]:
        return {mavlink.MAV_CMD_LOGGING_START: self._start, mavlink.MAV_CMD_LOGGING_STOP: self._stop}

    def _start(self, command: Command) -> Reply:
        """Streams the flight log to the sender, from its definitions on; asked again, it starts again.

        Params: p1 format, 0 (or NaN) for ULog.
        Refused: DENIED: another format; UNSUPPORTED: the vehicle keeps no log; TEMPORARILY_REJECTED: four clients have
        it already.
        """
        if command.p1 > 0.0:
            return denied("the log is a ULog: parameter 1 must be 0")
        log = self._endpoint.vehicle.host.log_stream
        if log is None:
            return Reply(Verdict.UNSUPPORTED, "no log is kept")
        self._end(log, command.sender)
        if len(self._streams) >= CLIENTS_MAX:
            return Reply(Verdict.TEMPORARILY_REJECTED, f"{CLIENTS_MAX} clients have the log already")
        sender, endpoint = command.sender, self._endpoint
        stream = _Stream(sender, lambda kind, payload: endpoint.reply(sender, kind, payload))
        self._streams[sender] = self._beginning[sender] = stream
        return ACCEPTED

    def _stop(self, command: Command) -> Reply:
        """Ends the stream to the sender; without one it changes nothing.

        Params: none.
        Refused: never.
        """
        log = self._endpoint.vehicle.host.log_stream
        if log is not None:
            self._end(log, command.sender)
        return ACCEPTED

    def _end(self, log: LogStream, sender: Sender) -> None:
        stream = self._streams.pop(sender, None)
        is_beginning = self._beginning.pop(sender, None) is not None
        if stream is not None and not is_beginning:
            log.stop_listening(stream.data)

    def acknowledged(self, sender: Sender, fields: Any) -> None:
        """Sends the next piece of the definitions."""
        stream = self._streams.get(sender)
        if stream is not None:
            stream.acknowledged(fields.sequence, self._endpoint.time_us)

    def frame(self) -> None:
        """Sends the next pieces of every stream. One begins per frame: making the definitions takes a millisecond."""
        if not self._streams:
            return
        log = self._endpoint.vehicle.host.log_stream
        if self._beginning and log is not None:
            stream = self._beginning.pop(next(iter(self._beginning)))
            stream.begin(log.listen(stream.data), self._endpoint.time_us)
        for sender, stream in list(self._streams.items()):
            if not stream.frame(self._endpoint.time_us) and log is not None:
                self._end(log, sender)
                self._endpoint.text(Severity.WARNING, "Log streaming ended: the client does not acknowledge")


def _dropout() -> bytes:
    """ULog's record of a gap; how long it is the records around it tell, the field only says that there is one."""
    return b"\x02\x00O" + (1).to_bytes(2, "little")
