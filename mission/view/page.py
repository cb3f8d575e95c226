"""The server of the live page and of replays: viser's, at an address that only its user knows.

viser itself lets in whoever connects, and a web page of any origin may. So every request, the websocket's too, passes
a guard first: its path must begin with this start's token, and its Host and Origin must be ours (mission/net_guard.py).
"""

import http
import json
import logging
import secrets
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from socket import socket
from typing import Any

import rich
import viser
import websockets.asyncio.server as websocket_server
from viser._messages import RunJavascriptMessage
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from mission.net_guard import CONNECTIONS_MAX, LOOPBACK, browser_refusal, new_token
from mission.view.browser_inputs import is_sound

MESSAGE_MAX = 1 << 20  # [byte] of one message of a browser; a click has some 200
OPENING_S = 5.0  # wall clock, from a connection to its complete request

# viser calls its page by its own name, and covers the scene on a phone with its controls. They get the lower part of
# it, status and image first.
_PHONE_STYLE = """
@media (max-width: 36em) {
  #root { height: 56% !important; }
  #root div[style*="max-height: 60%"] { max-height: 44% !important; width: 100% !important; }
  #root div[style*="max-height: 60%"] div[style*="width: 20em"] { width: 100vw !important; }
  #root div:has(> div > .mantine-Tabs-root):not([aria-hidden="true"]) {
    display: flex !important; flex-direction: column;
  }
  #root div:has(> .mantine-Tabs-root) { order: -1; }
}
"""
_DRESS = """
document.title = TITLE;
if (!document.getElementById("honeyguide-style")) {
  const style = document.createElement("style");
  style.id = "honeyguide-style"; style.textContent = STYLE; document.head.append(style);
}
"""

_LOGGER = logging.getLogger("honeyguide.page")  # of handshakes: how strangers fail is nobody's business
_LOGGER.disabled = True

Answer = Callable[[ServerConnection, Request], Response | None]


class PageServer(viser.ViserServer):
    """A page at the loopback address.

    Args:
        port: 0 takes a free one.
        title: of the page.

    Raises:
        OSError: the port is in use.
    """

    def __init__(self, port: int, title: str) -> None:
        with socket() as probe:  # viser would take the next port in silence
            probe.bind((LOOPBACK, port))
        rich.get_console().quiet = True  # viser prints through it that it starts and stops
        warnings.filterwarnings("ignore", "Queued a .* on a closed connection")  # a viewer may leave in mid-frame
        self._token = new_token()
        with _guarded(self._token) as opened:
            super().__init__(host=LOOPBACK, port=port, label=title, verbose=False)
        if not opened:
            self.stop()
            raise RuntimeError("viser did not open its port as expected: the page would be open to any website")
        self.gui.configure_theme(show_share_button=False, show_logo=False)
        script = _DRESS.replace("TITLE", json.dumps(title)).replace("STYLE", json.dumps(_PHONE_STYLE))
        self.gui._websock_interface.queue_message(RunJavascriptMessage(source=script))

    @property
    def url(self) -> str:
        """Where the page is; the token in it is another one each time."""
        return f"http://{LOOPBACK}:{self.get_port()}/{self._token}/"

    def request_share_url(self, verbose: bool = True) -> str | None:  # noqa: ARG002
        """Nothing is shared with the internet, though a browser asks for it."""
        return None


@contextmanager
def _guarded(token: str) -> Iterator[list[None]]:
    """Until it ends, servers that websockets opens let only those in who pass; the list is not empty if one was."""
    plain: Any = websocket_server.serve
    opened: list[None] = []

    def serve(handler: Any, *address: Any, process_request: Answer, **options: Any) -> Any:
        opened.append(None)
        live: set[ServerConnection] = set()

        class BoundedConnection(ServerConnection):
            def connection_made(self, transport: Any) -> None:
                super().connection_made(transport)
                if len(live) < CONNECTIONS_MAX:
                    live.add(self)
                else:
                    transport.abort()

            def connection_lost(self, exc: Exception | None) -> None:
                live.discard(self)
                super().connection_lost(exc)

            async def recv(self, decode: bool | None = None) -> Any:
                while not is_sound(message := await super().recv(decode)):
                    pass
                return message

        options |= {"max_size": MESSAGE_MAX, "open_timeout": OPENING_S, "logger": _LOGGER}
        options["create_connection"] = BoundedConnection
        return plain(handler, *address, process_request=guard(token, process_request), **options)

    websocket_server.serve = serve  # type: ignore[assignment,misc]
    try:
        yield opened
    finally:
        websocket_server.serve = plain  # type: ignore[misc]


def guard(token: str, answer: Answer) -> Answer:
    """Answers only requests for the token's folder that no foreign page has made."""

    def guarded(connection: ServerConnection, request: Request) -> Response | None:
        refusal = browser_refusal(request.headers)
        if refusal:
            return connection.respond(http.HTTPStatus.FORBIDDEN, f"{refusal}\n")
        first, _, rest = request.path.partition("?")[0].removeprefix("/").partition("/")
        if not secrets.compare_digest(first.encode(), token.encode()):
            return connection.respond(
                http.HTTPStatus.FORBIDDEN, "Open the whole address that was printed at the start: it holds a key.\n"
            )
        return answer(connection, replace(request, path=f"/{rest}"))

    return guarded
