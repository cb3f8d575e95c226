"""Where the companion's images come from: a stream over TCP, or the memory of the same process.

In: a TCP stream of images (common/image_stream.py), or frames handed over in lockstep. Out: the newest image, each
only once. The stream is read without waiting; a camera that is not there, or goes away, is looked for again and again.
"""

import errno
import socket
from contextlib import suppress
from typing import Protocol
from urllib.parse import urlsplit

from common.image_stream import ImageFrame, ImageReader, ImageStreamError

RETRY_US = 500_000
SILENT_US = 2_000_000  # a camera that lost its power says no goodbye; guess: twenty images
FIRST_US = 20_000_000  # some begin with a connection what takes seconds; guess
_CHUNK = 1 << 18  # [byte] of one read: sixteen images of 64 x 64 x 4
READS_MAX = 4  # of one step: a camera that floods must not hold up the pilot
_UNDER_WAY = {0, errno.EAGAIN, errno.EALREADY, errno.EINPROGRESS, errno.EISCONN, errno.ENOTCONN}


class CameraUrlError(ValueError):
    """An address of a camera that cannot be used; the text is one sentence."""


class ImageSource(Protocol):
    """Images of the onboard camera."""

    trouble: str  # why there are no images, as far as is known

    def take(self, time_us: int) -> ImageFrame | None:
        """The newest image since the last call, None if there is none.

        Args:
            time_us: the companion's own clock.
        """
        ...

    def close(self) -> None: ...


class MemoryCamera:
    """Images of a camera in this process."""

    trouble = ""

    def __init__(self) -> None:
        self._newest: ImageFrame | None = None

    def publish(self, frame: ImageFrame) -> None:
        """Called by the camera."""
        self._newest = frame

    def take(self, time_us: int) -> ImageFrame | None:  # noqa: ARG002  (the stream's needs it)
        newest, self._newest = self._newest, None
        return newest

    def close(self) -> None:
        """Has nothing to give back."""


class StreamCamera:
    """Images that come over TCP.

    Args:
        url: `tcp://HOST:PORT`.

    Raises:
        CameraUrlError: it is no such address.
    """

    def __init__(self, url: str) -> None:
        self._address = _address(url)
        self._socket: socket.socket | None = None
        self._reader = ImageReader()
        self._retry_us = 0
        self._heard_us = 0  # when something came in last, or the connection was begun
        self._has_heard = False  # on this connection
        self.trouble = ""  # why there are no images, as far as is known

    def take(self, time_us: int) -> ImageFrame | None:
        if self._socket is None:
            if time_us < self._retry_us:
                return None
            self._retry_us = time_us + RETRY_US
            self._connect(time_us)
        newest: ImageFrame | None = None
        for _ in range(READS_MAX):
            data = self._read()
            if not data:
                break
            self._heard_us, self._has_heard = time_us, True
            try:
                frames = self._reader.feed(data)
            except ImageStreamError as error:
                self._give_up(str(error))
                break
            newest = frames[-1] if frames else newest
        patience_us = SILENT_US if self._has_heard else FIRST_US
        if self._socket is not None and time_us - self._heard_us > patience_us:
            self._give_up("the camera is silent")
        return newest

    def _connect(self, time_us: int) -> None:
        self._reader, self._heard_us, self._has_heard = ImageReader(), time_us, False
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._socket.setblocking(False)
        try:
            code = self._socket.connect_ex(self._address)
        except OSError as error:  # an unknown host
            self._give_up(error.strerror or str(error))
            return
        if code not in _UNDER_WAY:
            self._give_up("nobody there")

    def _read(self) -> bytes:
        """What has come in; nothing if no more is there yet, or the camera has gone."""
        if self._socket is None:
            return b""
        try:
            data = self._socket.recv(_CHUNK)
        except BlockingIOError:
            return b""
        except OSError as error:
            if error.errno not in _UNDER_WAY:
                self._give_up("nobody there")
            return b""
        if not data:
            self._give_up("the camera has ended the stream")
        return data

    def _give_up(self, trouble: str) -> None:
        self.trouble = trouble
        self.close()
        self._socket = None

    def close(self) -> None:
        if self._socket is not None:
            with suppress(OSError):
                self._socket.close()


def _address(url: str) -> tuple[str, int]:
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        parts, port = urlsplit(""), None
    if parts.scheme != "tcp" or not parts.hostname or port is None or parts.path not in ("", "/"):
        raise CameraUrlError(f"{url}: must be tcp://HOST:PORT")
    return parts.hostname, port
