"""Foxglove's live connection to a flight: foxglove-sdk's WebSocket server behind a guarded port.

In: messages on the channels of its context. Out: the same to whoever is connected and has asked for the channel; who is
slow misses messages, and no flight waits. Nothing that a client sends is taken.
"""

from queue import Empty, SimpleQueue
from typing import Any

import foxglove
from foxglove import Context, start_server
from foxglove.websocket import ChannelView, Client, ServerListener

from mission.foxglove.guarded_port import GuardedPort, hidden_address

QUIET = "CRITICAL"  # a client that goes is no news


class _Listener(ServerListener):
    """Notes, on the server's threads, what is newly heard."""

    def __init__(self) -> None:
        self.topics: SimpleQueue[str] = SimpleQueue()

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:  # noqa: ARG002
        self.topics.put(channel.topic)


class LiveServer:
    """The server, open until it is closed.

    Args:
        port: of loopback.
        name: what Foxglove shows.

    Raises:
        OSError: the port is in use.
    """

    def __init__(self, port: int, name: str) -> None:
        foxglove.set_log_level(QUIET)
        self.context = Context()
        self._listener = _Listener()
        address = hidden_address()
        self._server: Any = start_server(
            name=name, host=address, port=0, context=self.context, server_listener=self._listener
        )
        try:
            self._guard = GuardedPort(port, (address, self._server.port))
        except OSError:
            self._server.stop()
            raise

    @property
    def url(self) -> str:
        """What Foxglove connects to."""
        return self._guard.url

    def newly_heard(self) -> list[str]:
        """Topics that somebody has begun to listen to since this was last asked."""
        found = []
        while True:
            try:
                found.append(self._listener.topics.get_nowait())
            except Empty:
                return found

    def close(self) -> None:
        """Ends all connections."""
        self._guard.close()
        self._server.stop()
