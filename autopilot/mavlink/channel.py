"""What the services share: a channel per client, the sender of a message, and the vehicle's endpoint on all channels.

In: links, which come and go with the clients. Out: frames: an answer on the channel of who asked, an announcement on
all of them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from autopilot.interface.vehicle_interface import Vehicle
from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.boot_clock import BootClock
from autopilot.mavlink.dialects import Dialect
from autopilot.mavlink.services.parameter_view import ParameterView
from autopilot.mavlink.telemetry.telemetry_rates import StreamSchedule, Telemetry
from autopilot.mavlink.transport.frame_log import FrameLog, OnFrame
from autopilot.mavlink.transport.links import FixedLinks, Link, LinkSource
from autopilot.mavlink.transport.receive_queue import Intake
from autopilot.mavlink.wire.codec import SIGNED_FLAG, Frame, MessageType, Payload, frame_bytes, known_type
from autopilot.mavlink.wire.signing import MemoryStore, Signer, SigningConfig
from common.clock import SIMULATED_EPOCH_US

AUTOPILOT_COMPONENT = 1  # MAV_COMP_ID_AUTOPILOT1
TEXT_LENGTH = 50  # characters of one STATUSTEXT
TEXT_REPEAT_US = 10_000_000  # for texts that a polling client would repeat; stations hide repeats as long
TEXTS_REMEMBERED_MAX = 100
TEXT_PERIOD_US = 200_000  # texts to all that one client may cause in the long run,
TEXT_BURST_US = 4_000_000  # and ahead of that; what is beyond goes to that client alone
HEARD_MAX = 64  # systems and components per channel
CLIENTS_MAX = 32  # greeted per channel

_STATUSTEXT = known_type("STATUSTEXT")


class Heard:
    """Who has been heard on a channel; of too many, the first is forgotten."""

    def __init__(self) -> None:
        self._sources: dict[tuple[int, int], None] = {}  # (sysid, compid)
        self._last = (0, 0)

    def note(self, sysid: int, compid: int) -> None:
        source = (sysid, compid)
        if source == self._last or sysid == 0:
            return
        self._last = source
        self._sources[source] = None
        if len(self._sources) > HEARD_MAX:
            del self._sources[next(iter(self._sources))]

    def has(self, sysid: int, compid: int) -> bool:
        """Whether this system is there, and in it this component (0: any)."""
        if compid == 0:
            return any(source[0] == sysid for source in self._sources)
        return (sysid, compid) in self._sources


class Channel:
    """One client's end of a link: its sequence number, its queue and its telemetry schedule."""

    def __init__(self, link: Link, number: int, sysid: int, schedule: StreamSchedule) -> None:
        self.link = link
        self.signer: Signer | None = None  # while there is a key
        self.number = number
        self.schedule = schedule
        self.intake = Intake(link)
        self.heard = Heard()
        self.is_open = True  # False once the client has gone; what is sent then is lost
        self.is_mute = False  # sends nothing: a lost radio, on request
        self.clients: set[tuple[int, int]] = set()  # (sysid, compid) that have been greeted
        self.texts_due_us = 0  # when the texts to all that it has caused will have been due at the allowed rate
        self._sysid = sysid
        self._seq = 0
        self._component_seqs: dict[int, int] = {}  # clients count losses per component

    def send(self, kind: MessageType, payload: bytes, compid: int = AUTOPILOT_COMPONENT) -> bytes:
        """Sends one message; returns its frame."""
        if compid == AUTOPILOT_COMPONENT:
            seq = self._seq
            self._seq = seq + 1 & 0xFF
        else:
            seq = self._component_seqs.get(compid, 0)
            self._component_seqs[compid] = seq + 1 & 0xFF
        if self.signer is None:
            frame = frame_bytes(kind, payload, seq, self._sysid, compid)
        else:
            frame = frame_bytes(kind, payload, seq, self._sysid, compid, SIGNED_FLAG)
            frame += self.signer.signature(frame, self.number & 0xFF)
        if not self.is_mute:
            self.link.send(frame)
        return frame

    def send_all(self, messages: Sequence[Payload]) -> list[bytes]:
        """Sends messages of the autopilot's, one after the other; returns their frames."""
        if self.signer is not None:
            return [self.send(kind, payload) for kind, payload in messages]
        frames, seq, sysid = [], self._seq, self._sysid
        for kind, payload in messages:
            frames.append(frame_bytes(kind, payload, seq, sysid, AUTOPILOT_COMPONENT))
            seq = seq + 1 & 0xFF
        self._seq = seq
        if not self.is_mute:
            send = self.link.send
            for frame in frames:
                send(frame)
        return frames

    def pass_on(self, frame: bytes) -> None:
        """Sends a frame of somebody else's, as it is."""
        if not self.is_mute:
            self.link.send(frame)


@dataclass(frozen=True, slots=True)
class Sender:
    """Who sent a message, and on which channel the answer goes."""

    channel: Channel
    sysid: int
    compid: int


class Endpoint:
    """The vehicle on all its channels: one identity, one voice."""

    def __init__(
        self,
        vehicle: Vehicle,
        links: Sequence[Link | LinkSource],
        dialect: Dialect,
        sysid: int,
        on_frame: OnFrame | None,
        signing: SigningConfig | None = None,
    ) -> None:
        self.vehicle = vehicle
        self.dialect = dialect = dialect.of_vehicle(vehicle.modes, vehicle.ardupilot)
        self.sysid = sysid
        self.time_us = 0
        self.clock = BootClock()
        self._log = None if on_frame is None else FrameLog(on_frame, sysid)
        self.on_request: dict[int, Callable[[Sender], None]] = {}  # by message: who hears that it was asked for
        self.compids = {AUTOPILOT_COMPONENT}  # the vehicle's components behind these links
        self.parameters = ParameterView(vehicle.params, dialect)
        self.telemetry = Telemetry(dialect, sysid, vehicle.host, gimbal=vehicle.gimbal)
        self.needs_ticks = False  # a client gets messages more often than once per frame
        self.sent_count = 0  # frames sent because of somebody's message, for the sharing of work
        self.asker: Channel | None = None  # whose message is being handled
        fixed = FixedLinks([link for link in links if not isinstance(link, LinkSource)])
        self.sources: list[LinkSource] = [fixed, *(link for link in links if isinstance(link, LinkSource))]
        self.signer = Signer(signing or SigningConfig(MemoryStore(), self._simulated_unix_us))
        self._opened_count = 0
        self.channels: list[Channel] = []
        self._links: list[Sequence[Link]] = []  # of each source, as it was when the channels were made
        self._renew_channels()
        self._text_id = 0
        self._texts_until_us: dict[str, int] = {}

    def poll(self) -> None:
        """Lets clients come and go."""
        has_changed = False
        for source, known in zip(self.sources, self._links, strict=True):
            source.poll(self.time_us)
            has_changed |= source.links is not known
        if has_changed:
            self._renew_channels()

    def _renew_channels(self) -> None:
        known = {id(channel.link): channel for channel in self.channels}
        self._links = [source.links for source in self.sources]
        links = [link for links in self._links for link in links]
        self.channels = [known.pop(id(link)) if id(link) in known else self._open(link) for link in links]
        for gone in known.values():
            gone.is_open = False

    def _open(self, link: Link) -> Channel:
        channel = Channel(link, self._opened_count, self.sysid, StreamSchedule(self.telemetry, link.role))
        self._opened_count += 1
        channel.signer = self.signer if self.signer.has_key else None
        channel.is_mute = bool(self.channels) and all(other.is_mute for other in self.channels)
        return channel

    def set_signing_key(self, key: bytes, timestamp: int) -> None:
        """Signs with this key from now on; not at all if it is zero."""
        self.signer.set_up(key, timestamp)
        for channel in self.channels:
            channel.signer = self.signer if self.signer.has_key else None

    def _simulated_unix_us(self) -> int:
        return SIMULATED_EPOCH_US + self.time_us

    def reply(self, sender: Sender, kind: MessageType, payload: bytes, compid: int = AUTOPILOT_COMPONENT) -> None:
        """Sends a message on the channel of `sender`."""
        payload = self._on_clients_clock(kind, payload)
        frame = sender.channel.send(kind, payload, compid)
        self.sent_count += 1
        if self._log is not None:
            self._log.sent(self.time_us, kind, payload, compid, frame)

    def broadcast(self, kind: MessageType, payload: bytes, compid: int = AUTOPILOT_COMPONENT) -> None:
        """Sends a message on every channel; the frame log gets it once."""
        payload = self._on_clients_clock(kind, payload)
        self.sent_count += len(self.channels)
        frames = [channel.send(kind, payload, compid) for channel in self.channels]
        if self._log is not None and frames:
            self._log.sent(self.time_us, kind, payload, compid, frames[0])

    def received(self, channel: Channel, frame: Frame) -> None:
        """Shows a received frame to the frame log."""
        if self._log is not None:
            self._log.received(self.time_us, frame, channel.number)

    def _on_clients_clock(self, kind: MessageType, payload: bytes) -> bytes:
        return self.clock.shown(kind, payload, self.time_us) if self.clock.boot_us else payload

    def send_streams(self) -> None:
        """Sends the telemetry that is due; the frame log gets the first channel's."""
        state = self.vehicle.state
        log, needs_ticks = self._log, False
        built: dict[int, bytes | None] = {}
        for channel in self.channels:
            messages = channel.schedule.due(self.time_us, state, built)
            if self.clock.boot_us:
                messages = [(kind, self._on_clients_clock(kind, payload)) for kind, payload in messages]
            frames = channel.send_all(messages)
            if log is not None:
                log.sent_all(self.time_us, messages, AUTOPILOT_COMPONENT, frames)
                log = None
            needs_ticks = needs_ticks or channel.schedule.needs_ticks
        self.needs_ticks = needs_ticks

    def is_for_us(self, target_system: int, target_component: int) -> bool:
        """Whether a message is addressed to one of our components; 0 addresses all."""
        return target_system in (0, self.sysid) and (target_component == 0 or target_component in self.compids)

    def text(self, severity: Severity, text: str, to: Sender | None = None) -> None:
        """Sends a text to everyone, or to one sender; beyond 50 characters in several pieces.

        A client that causes one text after another gets them alone.
        """
        if to is None and self.asker is not None and not self._may_tell_all(self.asker):
            to = Sender(self.asker, 0, 0)
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

    def _may_tell_all(self, asker: Channel) -> bool:
        if asker.texts_due_us > self.time_us + TEXT_BURST_US:
            return False
        asker.texts_due_us = max(asker.texts_due_us, self.time_us) + TEXT_PERIOD_US
        return True

    def text_once(self, severity: Severity, text: str) -> None:
        """Sends a text unless the same was sent in the last 10 s."""
        if self._texts_until_us.get(text, -1) > self.time_us:
            return
        if len(self._texts_until_us) >= TEXTS_REMEMBERED_MAX:
            self._texts_until_us.clear()
        self._texts_until_us[text] = self.time_us + TEXT_REPEAT_US
        self.text(severity, text)
