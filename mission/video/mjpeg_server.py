"""The camera's live image for any browser: multipart JPEG over HTTP, at 10 images a second.

In: the camera's view, at each frame of the flight. Out: http://127.0.0.1:PORT/ with the image, `/stream.mjpg`,
`/still.jpg`, `/camera.xml` (the camera definition file) and `/media/` (what the camera has stored). An image is
rendered only while somebody watches, on a thread of its own, paced by the wall clock.
"""

import shutil
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from functools import partial
from http import HTTPStatus
from threading import Condition, Thread
from typing import Any

from autopilot.mavlink.components.camera.camera_definition import FILE_NAME, definition_xml
from autopilot.payload.camera.camera import Camera
from autopilot.payload.camera.image_file import jpeg_bytes
from autopilot.payload.camera.ports import FrameSource, RawFrame
from autopilot.payload.camera.storage import MediaFolder
from common.clock import wall_time_s
from mission.net_guard import LOOPBACK, BoundedHttpServer, GuardedHandler

RATE_HZ = 10.0
QUALITY = 80
WATCHERS_MAX = 8
WAIT_S = 10.0  # wall clock; the first image may have to wait for its kernel to be compiled
_BOUNDARY = "frame"
_PAGE = b"""<!DOCTYPE html><html><head><title>Honeyguide camera</title>
<style>body{margin:0;background:#111}img{width:100vw;height:100vh;object-fit:contain;image-rendering:auto}</style>
</head><body><img src="/stream.mjpg" alt="live picture"></body></html>
"""


class StreamServer:
    """The server (autopilot.payload.camera.ports.VideoStream).

    Args:
        port: TCP; 0 takes a free one.
        host: address it listens on.

    Raises:
        OSError: the port is in use.
    """

    def __init__(self, port: int, host: str = LOOPBACK) -> None:
        self.width, self.height = 320, 180
        self.rate_hz, self.bitrate, self.is_rtp = RATE_HZ, 0, False
        self.is_running = True
        self._camera: Camera | None = None
        self._source: FrameSource | None = None
        self._pending: Future[RawFrame] | None = None
        self._next_s = 0.0
        self._jpeg = b""
        self._serial = 0  # of the image, from 1
        self._watchers = 0
        self._is_closed = False
        self._news = Condition()
        self._http = BoundedHttpServer((host, port), partial(StreamHandler, self))
        self._address = f"http://{host}:{self._http.server_address[1]}"
        self.uri = f"{self._address}/stream.mjpg"
        self.definition_uri = f"{self._address}/{FILE_NAME}"
        self._thread = Thread(target=self._http.serve_forever, name="stream", daemon=True)

    @property
    def page_uri(self) -> str:
        return f"{self._address}/"

    def media_uri(self, name: str) -> str:
        return f"{self._address}/media/{name}"

    @property
    def media(self) -> MediaFolder | None:
        return None if self._camera is None else self._camera.media

    def start(self, camera: Camera, source: FrameSource) -> None:
        """Begins to serve.

        Args:
            camera: whose view it is.
            source: renders on a thread of its own, apart from the camera's.
        """
        self._camera, self._source = camera, source
        self._thread.start()

    # The flight's side

    def frame(self) -> None:
        """Asks for the next image, if somebody watches and it is due."""
        if not self._watchers or not self.is_running or self._camera is None or self._source is None:
            return
        if self._pending is not None:
            if not self._pending.done():
                return
            self._pending.result()  # a fault in the renderer stops the flight
            self._pending = None
        now_s = wall_time_s()
        if now_s >= self._next_s:
            self._next_s = max(self._next_s + 1.0 / self.rate_hz, now_s)
            view = self._camera.view((self.width, self.height), is_smooth=False)
            self._pending = self._source.capture(view)
            self._pending.add_done_callback(self._publish)

    def _publish(self, future: "Future[RawFrame]") -> None:
        if future.cancelled() or future.exception() is not None:
            return
        jpeg = jpeg_bytes(future.result().rgb, QUALITY)
        with self._news:
            self._jpeg = jpeg
            self._serial += 1
            self._news.notify_all()

    def close(self) -> None:
        """Ends the server; clients see the end of the stream."""
        with self._news:
            self._is_closed = True
            self._news.notify_all()
        if self._thread.is_alive():
            self._http.shutdown()
            self._thread.join()
        self._http.server_close()

    # The clients' side

    @contextmanager
    def watching(self) -> Iterator[bool]:
        """Counts a watcher; whether there was room for one."""
        with self._news:
            has_room = self._watchers < WATCHERS_MAX
            self._watchers += has_room
        try:
            yield has_room
        finally:
            with self._news:
                self._watchers -= has_room

    def next_image(self, after: int) -> tuple[int, bytes] | None:
        """The newest image and its number, when there is one after number `after`; None: the stream has ended."""
        with self._news:
            self._news.wait_for(lambda: self._serial > after or self._is_closed, WAIT_S)
            return None if self._is_closed or self._serial <= after else (self._serial, self._jpeg)

    @property
    def is_paused(self) -> bool:
        """Whether there is no image because a client has stopped the stream."""
        return not self.is_running and not self._is_closed

    @property
    def serial(self) -> int:
        return self._serial


class StreamHandler(GuardedHandler):
    """Answers one connection of a stream server's."""

    def __init__(self, stream: StreamServer, *connection: Any) -> None:
        self._stream = stream
        super().__init__(*connection)  # which answers

    def answer(self) -> None:
        path = self.path.partition("?")[0]
        if path == "/":
            self._answer("text/html; charset=utf-8", _PAGE)
        elif path == f"/{FILE_NAME}":
            self._answer("application/xml", definition_xml().encode())
        elif path in ("/stream.mjpg", "/still.jpg"):
            with self._stream.watching() as has_room:
                if not has_room:
                    self.send_error(HTTPStatus.SERVICE_UNAVAILABLE, "too many watchers")
                elif path == "/still.jpg":
                    self._still()
                else:
                    self._images()
        elif path.startswith("/media/"):
            self._media(path.removeprefix("/media/"))
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def _answer(self, kind: str, content: bytes) -> None:
        self._answer_head(kind, len(content))
        self.wfile.write(content)

    def _answer_head(self, kind: str, size: int) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(size))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()

    def _still(self) -> None:
        image = self._stream.next_image(self._stream.serial)
        if image is None:
            self.send_error(HTTPStatus.SERVICE_UNAVAILABLE, "no picture")
        else:
            self._answer("image/jpeg", image[1])

    def _images(self) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", f"multipart/x-mixed-replace; boundary={_BOUNDARY}")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        serial = self._stream.serial
        while True:  # until the browser goes, or takes nothing for too long
            image = self._stream.next_image(serial)
            if image is None:
                if self._stream.is_paused:
                    continue
                return
            serial, jpeg = image
            head = f"--{_BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
            self.wfile.write(head.encode() + jpeg + b"\r\n")

    def _media(self, name: str) -> None:
        """A stored file, by a name that the camera itself would list."""
        path = (
            None
            if self._stream.media is None
            else next((p for p in self._stream.media.files() if p.name == name), None)
        )
        if path is None:
            self.send_error(HTTPStatus.NOT_FOUND)
        else:
            with path.open("rb") as file:
                kind = "image/jpeg" if path.suffix == ".jpg" else "video/mp4"
                self._answer_head(kind, path.stat().st_size)
                shutil.copyfileobj(file, self.wfile)
