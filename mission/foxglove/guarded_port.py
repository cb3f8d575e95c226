"""A port in front of a server that asks nobody who they are: only those pass who know the address that was printed.

In: connections, each with the head of an HTTP request. Out: those whose Host is this machine's and whose path holds the
token are passed on, byte for byte; others get a sentence. Foxglove is a website of others when it runs in a browser, so
that its Origin says nothing; the token does. The server behind is at an address of its own on loopback that is drawn
anew each time, and no browser is told.
"""

import asyncio
import secrets
from contextlib import suppress
from http.client import HTTPMessage, parse_headers
from io import BytesIO
from threading import Thread

from mission.net_guard import CONNECTIONS_MAX, LOOPBACK, REQUEST_S, host_refusal, new_token

HEAD_BYTES_MAX = 8192
PIECE_BYTES = 1 << 16


def hidden_address() -> str:
    """An address of loopback that nobody can guess: one of sixteen million, and a port besides."""
    return f"127.{secrets.randbelow(254) + 1}.{secrets.randbelow(256)}.{secrets.randbelow(254) + 1}"


class GuardedPort:
    """The port, open until it is closed.

    Args:
        port: of loopback; 0 takes a free one.
        target: address and port of the server behind.

    Raises:
        OSError: the port is in use.
    """

    def __init__(self, port: int, target: tuple[str, int]) -> None:
        self._target, self._token = target, new_token()
        self._loop = asyncio.new_event_loop()
        self._count = 0
        try:
            self._server = self._loop.run_until_complete(
                asyncio.start_server(self._serve, LOOPBACK, port, limit=HEAD_BYTES_MAX)
            )
        except OSError:
            self._loop.close()
            raise
        self.port: int = self._server.sockets[0].getsockname()[1]
        self._thread = Thread(target=self._loop.run_forever, name="foxglove", daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """What Foxglove connects to; the token in it is another one each time."""
        return f"ws://{LOOPBACK}:{self.port}/{self._token}"

    def close(self) -> None:
        """Ends all connections."""
        asyncio.run_coroutine_threadsafe(self._end(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def _end(self) -> None:
        self._server.close()
        others = asyncio.all_tasks() - {asyncio.current_task()}
        for task in others:
            task.cancel()
        await asyncio.gather(*others, return_exceptions=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """One connection, from its first byte to its end."""
        self._count += 1
        try:
            if self._count <= CONNECTIONS_MAX:
                await self._pass_on(reader, writer)
        except (OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError, TimeoutError):
            return  # who goes, is slow or sends no request is nobody's business
        finally:
            self._count -= 1
            writer.close()

    async def _pass_on(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), REQUEST_S)
        line, _, rest = head.partition(b"\r\n")
        wrong = refusal(line, parse_headers(BytesIO(rest)), self._token)
        if wrong:
            text = f"{wrong}\n".encode()
            start = b"HTTP/1.1 403 Forbidden\r\nConnection: close\r\nContent-Length: %d\r\n\r\n" % len(text)
            writer.write(start + text)
            await writer.drain()
            return
        behind, ahead = await asyncio.open_connection(*self._target)
        try:
            ahead.write(b"GET / HTTP/1.1\r\n" + rest)
            one, other = asyncio.create_task(_pump(reader, ahead)), asyncio.create_task(_pump(behind, writer))
            await asyncio.wait({one, other}, return_when=asyncio.FIRST_COMPLETED)
            for task in (one, other):
                task.cancel()
            await asyncio.gather(one, other, return_exceptions=True)
        finally:
            ahead.close()


def refusal(line: bytes, headers: HTTPMessage, token: str) -> str:
    """Why a request is not passed on; "" if it is.

    Args:
        line: its first.
        headers: the others.
        token: that the path must be.
    """
    wrong = host_refusal(headers)
    method, _, target = line.partition(b" ")
    path = target.partition(b" ")[0].partition(b"?")[0].strip(b"/")
    if wrong or method != b"GET":
        return wrong or "not a GET"
    if not secrets.compare_digest(path, token.encode()):
        return "Connect to the whole address that was printed at the start: it holds a key."
    return ""


async def _pump(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Until one end is gone."""
    with suppress(OSError):
        while piece := await reader.read(PIECE_BYTES):
            writer.write(piece)
            await writer.drain()
