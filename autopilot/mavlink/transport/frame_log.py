"""The frames of all channels as one stream, for the telemetry log: counted once per sender, as log tools expect.

Each channel counts its frames for itself, and so does each client; in one file those numbers would look like losses.
Here each sender's frames are numbered anew where they are not in step, and what was really lost stays a gap.
"""

from collections.abc import Callable, Sequence

from autopilot.mavlink.wire.codec import SIGNED_FLAG, Frame, MessageType, Payload, frame_bytes

OnFrame = Callable[[int, bytes], None]

_SENDERS_MAX = 256  # on all channels; of too many, all are forgotten
_FLAGS_AT, _SEQ_AT = 2, 4  # in a MAVLink 2 frame


class FrameLog:
    """Gives frames to the log.

    Args:
        on_frame: gets simulated time [us] and each frame.
        sysid: the vehicle's own.
    """

    __slots__ = ("_heard", "_on_frame", "_own", "_seqs", "_sysid")

    def __init__(self, on_frame: OnFrame, sysid: int) -> None:
        self._on_frame = on_frame
        self._sysid = sysid
        self._own = [-1] * 256  # the vehicle's newest in the log, by component
        self._seqs: dict[tuple[int, int], int] = {}  # the others' newest in the log, by system and component
        self._heard: dict[tuple[int, int, int], int] = {}  # the newest on a channel, by its number and the sender

    def sent(self, time_us: int, kind: MessageType, payload: bytes, compid: int, frame: bytes) -> None:
        """Logs a message of the vehicle's, unsigned: `frame` as it was sent, if its number is in step."""
        self.sent_all(time_us, [(kind, payload)], compid, [frame])

    def sent_all(self, time_us: int, messages: Sequence[Payload], compid: int, frames: Sequence[bytes]) -> None:
        """Logs messages of one component, as `sent` does."""
        seq, on_frame = self._own[compid], self._on_frame
        for (kind, payload), frame in zip(messages, frames, strict=True):
            seq = seq + 1 & 0xFF
            if frame[_SEQ_AT] == seq and not frame[_FLAGS_AT] & SIGNED_FLAG:
                on_frame(time_us, frame)
            else:
                on_frame(time_us, frame_bytes(kind, payload, seq, self._sysid, compid))
        self._own[compid] = seq

    def received(self, time_us: int, frame: Frame, channel: int) -> None:
        """Logs a frame that came in on a channel: as it is, if its number is in step."""
        sender = (frame.sysid, frame.compid)
        if len(self._heard) >= _SENDERS_MAX:
            self._heard.clear()
        last = self._heard.get((channel, *sender))
        self._heard[(channel, *sender)] = frame.seq
        if sender not in self._seqs:
            self._seqs[sender] = frame.seq
        elif self._next(sender, 1 if last is None else frame.seq - last & 0xFF) != frame.seq:
            seq = self._seqs[sender]
            if frame.kind.crc_extra:  # a checksum of ours needs to know the message
                self._on_frame(time_us, frame_bytes(frame.kind, frame.payload, seq, *sender))
                return
        self._on_frame(time_us, frame.raw)

    def _next(self, sender: tuple[int, int], step: int) -> int:
        if len(self._seqs) >= 2 * _SENDERS_MAX:
            self._seqs.clear()
        seq = self._seqs[sender] = self._seqs.get(sender, -1) + step & 0xFF
        return seq
