"""Who may use the ports that a browser can reach, and how many connections are kept.

A page of any website can make its visitor's browser send requests to this machine. In: the headers of a request. Out:
why it is refused. Host: DNS rebinding gives a foreign page our address, but not our name. Origin and Sec-Fetch-Site:
browsers say which page asks, and pages cannot change it. A token in the address keeps out other programs' guesses.
"""

import secrets
import sys
from collections.abc import Callable, Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socket import SHUT_RDWR, socket
from threading import Lock
from typing import Any, Protocol

from common.clock import wall_sleep_s

LOOPBACK = "127.0.0.1"
CONNECTIONS_MAX = 32  # of one server; one that has not asked for anything yet gives way to a newcomer
REQUEST_S = 10.0  # wall clock; a client that sends or takes nothing for so long is let go
NO_DESCRIPTORS_S = 0.1  # until a connection is tried again that the system had no descriptor for
_OWN_NAMES = {LOOPBACK, "localhost", "[::1]"}
_TOKEN_BYTES = 16


class Headers(Protocol):
    """Of a request, as http.server and websockets have them."""

    def get_all(self, name: str, /) -> Sequence[str] | None: ...


def new_token() -> str:
    """A part of an address that nobody can guess."""
    return secrets.token_urlsafe(_TOKEN_BYTES)


def browser_refusal(headers: Headers) -> str:
    """Why a request is refused that another website's page may have made; "" if it is not."""
    refusal = host_refusal(headers)
    if refusal:
        return refusal
    hosts = headers.get_all("Host") or ()
    if any(origin.lower() != f"http://{hosts[0].lower()}" for origin in headers.get_all("Origin") or ()):
        return "Origin: another website"
    sites, modes = headers.get_all("Sec-Fetch-Site") or (), headers.get_all("Sec-Fetch-Mode") or ()
    has_followed_a_link = tuple(modes) == ("navigate",) and headers.get_all("Sec-Fetch-Dest") == ["document"]
    if any(site.lower() not in ("same-origin", "none") for site in sites) and not has_followed_a_link:
        return "Sec-Fetch-Site: another website"
    return ""


def host_refusal(headers: Headers) -> str:
    """Why a request is refused that was not sent to this machine by its name; "" if it is not."""
    hosts = headers.get_all("Host") or ()
    return "" if len(hosts) == 1 and _name(hosts[0]) in _OWN_NAMES else "Host: not this machine"


def _name(host: str) -> str:
    """Of a Host header, without its port, which an SSH tunnel changes."""
    name, colon, port = host.lower().rpartition(":")
    return name if colon and port.isdigit() else host.lower()


class BoundedHttpServer(ThreadingHTTPServer):
    """An HTTP server with a bounded number of connections, each on a thread of its own.

    When all are taken, the oldest that has not sent its request gives way; if all have, the newcomer is refused.
    """

    daemon_threads = True
    request_queue_size = 1024  # whom it does not hold tries again after a second only

    def __init__(self, address: tuple[str, int], handler: Callable[..., "GuardedHandler"]) -> None:
        self._lock = Lock()
        self._connections: dict[socket, bool] = {}  # whether it has sent its request; oldest first
        super().__init__(address, handler)

    def get_request(self) -> tuple[socket, Any]:
        try:
            return super().get_request()
        except OSError:  # no descriptors: the listening socket stays readable, and must not be asked without a pause
            wall_sleep_s(NO_DESCRIPTORS_S)
            raise

    def verify_request(self, request: Any, client_address: Any) -> bool:  # noqa: ARG002
        with self._lock:
            if len(self._connections) >= CONNECTIONS_MAX:
                silent = next((other for other, has_asked in self._connections.items() if not has_asked), None)
                if silent is None:
                    return False
                del self._connections[silent]
                _shut(silent)  # its thread wakes up and ends
            self._connections[request] = False
        return True

    def has_asked(self, connection: socket) -> None:
        """A request is complete; its connection gives way to nobody."""
        with self._lock:
            if connection in self._connections:
                self._connections[connection] = True

    def shutdown_request(self, request: Any) -> None:
        with self._lock:
            self._connections.pop(request, None)
        super().shutdown_request(request)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Clients that reset, fall silent or stop reading are nobody's business; a fault of ours is told."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class GuardedHandler(BaseHTTPRequestHandler):
    """Answers requests of this machine's own programs and pages; `answer` is the subclass's."""

    timeout = REQUEST_S
    server: BoundedHttpServer

    def log_message(self, *_: Any) -> None:
        """Requests are nobody's business."""

    def do_GET(self) -> None:
        self.server.has_asked(self.connection)
        refusal = browser_refusal(self.headers)
        if refusal:
            self.send_error(403, refusal)
        else:
            self.answer()

    def answer(self) -> None:
        """Answers a request that is not refused."""
        raise NotImplementedError


def _shut(connection: socket) -> None:
    try:
        connection.shutdown(SHUT_RDWR)
    except OSError:  # it has gone already
        return
