"""Joins links into one MAVLink network without being a vehicle: an autopilot of others, and who speaks to it.

In: frames on any link. Out: the same bytes on the others, as transport/routing.py says.
"""

from collections.abc import Callable, Sequence

from autopilot.mavlink.channel import Heard
from autopilot.mavlink.transport.links import FixedLinks, Link, LinkSource
from autopilot.mavlink.transport.routing import Router
from autopilot.mavlink.wire.codec import Frame, FrameReader

NOBODY = -1  # a system id that no frame has


class HubPort:
    """One link of a hub."""

    def __init__(self, link: Link) -> None:
        self.link = link
        self.heard = Heard()
        self.reader = FrameReader(keeps_unknown=True)

    def pass_on(self, frame: bytes) -> None:
        self.link.send(frame)


class Hub:
    """The network.

    Args:
        links: what it joins.
        on_frame: gets the time [us] and every frame that has come in, and the link.
    """

    def __init__(
        self, links: Sequence[Link | LinkSource], on_frame: Callable[[int, Frame, Link], None] | None = None
    ) -> None:
        fixed = FixedLinks([link for link in links if not isinstance(link, LinkSource)])
        self._sources: list[LinkSource] = [fixed, *(link for link in links if isinstance(link, LinkSource))]
        self._on_frame = on_frame
        self.sysid, self.compids = NOBODY, frozenset[int]()
        self.time_us = 0
        self.sent_count = 0
        self.channels: list[HubPort] = []
        self._router = Router(self)

    def frame(self, time_us: int) -> None:
        """Passes on what has come in; called at 50 Hz, and while the autopilot is waited for."""
        self.time_us = time_us
        for source in self._sources:
            source.poll(time_us)
        known = {id(port.link): port for port in self.channels}
        links = [link for source in self._sources for link in source.links]
        self.channels = [known.get(id(link)) or HubPort(link) for link in links]
        for port in self.channels:
            for data in port.link.receive():
                for frame in port.reader.feed(data, is_whole=port.link.keeps_datagrams):
                    self._pass_on(port, frame)

    def _pass_on(self, port: HubPort, frame: Frame) -> None:
        if self._on_frame is not None:
            self._on_frame(self.time_us, frame, port.link)
        self._router.route(port, frame, *frame.target())

    def close(self) -> None:
        for source in self._sources:
            source.close()
