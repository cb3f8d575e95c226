"""A client's end of a link: a script, a companion, a phone. Who speaks, its heartbeat, frames in and out, commands.

In: bytes from the vehicle, and the time. Out: the frames that have arrived, undecoded, and those that the client sends,
with its own numbers. What is done with a frame, and how long an answer is waited for, is the client's own.
"""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, Protocol

from autopilot.mavlink.transport.links import MemoryLink
from autopilot.mavlink.wire.codec import (
    MAGIC_V2,
    SHORTEST_V2,
    Frame,
    FrameReader,
    encode,
    whole_frame,
)

AUTOPILOT_COMPONENT = 1  # MAV_COMP_ID_AUTOPILOT1
HEARTBEAT_PERIOD_US = 1_000_000
GROUND_STATION, ONBOARD_COMPUTER = 6, 18  # MAV_TYPE
IN_PROGRESS = 5  # MAV_RESULT
_NO_AUTOPILOT, _ACTIVE = 8, 4  # MAV_AUTOPILOT, MAV_STATE


class ByteLink(Protocol):
    """A byte pipe to the vehicle (autopilot.mavlink.transport.links has some)."""

    def send(self, data: bytes) -> None: ...

    def receive(self) -> Sequence[bytes]:
        """What has arrived since the last call."""
        ...

    def close(self) -> None: ...


class Arrived(NamedTuple):
    """A frame that has come in, as `frame_of` takes it."""

    msg_id: int
    sysid: int
    compid: int
    frame: Frame | bytes  # bytes: a whole frame that nobody has looked at


class ClientEnd:
    """One client's end of a link.

    Args:
        link: bytes to and from the vehicle.
        system_id: the client's own.
        component_id: the client's own.
        mav_type: what it says that it is.
        vehicle_id: system id of the vehicle.
    """

    def __init__(
        self,
        link: ByteLink,
        system_id: int,
        component_id: int,
        *,
        mav_type: int = ONBOARD_COMPUTER,
        vehicle_id: int = 1,
    ) -> None:
        self.link = link
        self.vehicle_id = vehicle_id
        self._system_id, self._component_id, self._mav_type = system_id, component_id, mav_type
        self._reader = FrameReader()
        self._is_exact = isinstance(link, MemoryLink)  # no byte is changed on the way: no checksum is needed
        self._seq = 0
        self._next_heartbeat_us: int | None = None

    def arrived(self) -> Iterator[Arrived]:
        """What has come in since the last call, oldest first, whoever sent it."""
        for data in self.link.receive():
            if self._is_exact and data[0] == MAGIC_V2 and len(data) == SHORTEST_V2 + data[1] and not data[2]:
                yield Arrived(data[7] | data[8] << 8 | data[9] << 16, data[5], data[6], data)
                continue
            for frame in self._reader.feed(data):
                yield Arrived(frame.kind.msg_id, frame.sysid, frame.compid, frame)

    def keep_alive(self, time_us: int) -> None:
        """Sends the heartbeat when it is due."""
        if self._next_heartbeat_us is None or time_us >= self._next_heartbeat_us:
            self._next_heartbeat_us = time_us + HEARTBEAT_PERIOD_US
            self.send(
                "HEARTBEAT", type=self._mav_type, autopilot=_NO_AUTOPILOT, system_status=_ACTIVE, mavlink_version=3
            )

    def encode(self, name: str, **fields: Any) -> bytes:
        """The next frame of this client."""
        self._seq = self._seq + 1 & 0xFF
        return encode(name, self._system_id, self._component_id, self._seq, **fields)

    def send(self, name: str, **fields: Any) -> None:
        """Sends one message."""
        self.link.send(self.encode(name, **fields))

    def ask(self, name: str, **fields: Any) -> None:
        """Sends one message to the vehicle's autopilot."""
        self.send(name, target_system=self.vehicle_id, target_component=AUTOPILOT_COMPONENT, **fields)

    def command(self, command: int, *params: float, attempt: int = 0) -> None:
        """Sends a COMMAND_LONG; parameters left out are 0."""
        fields = {f"param{k + 1}": float(value) for k, value in enumerate(params)}
        self.ask("COMMAND_LONG", command=command, confirmation=attempt, **fields)

    def is_answer(self, ack: Any, command: int) -> bool:
        """Whether a COMMAND_ACK answers this command, to this client or to everybody."""
        is_for_us = ack.target_system in (0, self._system_id) and ack.target_component in (0, self._component_id)
        return bool(is_for_us and ack.command == command)


def frame_of(frame: Frame | bytes) -> Frame:
    """A frame that has arrived, looked at."""
    if isinstance(frame, Frame):
        return frame
    whole = whole_frame(frame)
    if whole is None:
        raise ValueError("a frame in memory is not what was sent")
    return whole
