"""Which frame goes on to which link: the vehicle joins its links into one MAVLink network.

In: every frame that comes in, before it is looked at. Out: the same bytes, signature included, on the other links that
need them. Everything not addressed to us alone goes on, of unknown kinds too: to all if it addresses all, else to where
the addressee has been heard. Nothing goes back where it came from.
"""

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from typing import Any, Protocol

from autopilot.mavlink.wire.codec import Frame, known_type

LOOP_US = 500_000  # guess: a frame that comes back sooner, over another link, has gone round a loop
RECENT_MAX = 256  # frames remembered against loops

# A key is a secret between two ends, and a radio's report is about its own link.
_NEVER_FORWARDED = {known_type(name).msg_id for name in ("SETUP_SIGNING", "RADIO_STATUS", "RADIO")}


class Port(Protocol):
    """One link of a network."""

    heard: Any
    """Notes who is there: autopilot.mavlink.channel.Heard."""

    def pass_on(self, frame: bytes) -> None: ...


class Network(Protocol):
    """What is joined: a vehicle's endpoint (autopilot.mavlink.channel.Endpoint), or a hub."""

    sysid: int
    time_us: int
    sent_count: int

    @property
    def compids(self) -> AbstractSet[int]: ...

    @property
    def channels(self) -> Sequence[Port]: ...


class Router:
    """Passes frames on between the channels of an endpoint."""

    def __init__(self, endpoint: Network) -> None:
        self._endpoint = endpoint
        self._recent: dict[bytes, tuple[Port, int]] = {}  # frame -> where it came in, and when; oldest first

    def route(self, channel: Port, frame: Frame, target_system: int, target_component: int) -> None:
        """Passes a frame on that has come in on `channel` from somebody else, and remembers who is there.

        Args:
            channel: where it came in.
            frame: what came in.
            target_system: whom it is for; 0: all.
            target_component: which device of it; 0: all.
        """
        endpoint = self._endpoint
        if target_system == endpoint.sysid and target_component in endpoint.compids:
            channel.heard.note(frame.sysid, frame.compid)
            return
        if self._has_gone_round(channel, frame):
            return
        channel.heard.note(frame.sysid, frame.compid)
        if len(endpoint.channels) == 1 or frame.kind.msg_id in _NEVER_FORWARDED:
            return
        for other in endpoint.channels:
            if other is not channel and (target_system == 0 or other.heard.has(target_system, target_component)):
                other.pass_on(frame.raw)
                endpoint.sent_count += 1

    def _has_gone_round(self, channel: Port, frame: Frame) -> bool:
        """Whether the same bytes came in on another channel a moment ago."""
        recent, now_us = self._recent, self._endpoint.time_us
        before = recent.get(frame.raw)
        if before is not None and before[0] is not channel and now_us - before[1] < LOOP_US:
            return True
        recent.pop(frame.raw, None)
        recent[frame.raw] = (channel, now_us)
        if len(recent) > RECENT_MAX:
            del recent[next(iter(recent))]
        return False
