"""The onboard camera's pictures for programs: raw frames over TCP (common/image_stream.py), polled once per frame.

In: pictures, as they are taken. Out: each of them to every client, without waiting: a client that has not yet taken in
the last picture misses the next, so that what it gets is never old. No thread, no request: connecting is enough. Who
sends anything is closed (a browser always does), and so is who does not take what it is sent.
"""

import socket
from collections.abc import Callable
from dataclasses import dataclass

from autopilot.mavlink.transport.links import LOOPBACK, bound_socket
from common.clock import wall_time_s
from common.image_stream import ImageFrame, frame_bytes

CLIENTS_MAX = 8
ACCEPTS_PER_FRAME_MAX = 8
TAKE_S = 2.0  # wall clock; a client that has not taken a picture for so long is let go,
GIVE_WAY_S = 0.5  # and sooner if another one wants its place
SEND_BUFFER = 1 << 16  # [byte] of a client's pictures that may wait in the system


@dataclass(slots=True)
class _Client:
    rest: bytes = b""  # of the picture that is being sent
    since_s: float = 0.0  # when that was begun


class ImageServer:
    """A TCP port that pictures come from.

    Args:
        port: 0 takes a free one.
        host: address it listens on.
        clock: [s] by which clients are given time.

    Raises:
        LinkError: the port is in use.
    """

    def __init__(self, port: int, host: str = LOOPBACK, clock: Callable[[], float] = wall_time_s) -> None:
        self._socket = bound_socket(socket.SOCK_STREAM, host, port)
        self._socket.listen(CLIENTS_MAX)
        self._clock = clock
        self.port: int = self._socket.getsockname()[1]
        self.url = f"tcp://{host}:{self.port}"
        self._clients: dict[socket.socket, _Client] = {}

    def frame(self, time_us: int) -> None:  # noqa: ARG002  (whatever is on board is given the time)
        """Lets clients in and goes on with what they have not taken yet."""
        now_s = self._clock()
        for connection, client in [*self._clients.items()]:
            self._go_on(connection, client)
            is_late = bool(client.rest) and now_s - client.since_s > TAKE_S
            if connection in self._clients and (is_late or _has_spoken_or_gone(connection)):
                self._drop(connection)
        self._accept(now_s)

    def _accept(self, now_s: float) -> None:
        for _ in range(ACCEPTS_PER_FRAME_MAX):
            try:
                connection, _ = self._socket.accept()
            except OSError:  # no more, one that has gone already, or no descriptor for it
                return
            if len(self._clients) >= CLIENTS_MAX:
                self._make_room(now_s)
            if len(self._clients) >= CLIENTS_MAX:
                connection.close()
                continue
            connection.setblocking(False)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
            self._clients[connection] = _Client()

    def _make_room(self, now_s: float) -> None:
        """Lets the one go that has not taken its picture for longest, if that is long enough."""
        late = {connection: client.since_s for connection, client in self._clients.items() if client.rest}
        if late and now_s - min(late.values()) > GIVE_WAY_S:
            self._drop(min(late, key=lambda connection: late[connection]))

    def publish(self, frame: ImageFrame) -> None:
        """Sends a picture to every client that has taken the last one."""
        data, now_s = frame_bytes(frame), self._clock()
        for connection, client in [*self._clients.items()]:
            if not client.rest:
                client.rest, client.since_s = data, now_s
                self._go_on(connection, client)

    def _go_on(self, connection: socket.socket, client: _Client) -> None:
        if not client.rest:
            return
        try:
            client.rest = client.rest[connection.send(client.rest) :]
        except BlockingIOError:
            return
        except OSError:  # it has gone
            self._drop(connection)

    def _drop(self, connection: socket.socket) -> None:
        del self._clients[connection]
        connection.close()

    def close(self) -> None:
        """Ends every stream."""
        for connection in (*self._clients, self._socket):
            connection.close()
        self._clients.clear()


def _has_spoken_or_gone(connection: socket.socket) -> bool:
    try:
        connection.recv(1)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True
