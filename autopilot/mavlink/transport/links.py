"""Carriers of MAVLink bytes: what a link is, memory for lockstep flights and tests, and a client's UDP socket.

In and out: bytes. A link has one client at its other end and knows nothing of frames, except that UDP keeps each
datagram whole. Where clients come and go, a `LinkSource` makes a link for each: `udp_port`, `tcp_port`. Polled at 50
Hz.
"""

import socket
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from enum import Enum
from errno import EADDRNOTAVAIL
from typing import Protocol, runtime_checkable

GROUND_STATION_PORT = 14550  # where QGroundControl and MAVProxy listen
OFFBOARD_PORT = 14540  # where MAVSDK listens

LOOPBACK = "127.0.0.1"
PORT_MAX = 65_535
DATAGRAM_MAX = 65_535  # [byte]
DATAGRAMS_PER_POLL_MAX = 1_000  # a flood must not stop the client
MEMORY_CHUNKS_MAX = 100_000  # a reader that never reads must not fill the memory
GIVE_WAY_US = 5_000_000  # guess: some heartbeats missed


class LinkError(Exception):
    """A link that cannot be opened; the text is one sentence for the user."""


class LinkRole(Enum):
    """Who is at the other end; decides the default stream rates."""

    GROUND = "ground station"
    ONBOARD = "offboard client"


class Link(Protocol):
    """A carrier of bytes to and from one client."""

    role: LinkRole
    keeps_datagrams: bool  # each piece received holds whole frames only
    is_trusted: bool  # the other end is on this machine: it may set up signing
    is_internal: bool  # the other end is in this process: its frames need no signature

    def receive(self) -> Sequence[bytes]:
        """What has come in since the last call, oldest first."""
        ...

    def send(self, data: bytes) -> None: ...

    def close(self) -> None: ...


@runtime_checkable
class LinkSource(Protocol):
    """A place where clients come and go."""

    links: Sequence[Link]  # another object each time one has come or gone

    def poll(self, time_us: int) -> None:
        """Looks for new clients and for what has come in; called once per frame before the links are read."""
        ...

    def close(self) -> None: ...


class FixedLinks:
    """Links that are there from the start to the end."""

    def __init__(self, links: Sequence[Link]) -> None:
        self.links = links

    def poll(self, time_us: int) -> None:
        """Nobody comes or goes."""

    def close(self) -> None:
        for link in self.links:
            link.close()


class MemoryLink:
    """One end of a link inside this process; no threads, no clock, nothing lost."""

    keeps_datagrams = False
    is_trusted = True
    is_internal = True

    def __init__(self, inbox: deque[bytes], outbox: deque[bytes], role: LinkRole) -> None:
        self.role = role
        self._inbox = inbox
        self._outbox = outbox
        self.send = outbox.append

    def receive(self) -> Sequence[bytes]:
        if not self._inbox:
            return ()
        pieces = list(self._inbox)
        self._inbox.clear()
        return pieces

    def close(self) -> None:
        """Has nothing to give back."""


def memory_pair(role: LinkRole = LinkRole.GROUND) -> tuple[MemoryLink, MemoryLink]:
    """The vehicle's end and the client's end of a link in memory; `role` is the client's."""
    to_vehicle: deque[bytes] = deque(maxlen=MEMORY_CHUNKS_MAX)
    to_client: deque[bytes] = deque(maxlen=MEMORY_CHUNKS_MAX)
    return MemoryLink(to_vehicle, to_client, role), MemoryLink(to_client, to_vehicle, role)


class UdpLink:
    """A client's socket: sends to one address, and hears what is sent to its own."""

    keeps_datagrams = True
    is_internal = False

    def __init__(
        self, remote_port: int, role: LinkRole = LinkRole.GROUND, host: str = LOOPBACK, local_port: int = 0
    ) -> None:
        """Opens the socket.

        Args:
            remote_port: where the other end listens.
            role: who is there.
            host: its address; the socket is bound to loopback unless this is another machine.
            local_port: 0: any free port.

        Raises:
            LinkError: the address is unknown, or the local port is taken.
        """
        self.role = role
        self._remote = (address_of(host), remote_port)
        self.is_trusted = is_loopback(self._remote[0])
        self._socket = bound_socket(socket.SOCK_DGRAM, LOOPBACK if self.is_trusted else "0.0.0.0", local_port)  # noqa: S104
        self.local_port: int = self._socket.getsockname()[1]

    def receive(self) -> Sequence[bytes]:
        """The datagrams that have come in."""
        datagrams: list[bytes] = []
        for _ in range(DATAGRAMS_PER_POLL_MAX):
            try:
                datagrams.append(self._socket.recv(DATAGRAM_MAX))
            except BlockingIOError:
                break
            except ConnectionError:  # an earlier datagram found nobody at the other end
                continue
        return datagrams

    def send(self, data: bytes) -> None:
        """Sends one datagram; what cannot be delivered is lost, as on any radio."""
        with suppress(OSError):  # nobody there, no route, or no buffer space
            self._socket.sendto(data, self._remote)

    def close(self) -> None:
        self._socket.close()


def address_of(host: str) -> str:
    """The IPv4 address of a host.

    Raises:
        LinkError: it is unknown.
    """
    try:
        return socket.gethostbyname(host)
    except (OSError, UnicodeError) as error:
        raise LinkError(f"MAVLink: the host {host} is unknown.") from error


def is_loopback(address: str) -> bool:
    return address.startswith("127.")


def bound_socket(kind: int, address: str, port: int) -> socket.socket:
    """A non-blocking socket at an address of this machine.

    Args:
        kind: socket.SOCK_DGRAM or socket.SOCK_STREAM.
        address: IPv4 address.
        port: 0: any free one.

    Raises:
        LinkError: the port is taken or does not exist, or the address is not one of this machine.
    """
    name = "UDP" if kind == socket.SOCK_DGRAM else "TCP"
    new = socket.socket(socket.AF_INET, kind)
    try:
        if kind == socket.SOCK_STREAM:  # connections of a vehicle that has just ended do not hold the port
            new.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        new.bind((address, port))
    except OverflowError as error:
        new.close()
        raise LinkError(f"MAVLink: {name} port {port} is not between 0 and {PORT_MAX}.") from error
    except OSError as error:
        new.close()
        if error.errno == EADDRNOTAVAIL:
            raise LinkError(f"MAVLink: {address} is no address of this machine.") from error
        raise LinkError(f"MAVLink: {name} port {port} is in use ({error.strerror}).") from error
    new.setblocking(False)
    return new
