"""The camera's live video for ground stations: H.264 in RTP packets over UDP, as QGroundControl expects it.

In: the camera's view, at frames of the flight. Out: packets to one address, chosen when the flight is started; nobody
can have them sent elsewhere. Rendering and encoding have threads of their own: the flight never waits, and an image
that is not ready when the next is due stands for it. Paced by the wall clock. PyAV encodes and sends (RFC 6184).
"""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from fractions import Fraction
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from autopilot.payload.camera.camera import Camera
from autopilot.payload.camera.ports import FrameSource, RawFrame
from common.clock import wall_time_s

PORT = 5600  # where QGroundControl listens for video
WIDTH, HEIGHT, RATE_HZ = 640, 360, 15
BITRATE = 2_000_000  # [bit/s] at most
CLOCK_HZ = 90_000  # RFC 6184
PAYLOAD_TYPE = 96
_OPTIONS = {
    "preset": "ultrafast",
    "tune": "zerolatency",
    "profile": "baseline",
    "crf": "23",
    "maxrate": str(BITRATE),
    "bufsize": str(BITRATE // 2),
}
_NO_PYAV = "live video needs PyAV: pip install av"
_PACKET_BYTES = 1200  # fits into one frame of any network


class VideoError(ValueError):
    """Video that cannot be sent; the message is one sentence for the user."""


class RtpVideo:
    """A stream (autopilot.payload.camera.ports.VideoStream).

    Args:
        host: the address it is sent to.
        port: UDP, likewise.
        is_running: whether it begins at once; otherwise a client starts it.

    Raises:
        VideoError: there is no PyAV, or one that cannot encode.
    """

    is_rtp = True

    def __init__(self, host: str, port: int = PORT, *, is_running: bool = True) -> None:
        if is_running:
            check_encoder()
        elif find_spec("av") is None:  # the import takes its time: not before somebody wants video
            raise VideoError(_NO_PYAV)
        self.width, self.height, self.rate_hz = WIDTH, HEIGHT, float(RATE_HZ)
        self.bitrate = BITRATE
        self.uri = str(port)  # what VIDEO_STREAM_INFORMATION has for this type: where a station listens
        self.is_running = is_running
        self.on_trouble: Callable[[str], None] = lambda _: None
        self._host, self._port = host, port
        self._camera: Camera | None = None
        self._source: FrameSource | None = None
        self._pool = ThreadPoolExecutor(1, "video")
        self._pending: Future[str] | None = None
        self._sender: _Sender | None = None
        self._next_s = 0.0
        self._trouble = ""

    def start(self, camera: Camera, source: FrameSource) -> None:
        """From now on there is something to see.

        Args:
            camera: whose view it is.
            source: renders on a thread of its own.
        """
        self._camera, self._source = camera, source

    def frame(self) -> None:
        """Has the next image rendered and sent, if it is due."""
        if self._pending is not None:
            if not self._pending.done():
                return
            self._tell(self._pending.result())  # a fault in renderer or encoder stops the flight
            self._pending = None
        if not self.is_running:
            self._end()
            return
        now_s = wall_time_s()
        if now_s >= self._next_s and self._camera is not None and self._source is not None:
            self._next_s = max(self._next_s + 1.0 / self.rate_hz, now_s)
            view = self._camera.view((self.width, self.height), is_smooth=False)
            self._pending = self._pool.submit(self._send, self._source.capture(view), now_s)

    def _send(self, frame: "Future[RawFrame]", time_s: float) -> str:
        """Encodes and sends an image; what went wrong with the network, or nothing."""
        rgb = frame.result().rgb
        try:
            if self._sender is None:
                self._sender = _Sender(self._host, self._port, time_s)
            self._sender.show(rgb, time_s)
        except OSError as error:
            self._end()
            return f"Video: not sent to {self._host}, port {self._port}: {error.strerror}"
        except VideoError as error:
            self.is_running = False
            return f"Video: {error}"
        return ""

    def _tell(self, trouble: str) -> None:
        """Passes trouble on, once until it has gone."""
        if trouble and trouble != self._trouble:
            self.on_trouble(trouble)
        self._trouble = trouble

    def _end(self) -> None:
        """Closes the sender; the next image opens a new one, and begins with a key frame."""
        if self._sender is not None:
            self._sender.close()
            self._sender = None

    def close(self) -> None:
        """Ends the stream; an image that is not ready is not sent."""
        self._pool.shutdown(cancel_futures=True)
        self._end()


class _Sender:
    """One RTP session: encoder and socket."""

    def __init__(self, host: str, port: int, start_s: float) -> None:
        check_encoder()
        import av

        self._av: Any = av
        self._start_s = start_s
        local = f"&localaddr={host}" if host.startswith("127.") else ""  # its own end is not open to others either
        address = f"rtp://{host}:{port}?pkt_size={_PACKET_BYTES}{local}"
        self._container: Any = av.open(address, "w", format="rtp")
        self._stream = self._container.add_stream("libx264", rate=RATE_HZ, options=_OPTIONS)
        self._stream.width, self._stream.height, self._stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        context = self._stream.codec_context
        context.time_base = Fraction(1, CLOCK_HZ)
        context.gop_size = RATE_HZ  # a station that comes later sees an image within a second
        context.thread_count = 1

    def show(self, rgb: NDArray[np.uint8], time_s: float) -> None:
        frame = self._av.VideoFrame.from_ndarray(np.ascontiguousarray(rgb), format="rgb24")
        frame.pts = round((time_s - self._start_s) * CLOCK_HZ)
        frame.time_base = Fraction(1, CLOCK_HZ)
        self._container.mux(self._stream.encode(frame))

    def close(self) -> None:
        with suppress(OSError):  # the network is still down
            self._container.close()


def check_encoder() -> None:
    """Whether images can be encoded here.

    Raises:
        VideoError: they cannot.
    """
    try:
        import av
    except ImportError:
        raise VideoError(_NO_PYAV) from None
    if "libx264" not in av.codecs_available:
        raise VideoError("the installed PyAV has no H.264 encoder (libx264)")


def session_description(host: str, port: int) -> str:
    """What a player opens to see the stream (SDP, RFC 8866)."""
    return "\r\n".join(
        (
            "v=0",
            f"o=- 0 0 IN IP4 {host}",
            "s=Honeyguide camera",
            f"c=IN IP4 {host}",
            "t=0 0",
            f"m=video {port} RTP/AVP {PAYLOAD_TYPE}",
            f"a=rtpmap:{PAYLOAD_TYPE} H264/{CLOCK_HZ}",
            f"a=fmtp:{PAYLOAD_TYPE} packetization-mode=1",
            "",
        )
    )
