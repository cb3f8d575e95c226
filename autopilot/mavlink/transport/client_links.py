"""A client's end of a link, opened from its address as MAVSDK writes them.

In: `udpout://HOST:PORT`, where the other end listens; `udpin://ADDRESS:PORT`, where it sends to; `tcp://HOST:PORT`,
where it accepts connections; `serial:///dev/NAME:BAUD`, a cable to it. Out: a link. None of them waits: an end that is
not there yet is spoken to when it is.
"""

import re
import socket
from collections.abc import Sequence
from contextlib import suppress
from urllib.parse import urlsplit

from autopilot.mavlink.transport.links import (
    DATAGRAM_MAX,
    DATAGRAMS_PER_POLL_MAX,
    Link,
    LinkError,
    LinkRole,
    UdpLink,
    address_of,
    bound_socket,
    is_loopback,
)
from autopilot.mavlink.transport.serial_port import SerialLink
from autopilot.mavlink.transport.tcp_port import TcpPeer

KINDS = "udpout://HOST:PORT, udpin://ADDRESS:PORT, tcp://HOST:PORT or serial:///dev/NAME:BAUD"

_SERIAL = re.compile(r"serial://(?P<path>/[^:]+):(?P<baud>[1-9]\d{0,7})")


def open_client_link(url: str, role: LinkRole = LinkRole.ONBOARD) -> Link:
    """The link to an address.

    Args:
        url: where the other end is.
        role: who is there.

    Raises:
        LinkError: it is no such address, the host is unknown, or the port is in use or not there.
    """
    if found := _SERIAL.fullmatch(url):
        return SerialLink(found["path"], int(found["baud"]), role)
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
    except ValueError:
        parts, host, port = urlsplit(""), None, None
    if parts.scheme not in ("udpout", "udpin", "tcp") or not host or not port or parts.path not in ("", "/"):
        raise LinkError(f"{url}: must be {KINDS}")
    if parts.scheme == "udpout":
        return UdpLink(port, role, host)
    if parts.scheme == "udpin":
        return ListeningLink(port, role, host)
    return TcpLink(port, role, host)


class ListeningLink:
    """A UDP port that somebody sends to; whoever was heard last is answered.

    Args:
        port: where it listens.
        role: who is expected.
        address: of this machine.

    Raises:
        LinkError: the address is not this machine's, or the port is taken.
    """

    keeps_datagrams = True
    is_internal = False

    def __init__(self, port: int, role: LinkRole, address: str) -> None:
        self.role = role
        own = address_of(address)
        self.is_trusted = is_loopback(own)
        self._socket = bound_socket(socket.SOCK_DGRAM, own, port)
        self._remote: tuple[str, int] | None = None

    def receive(self) -> Sequence[bytes]:
        datagrams: list[bytes] = []
        for _ in range(DATAGRAMS_PER_POLL_MAX):
            try:
                data, self._remote = self._socket.recvfrom(DATAGRAM_MAX)
            except BlockingIOError:
                break
            except ConnectionError:  # an earlier datagram found nobody at the other end
                continue
            datagrams.append(data)
        return datagrams

    def send(self, data: bytes) -> None:
        """Sends one datagram; nobody gets it before somebody has been heard."""
        if self._remote is not None:
            with suppress(OSError):
                self._socket.sendto(data, self._remote)

    def close(self) -> None:
        self._socket.close()


class TcpLink:
    """A connection; what is sent without one begins it, so that a client that sends heartbeats comes back by itself.

    Args:
        port: where the other end accepts connections.
        role: who is there.
        host: its address.

    Raises:
        LinkError: the host is unknown.
    """

    keeps_datagrams = False
    is_internal = False

    def __init__(self, port: int, role: LinkRole, host: str) -> None:
        self.role = role
        self._address = (address_of(host), port)
        self.is_trusted = is_loopback(self._address[0])
        self._peer: TcpPeer | None = None

    def receive(self) -> Sequence[bytes]:
        peer = self._peer
        if peer is None:
            return ()
        peer.flush()
        peer.is_ready = True  # nobody polls: reading finds out
        data = peer.receive()
        if peer.is_over:
            self.close()
        return data

    def send(self, data: bytes) -> None:
        if self._peer is None:
            self._peer = TcpPeer(socket.socket(socket.AF_INET, socket.SOCK_STREAM), self._address[0], self.role, 0)
            self._peer.connect(self._address)
        self._peer.send(data)

    def close(self) -> None:
        if self._peer is not None:
            self._peer.close()
            self._peer = None
