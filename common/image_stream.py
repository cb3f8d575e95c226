"""Images of an onboard camera on their way to a companion computer: what one is, and as bytes of a stream.

In and out: `ImageFrame` and bytes. Each frame is a header of 48 bytes, little endian, and the pixels as they are: small
images on one machine need no codec, and a policy sees in flight exactly what it saw in training. At 10 Hz.
"""

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MAGIC = b"HGIM"
VERSION = 1
# magic, version, header size, capture time [us], sequence, height, width, channels, reserved, horizontal field of view
# [deg], pitch [deg], depth of the middle grey [m], payload size
_HEADER = struct.Struct("<4sHHQIHHHHfffI4x")
PAYLOAD_MAX = 64 << 20  # [byte] guess: beyond it the stream is none of ours


class ImageStreamError(Exception):
    """What came in is no stream of images; the text is one sentence."""


@dataclass(frozen=True, slots=True, eq=False)
class ImageFrame:
    """One image, and what a receiver must know of the camera to measure in it."""

    time_us: int  # when it was taken, on the vehicle's clock
    sequence: int  # counts images taken: a gap is an image that was not sent
    pixels: NDArray[np.uint8]  # (height, width, channels): red, green, blue, depth
    hfov_deg: float  # horizontal field of view
    pitch_deg: float  # of the optical axis above the body's forward axis
    depth_half_m: float  # depth that is encoded as 127: a byte is 255 d / (d + depth_half_m), 255 is no return


def frame_bytes(frame: ImageFrame) -> bytes:
    """The frame as it goes over the wire."""
    height, width, channels = frame.pixels.shape
    payload = np.ascontiguousarray(frame.pixels).tobytes()
    header = _HEADER.pack(
        MAGIC, VERSION, _HEADER.size, frame.time_us, frame.sequence & 0xFFFFFFFF, height, width, channels, 0,
        frame.hfov_deg, frame.pitch_deg, frame.depth_half_m, len(payload),
    )  # fmt: skip
    return header + payload


class ImageReader:
    """Cuts a stream of bytes into frames."""

    def __init__(self) -> None:
        self._rest = bytearray()

    def feed(self, data: bytes) -> list[ImageFrame]:
        """The frames completed by `data`.

        Raises:
            ImageStreamError: it is no such stream, or one of another version.
        """
        self._rest += data
        frames: list[ImageFrame] = []
        while len(self._rest) >= _HEADER.size:
            size = _HEADER.size + _checked_payload_size(self._rest)
            if len(self._rest) < size:
                break
            frames.append(_frame(bytes(self._rest[:size])))
            del self._rest[:size]
        return frames


def _checked_payload_size(data: bytearray) -> int:
    magic, version, header_size, _, _, height, width, channels, _, _, _, _, size = _HEADER.unpack_from(data)
    if magic != MAGIC:
        raise ImageStreamError("no stream of pictures: the first bytes are others")
    if version != VERSION or header_size != _HEADER.size:
        raise ImageStreamError(f"a stream of pictures of version {version}; this program reads version {VERSION}")
    if size != height * width * channels or not 0 < size <= PAYLOAD_MAX:
        raise ImageStreamError(f"a picture of {width} x {height} x {channels} does not have {size} bytes")
    return int(size)


def _frame(data: bytes) -> ImageFrame:
    (_, _, _, time_us, sequence, height, width, channels, _, hfov_deg, pitch_deg, depth_half_m, _) = (
        _HEADER.unpack_from(data)
    )
    pixels = np.frombuffer(data, np.uint8, offset=_HEADER.size).reshape(height, width, channels)
    return ImageFrame(time_us, sequence, pixels, hfov_deg, pitch_deg, depth_half_m)
