"""The onboard camera's pictures for programs: raw frames over TCP (common/image_stream.py), polled once per frame.

In: pictures, as they are taken. Out: each of them to every client, without waiting: a client that has not yet taken in
the last picture misses the next, so that what it gets is never old. No thread, no request: connecting is enough.
"""

import socket
from contextlib import suppress

from autopilot.mavlink.links import LOOPBACK, bound_socket
from common.image_stream import ImageFrame, frame_bytes

CLIENTS_MAX = 8


class ImageServer:
    """A TCP port that pictures come from.

    Args:
        port: 0 takes a free one.
        host: address it listens on.

    Raises:
        LinkError: the port is in use.
    """

    def __init__(self, port: int, host: str = LOOPBACK) -> None:
        self._socket = bound_socket(socket.SOCK_STREAM, host, port)
        self._socket.listen(CLIENTS_MAX)
        self.port: int = self._socket.getsockname()[1]
        self.url = f"tcp://{host}:{self.port}"
        self._clients: dict[socket.socket, bytes] = {}  # and what is left of the last picture

    def frame(self, time_us: int) -> None:  # noqa: ARG002  (whatever is on board is given the time)
        """Lets clients in and goes on with what they have not taken yet."""
        with suppress(BlockingIOError):
            while True:
                client, _ = self._socket.accept()
                client.setblocking(False)
                client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                if len(self._clients) < CLIENTS_MAX:
                    self._clients[client] = b""
                else:
                    client.close()
        for client in [*self._clients]:
            self._send(client, self._clients[client])

    def publish(self, frame: ImageFrame) -> None:
        """Sends a picture to every client that has taken the last one."""
        data = frame_bytes(frame)
        for client, rest in [*self._clients.items()]:
            if not rest:
                self._send(client, data)

    def _send(self, client: socket.socket, data: bytes) -> None:
        if not data:
            return
        try:
            sent = client.send(data)
        except BlockingIOError:
            sent = 0
        except OSError:  # it has gone
            client.close()
            del self._clients[client]
            return
        self._clients[client] = data[sent:]

    def close(self) -> None:
        """Ends every stream."""
        for client in (*self._clients, self._socket):
            client.close()
        self._clients.clear()
