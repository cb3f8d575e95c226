"""The vehicle's UDP port: a link for each client that speaks to it, and for the address it speaks to first.

In and out: datagrams. Each client has a connected socket of its own on the same port, so that the kernel queues its
datagrams apart from everybody else's: a client that floods the vehicle fills its own queue only. Polled at 50 Hz; when
nothing has come in, a poll is one system call.
"""

import select
import socket
from collections import deque
from collections.abc import Sequence
from contextlib import suppress

from autopilot.mavlink.transport.links import (
    DATAGRAM_MAX,
    GIVE_WAY_US,
    LOOPBACK,
    Link,
    LinkError,
    LinkRole,
    address_of,
    bound_socket,
    is_loopback,
)
from autopilot.mavlink.wire.codec import begins_with_frame

PEERS_MAX = 32  # per port; one that has been silent gives way, and while none has, a newcomer gets no link
DATAGRAMS_PER_READ_MAX = (
    64  # of one client in one frame; the rest waits in its socket, and what finds that full is lost
)
SILENCE_US = 120_000_000  # guess: clients send a heartbeat every second
CHECK_US = 1_000_000

Address = tuple[str, int]


class UdpPeer:
    """The link to one client."""

    keeps_datagrams = True
    is_internal = False

    def __init__(self, port: "UdpPort", own: Address, address: Address, role: LinkRole, heard_us: int) -> None:
        self.role = role
        self.address = address
        self.is_trusted = is_loopback(address[0])
        self.heard_us = heard_us
        self.is_ready = False
        self.early: deque[bytes] = deque(maxlen=DATAGRAMS_PER_READ_MAX)  # what came to the port's own socket
        self._port = port
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._socket.bind(own)
            self._socket.connect(address)
        except OSError:
            self._socket.close()
            raise

    def fileno(self) -> int:
        return self._socket.fileno()

    def receive(self) -> Sequence[bytes]:
        """The oldest datagrams that have come in."""
        if not self.is_ready:
            return ()
        self.is_ready = False
        datagrams = list(self.early)
        self.early.clear()
        for _ in range(DATAGRAMS_PER_READ_MAX):
            try:
                data, address = self._socket.recvfrom(DATAGRAM_MAX)
            except ConnectionError:  # an earlier datagram found nobody at the other end
                continue
            except OSError:  # no more, or closed
                break
            if address == self.address:
                datagrams.append(data)
            else:  # it came before the socket was connected
                self._port.take(data, address)
        return datagrams

    def send(self, data: bytes) -> None:
        """Sends one datagram; what cannot be delivered is lost, as on any radio."""
        with suppress(OSError):  # nobody there, no route, no buffer space, or closed
            self._socket.send(data)

    def close(self) -> None:
        self._socket.close()


class UdpPort:
    """Speaks to one address from the start, and to everyone who sends it a MAVLink message with a right checksum.

    Args:
        remote_port: where the first client listens.
        role: who the clients are.
        host: the first client's address.
        local_port: 0: any free port.
        bind: the address the port is open at; "": loopback, or the address that leads to `host` if that is another
            machine.
        silence_us: a client that has been silent for so long is forgotten; the first one never is.
        give_way_us: of too many clients one that has been silent for so long gives way to a newcomer.

    Raises:
        LinkError: an address is unknown, or the local port is taken.
    """

    def __init__(
        self,
        remote_port: int,
        role: LinkRole = LinkRole.GROUND,
        host: str = LOOPBACK,
        *,
        local_port: int = 0,
        bind: str = "",
        silence_us: int = SILENCE_US,
        give_way_us: int = GIVE_WAY_US,
    ) -> None:
        self._role = role
        self._silence_us, self._give_way_us = silence_us, give_way_us
        self._remote = (address_of(host), remote_port)
        self._socket = bound_socket(socket.SOCK_DGRAM, address_of(bind or address_towards(host)), local_port)
        # Only now: until here another vehicle on the same port would have been refused.
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._own: Address = self._socket.getsockname()
        self.local_port = self._own[1]
        self._poller = select.poll()
        self._poller.register(self._socket, select.POLLIN)
        self._by_fileno: dict[int, UdpPeer] = {}
        self._peers: dict[Address, UdpPeer] = {}
        self._time_us = 0
        self._next_check_us = 0
        self.links: Sequence[Link] = ()
        try:
            self._add(self._remote)
        except OSError as error:
            self.close()
            raise LinkError(f"MAVLink: no way to {host} from {self._own[0]} ({error.strerror}).") from error

    def poll(self, time_us: int) -> None:
        """Notes whose datagrams have come in, makes links for new clients and forgets silent ones."""
        self._time_us = time_us
        for fileno, event in self._poller.poll(0):
            peer = self._by_fileno.get(fileno)
            if peer is None:
                self._read_newcomers()
            else:
                peer.is_ready = True
                if event & select.POLLIN:
                    peer.heard_us = time_us
        if time_us >= self._next_check_us:
            self._next_check_us = time_us + CHECK_US
            for peer in [*self._peers.values()]:
                if time_us - peer.heard_us > self._silence_us and peer.address != self._remote:
                    self._drop(peer)

    def _read_newcomers(self) -> None:
        for _ in range(DATAGRAMS_PER_READ_MAX):
            try:
                data, address = self._socket.recvfrom(DATAGRAM_MAX)
            except OSError:
                return
            self.take(data, address)

    def take(self, data: bytes, address: Address) -> None:
        """A datagram from an address that may not have a link yet; rubbish makes none, and is answered by nothing."""
        peer = self._peers.get(address)
        if peer is None:
            if not begins_with_frame(data) or not self._has_room():
                return
            try:
                peer = self._add(address)
            except OSError:  # no way there, or no more sockets
                return
        peer.early.append(data)
        peer.is_ready = True
        peer.heard_us = self._time_us

    def _has_room(self) -> bool:
        """Whether there may be one more client; makes room for it if somebody has been silent."""
        if len(self._peers) < PEERS_MAX:
            return True
        oldest = min((peer for peer in self._peers.values() if peer.address != self._remote), key=lambda p: p.heard_us)
        if self._time_us - oldest.heard_us < self._give_way_us:
            return False
        self._drop(oldest)
        return True

    def _add(self, address: Address) -> UdpPeer:
        peer = UdpPeer(self, self._own, address, self._role, self._time_us)
        self._peers[address] = peer
        self._by_fileno[peer.fileno()] = peer
        self._poller.register(peer, select.POLLIN)
        self.links = tuple(self._peers.values())
        return peer

    def _drop(self, peer: UdpPeer) -> None:
        self._poller.unregister(peer)
        del self._by_fileno[peer.fileno()]
        del self._peers[peer.address]
        peer.close()
        self.links = tuple(self._peers.values())

    def close(self) -> None:
        for peer in self._peers.values():
            peer.close()
        self._socket.close()


def address_towards(host: str) -> str:
    """The address of this machine from which `host` is reached: loopback for this machine itself.

    Raises:
        LinkError: the host is unknown, or there is no way to it.
    """
    address = address_of(host)
    if is_loopback(address):
        return LOOPBACK
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((address, 9))  # sends nothing
        except OSError as error:
            raise LinkError(f"MAVLink: no way to {host} ({error.strerror}).") from error
        own: Address = probe.getsockname()
    return own[0]
