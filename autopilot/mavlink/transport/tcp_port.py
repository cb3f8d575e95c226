"""The vehicle's TCP port, off by default: a link for each client that connects, as Mission Planner expects at 5760.

In and out: a stream of bytes per client, polled at 50 Hz. What a client does not read waits in a bounded queue; frames
that find it full are dropped whole, so that the stream stays readable. A web page can make a browser connect and send
what it likes behind a header of HTTP: who does not begin with MAVLink is not listened to.
"""

import select
import socket
from collections.abc import Sequence
from contextlib import suppress

from autopilot.mavlink.transport.links import (
    GIVE_WAY_US,
    LOOPBACK,
    Link,
    LinkRole,
    address_of,
    bound_socket,
    is_loopback,
)
from autopilot.mavlink.wire.codec import MAGIC_V1, MAGIC_V2, FrameReader, known_type

PEERS_MAX = 32  # one that has said nothing gives way first, then one that has been silent; else the newcomer
ACCEPTS_PER_POLL_MAX = 8
READ_MAX = 16_384  # [byte] of one client in one frame; the rest waits in its socket
UNSENT_MAX = 262_144  # [byte] per client
PROOF_MAX = 1_024  # [byte] in which a client's first frame has to be
_MAGIC = (MAGIC_V1, MAGIC_V2)
_HEARTBEAT_ID = known_type("HEARTBEAT").msg_id.to_bytes(3, "little")

_FAULTS = select.POLLERR | select.POLLHUP | select.POLLNVAL


class TcpPeer:
    """The link to whoever is at the other end of a stream: one client, or of a client the port."""

    keeps_datagrams = False
    is_internal = False

    def __init__(self, stream: socket.socket, address: str, role: LinkRole, heard_us: int) -> None:
        self.role = role
        self.is_trusted = is_loopback(address)
        self.heard_us = heard_us
        self.is_ready = False
        self.is_over = False
        self._socket = stream
        self._unsent = bytearray()
        stream.setblocking(False)
        stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def fileno(self) -> int:
        return self._socket.fileno()

    def connect(self, address: tuple[str, int]) -> None:
        """Begins to connect; what is sent meanwhile waits. A failure shows when it is read."""
        self._socket.connect_ex(address)

    def receive(self) -> Sequence[bytes]:
        if not self.is_ready:
            return ()
        self.is_ready = False
        try:
            data = self._socket.recv(READ_MAX)
        except BlockingIOError:
            return ()
        except OSError:
            data = b""
        if not data:
            self.is_over = True
            return ()
        return (data,)

    def send(self, data: bytes) -> None:
        """Sends one frame, after those that wait; drops it if too much waits."""
        if self._unsent:
            if len(self._unsent) + len(data) <= UNSENT_MAX:
                self._unsent += data
            return
        sent = self._write(data)
        if sent < len(data):
            self._unsent += data[sent:]

    def flush(self) -> None:
        """Sends what waits, as far as the client takes it."""
        if self._unsent:
            del self._unsent[: self._write(self._unsent)]

    def _write(self, data: bytes | bytearray) -> int:
        try:
            return self._socket.send(data)
        except BlockingIOError:
            return 0
        except OSError:  # the client has gone
            self.is_over = True
            return len(data)

    def close(self) -> None:
        self._socket.close()


class TcpGuest(TcpPeer):
    """The link to a client of the port. Until its first frame it gets heartbeats only, and nothing of it is heard."""

    def __init__(self, stream: socket.socket, address: str, role: LinkRole, heard_us: int) -> None:
        super().__init__(stream, address, role, heard_us)
        self.is_heard = False  # a message with a right checksum has come in
        self._early = b""  # what has come in before
        self._reader = FrameReader()

    def receive(self) -> Sequence[bytes]:
        pieces = super().receive()
        if self.is_heard or not pieces:
            return pieces
        self._early += pieces[0]
        if self._early[0] not in _MAGIC:
            self.is_over = True
        elif self._reader.feed(pieces[0][:PROOF_MAX]):
            self.is_heard = True
            return (self._early,)
        elif len(self._early) > PROOF_MAX:
            self.is_over = True
        return ()

    def send(self, data: bytes) -> None:
        if self.is_heard or data[7:10] == _HEARTBEAT_ID:
            super().send(data)


class TcpPort:
    """Listens for clients.

    Args:
        port: 0: any free one.
        bind: the address the port is open at.
        role: who the clients are.
        give_way_us: of too many clients one that has been silent for so long gives way to a newcomer.

    Raises:
        LinkError: the address is not this machine's, or the port is taken.
    """

    def __init__(
        self, port: int, *, bind: str = LOOPBACK, role: LinkRole = LinkRole.GROUND, give_way_us: int = GIVE_WAY_US
    ) -> None:
        self._role, self._give_way_us = role, give_way_us
        self._socket = bound_socket(socket.SOCK_STREAM, address_of(bind), port)
        self._socket.listen(ACCEPTS_PER_POLL_MAX)
        self.local_port: int = self._socket.getsockname()[1]
        self._poller = select.poll()
        self._poller.register(self._socket, select.POLLIN)
        self._by_fileno: dict[int, TcpGuest] = {}
        self.links: Sequence[Link] = ()

    def poll(self, time_us: int) -> None:
        """Accepts clients, notes whose bytes have come in, sends what waited and forgets who has gone."""
        for fileno, event in self._poller.poll(0):
            peer = self._by_fileno.get(fileno)
            if peer is None:
                self._accept(time_us)
            else:
                peer.is_ready = True
                peer.heard_us = time_us
                peer.is_over |= bool(event & _FAULTS) and not event & select.POLLIN
        for peer in [*self._by_fileno.values()]:
            peer.flush()
            if peer.is_over:
                self._drop(peer)

    def _accept(self, time_us: int) -> None:
        for _ in range(ACCEPTS_PER_POLL_MAX):
            try:
                stream, address = self._socket.accept()
            except OSError:  # no more, one that has gone already, or no descriptor for it
                return
            if not self._has_room(time_us):
                stream.close()
                continue
            peer = TcpGuest(stream, address[0], self._role, time_us)
            self._by_fileno[peer.fileno()] = peer
            self._poller.register(peer, select.POLLIN)
            self.links = tuple(self._by_fileno.values())

    def _has_room(self, time_us: int) -> bool:
        """Whether there may be one more client; makes room for it if somebody has to give way."""
        if len(self._by_fileno) < PEERS_MAX:
            return True
        first = min(self._by_fileno.values(), key=lambda peer: (peer.is_heard, peer.heard_us))
        if first.is_heard and time_us - first.heard_us < self._give_way_us:
            return False
        self._drop(first)
        return True

    def _drop(self, peer: TcpGuest) -> None:
        self._poller.unregister(peer)
        del self._by_fileno[peer.fileno()]
        peer.close()
        self.links = tuple(self._by_fileno.values())

    def close(self) -> None:
        for peer in self._by_fileno.values():
            with suppress(OSError):
                peer.flush()
            peer.close()
        self._socket.close()
