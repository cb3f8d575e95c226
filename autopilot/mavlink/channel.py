"""What the services share: a channel per link, the sender of a message, and the vehicle's endpoint on all channels."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from autopilot.mavlink.codec import FrameReader, MessageType, frame_bytes, known_type
from autopilot.mavlink.dialects import Dialect
from autopilot.mavlink.links import Link
from autopilot.mavlink.parameter_view import ParameterView
from autopilot.mavlink.streams import StreamSchedule, Telemetry
from autopilot.vehicle import Severity, Vehicle

AUTOPILOT_COMPONENT = 1  # MAV_COMP_ID_AUTOPILOT1
TEXT_LENGTH = 50  # characters of one STATUSTEXT
TEXT_REPEAT_US = 10_000_000  # for texts that a polling client would repeat; stations hide repeats as long
TEXTS_REMEMBERED_MAX = 100

OnFrame = Callable[[int, bytes], None]

_STATUSTEXT = known_type("STATUSTEXT")


class Channel:
    """One link with its sequence number, its reader and its telemetry schedule."""

    def __init__(self, link: Link, sysid: int, schedule: StreamSchedule) -> None:
        self.link = link
        self.schedule = schedule
        self.reader = FrameReader()
        self.is_mute = False  # sends nothing: a lost radio, on request
        self.clients: set[tuple[int, int]] = set()  # (sysid, compid) that have sent a heartbeat
        self._sysid = sysid
        self._seq = 0
        self._component_seqs: dict[int, int] = {}  # clients count losses per component

    def send(self, kind: MessageType, payload: bytes, compid: int = AUTOPILOT_COMPONENT) -> bytes:
        """Sends one message and returns its frame."""
        if compid == AUTOPILOT_COMPONENT:
            seq = self._seq
            self._seq = seq + 1 & 0xFF
        else:
            seq = self._component_seqs.get(compid, 0)
            self._component_seqs[compid] = seq + 1 & 0xFF
        frame = frame_bytes(kind, payload, seq, self._sysid, compid)
        if not self.is_mute:
            self.link.send(frame)
        return frame


@dataclass(frozen=True, slots=True)
class Sender:
    """Who sent a message, and on which channel the answer goes."""

    channel: Channel
    sysid: int
    compid: int


class Endpoint:
    """The vehicle on all its channels: one identity, one voice."""

    def __init__(
        self, vehicle: Vehicle, links: Sequence[Link], dialect: Dialect, sysid: int, on_frame: OnFrame | None
    ) -> None:
        self.vehicle = vehicle
        self.dialect = dialect
        self.sysid = sysid
        self.time_us = 0
        self.compids = {AUTOPILOT_COMPONENT}  # the vehicle's components behind these links
        self.parameters = ParameterView(vehicle.params, dialect)
        self.telemetry = Telemetry(dialect, sysid)
        self.channels = [Channel(link, sysid, StreamSchedule(self.telemetry, link.role)) for link in links]
        self._on_frame = on_frame
        self._text_id = 0
        self._texts_until_us: dict[str, int] = {}

    def reply(self, sender: Sender, kind: MessageType, payload: bytes, compid: int = AUTOPILOT_COMPONENT) -> None:
        """Sends a message on the channel of `sender`."""
        frame = sender.channel.send(kind, payload, compid)
        if self._on_frame is not None:
            self._on_frame(self.time_us, frame)

    def broadcast(self, kind: MessageType, payload: bytes, compid: int = AUTOPILOT_COMPONENT) -> None:
        """Sends a message on every channel; the frame log gets it once."""
        for i, channel in enumerate(self.channels):
            frame = channel.send(kind, payload, compid)
            if i == 0 and self._on_frame is not None:
                self._on_frame(self.time_us, frame)

    def received(self, frame: bytes) -> None:
        """Shows a received frame to the frame log."""
        if self._on_frame is not None:
            self._on_frame(self.time_us, frame)

    def send_streams(self) -> None:
        """Sends the telemetry that is due; the frame log gets the first channel's."""
        state = self.vehicle.state
        for i, channel in enumerate(self.channels):
            send = channel.send if i or self._on_frame is None else self._send_logged
            channel.schedule.send_due(self.time_us, state, send)

    def _send_logged(self, kind: MessageType, payload: bytes) -> None:
        frame = self.channels[0].send(kind, payload)
        if self._on_frame is not None:
            self._on_frame(self.time_us, frame)

    def is_for_us(self, target_system: int, target_component: int) -> bool:
        """Whether a message is addressed to one of our components; 0 addresses all."""
        return target_system in (0, self.sysid) and (target_component == 0 or target_component in self.compids)

    def text(self, severity: Severity, text: str, to: Sender | None = None) -> None:
        """Sends a text to everyone, or to one sender; beyond 50 characters in several pieces."""
        encoded = text.encode("ascii", "replace")
        text_id = 0
        if len(encoded) > TEXT_LENGTH:
            self._text_id = text_id = self._text_id % 0xFFFF + 1
        for i, start in enumerate(range(0, max(len(encoded), 1), TEXT_LENGTH)):
            payload = _STATUSTEXT.pack(severity, encoded[start : start + TEXT_LENGTH], text_id, i)
            if to is None:
                self.broadcast(_STATUSTEXT, payload)
            else:
                self.reply(to, _STATUSTEXT, payload)

    def text_once(self, severity: Severity, text: str) -> None:
        """Sends a text unless the same was sent in the last 10 s."""
        if self._texts_until_us.get(text, -1) > self.time_us:
            return
        if len(self._texts_until_us) >= TEXTS_REMEMBERED_MAX:
            self._texts_until_us.clear()
        self._texts_until_us[text] = self.time_us + TEXT_REPEAT_US
        self.text(severity, text)
