"""What the host gives a camera: frames of what its lens sees, and a stream that somebody may watch.

The flight controller never knows where the light comes from; it says where the lens points relative to the body.
"""

from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from common.attitude import Quat


@dataclass(frozen=True, slots=True)
class View:
    """One frame as the camera asks for it."""

    width: int
    height: int
    hfov_deg: float
    q_frd_from_rdf: Quat  # camera frame rdf: x right, y down, z ahead
    exposure: float = 1.0  # factor on the light
    balance: tuple[float, float, float] = (1.0, 1.0, 1.0)  # factor on red, green, blue
    is_smooth: bool = False  # edges without steps, at four times the price


@dataclass(frozen=True, slots=True, eq=False)
class RawFrame:
    """What the sensor delivers."""

    rgb: NDArray[np.uint8]  # (height, width, 3)
    depth_m: NDArray[np.float32]  # (height, width), along the optical axis


class FrameSource(Protocol):
    """The light in front of the lens."""

    def capture(self, view: View) -> "Future[RawFrame]":
        """The frame as of now; in lockstep it is done at once."""
        ...


class VideoStream(Protocol):
    """A live image that clients may watch."""

    uri: str  # its address; of RTP: the UDP port that a station listens on
    is_rtp: bool  # H.264 in RTP packets over UDP; otherwise images over HTTP
    width: int
    height: int
    rate_hz: float
    bitrate: int  # [bit/s] at most; 0: unknown
    is_running: bool  # may be set: STOP_STREAMING pauses it


class ImageServer(VideoStream, Protocol):
    """One that serves files as well."""

    definition_uri: str  # where the camera's definition file is; empty for nowhere

    def media_uri(self, name: str) -> str:
        """Where a stored file can be fetched."""
        ...


Writer = Any  # cv2.VideoWriter, which has no type
