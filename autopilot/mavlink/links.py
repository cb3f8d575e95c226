"""Carriers of MAVLink bytes: UDP for ground stations and scripts, memory for lockstep flights and tests.

In and out: bytes. A link knows nothing of frames, except that UDP keeps each datagram whole. Polled at 50 Hz.
"""

import socket
from collections import deque
from collections.abc import Sequence
from enum import Enum
from typing import Protocol

GROUND_STATION_PORT = 14550  # where QGroundControl and MAVProxy listen
OFFBOARD_PORT = 14540  # where MAVSDK listens

PEERS_MAX = 8  # per UDP link; the one heard longest ago gives way
DATAGRAM_MAX = 65_535  # [byte]
DATAGRAMS_PER_POLL_MAX = 1_000  # a flood must not stop the frame
MEMORY_CHUNKS_MAX = 100_000  # a reader that never reads must not fill the memory


class LinkError(Exception):
    """A link that cannot be opened; the text is one sentence for the user."""


class LinkRole(Enum):
    """Who is at the other end; decides the default stream rates."""

    GROUND = "ground station"
    ONBOARD = "offboard client"


class Link(Protocol):
    """A carrier of bytes."""

    role: LinkRole
    keeps_datagrams: bool  # each piece received holds whole frames only

    def receive(self) -> Sequence[bytes]:
        """What has come in since the last call, oldest first."""
        ...

    def send(self, data: bytes) -> None: ...

    def close(self) -> None: ...


class MemoryLink:
    """One end of a link inside this process; no threads, no clock, nothing lost."""

    keeps_datagrams = False

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
    """Sends to one remote address from the start, and to everyone who answers."""

    keeps_datagrams = True

    def __init__(
        self,
        remote_port: int,
        role: LinkRole = LinkRole.GROUND,
        host: str = "127.0.0.1",
        local_port: int = 0,
    ) -> None:
        """Opens the socket.

        Args:
            remote_port: where the client listens.
            role: who the client is.
            host: the client's address; the socket is bound to loopback unless this is another machine.
            local_port: 0: any free port.

        Raises:
            LinkError: the address is unknown, or the local port is taken.
        """
        self.role = role
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._remote = (socket.gethostbyname(host), remote_port)
            local_host = "127.0.0.1" if self._remote[0].startswith("127.") else "0.0.0.0"  # noqa: S104
            self._socket.bind((local_host, local_port))
            self._socket.setblocking(False)
        except socket.gaierror as error:
            self._socket.close()
            raise LinkError(f"MAVLink: the host {host} is unknown.") from error
        except OSError as error:
            self._socket.close()
            raise LinkError(f"MAVLink: UDP port {local_port} is in use ({error.strerror}).") from error
        except OverflowError as error:
            self._socket.close()
            raise LinkError(f"MAVLink: UDP port {local_port} is not between 0 and 65535.") from error
        self.local_port: int = self._socket.getsockname()[1]
        self._peers: list[tuple[str, int]] = [self._remote]

    def receive(self) -> Sequence[bytes]:
        """The datagrams that have come in; learns who sent them."""
        datagrams: list[bytes] = []
        for _ in range(DATAGRAMS_PER_POLL_MAX):
            try:
                data, peer = self._socket.recvfrom(DATAGRAM_MAX)
            except BlockingIOError:
                break
            except ConnectionError:  # an earlier datagram found nobody at the other end
                continue
            self._learn(peer)
            datagrams.append(data)
        return datagrams

    def _learn(self, peer: tuple[str, int]) -> None:
        if peer == self._peers[-1]:
            return
        if peer in self._peers[1:]:
            self._peers.remove(peer)
        elif peer == self._remote:
            return
        self._peers.append(peer)
        if len(self._peers) > PEERS_MAX:
            del self._peers[1]  # the first is the address given at the start

    def send(self, data: bytes) -> None:
        """Sends one datagram to every peer; what cannot be delivered is lost, as on any radio."""
        for peer in self._peers:
            try:
                self._socket.sendto(data, peer)
            except OSError:  # nobody there, no route, or no buffer space
                continue

    def close(self) -> None:
        self._socket.close()
