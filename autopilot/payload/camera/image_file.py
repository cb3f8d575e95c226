"""From the sensor's frame to a file: the lens's blur, JPEG, video.

OpenCV does the work; it is imported when the first image is taken.
"""

from math import radians, tan
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from autopilot.payload.camera.lens import APERTURE_M
from autopilot.payload.camera.ports import RawFrame, Writer

_BLUR_PIXELS = (1.5, 3.0, 6.0)  # diameters of the blurred copies that the image is put together from
_SHARP_PIXELS = 0.75  # blur below it cannot be seen


def prepare() -> None:
    """Imports OpenCV, so that the first image need not wait for it."""
    import cv2

    cv2.setNumThreads(1)  # small images: the other cores belong to the flight


def defocused(frame: RawFrame, hfov_deg: float, zoom: float, focus_m: float) -> NDArray[np.uint8]:
    """The image of a thin lens: what is not at the distance in focus becomes a disc of confusion.

    Args:
        frame: the sharp frame.
        hfov_deg: horizontal field of view.
        zoom: factor on the focal length; the pupil grows with it.
        focus_m: the distance in focus.
    """
    focal_pixels = 0.5 * frame.rgb.shape[1] / tan(radians(0.5 * hfov_deg))
    disc = APERTURE_M * zoom * focal_pixels * np.abs(1.0 / np.maximum(frame.depth_m, 0.05) - 1.0 / focus_m)
    if float(disc.max()) < _SHARP_PIXELS:
        return frame.rgb
    import cv2

    image = frame.rgb.copy()
    for diameter in _BLUR_PIXELS:
        is_blurred = disc >= _SHARP_PIXELS * diameter
        if is_blurred.any():
            blurred = cv2.GaussianBlur(frame.rgb, (0, 0), 0.5 * diameter)
            image[is_blurred] = blurred[is_blurred]
    return image


def jpeg_bytes(rgb: NDArray[np.uint8], quality: int = 85) -> bytes:
    """The image as a JPEG file.

    Raises:
        ValueError: it cannot be encoded.
    """
    import cv2

    is_done, data = cv2.imencode(".jpg", np.ascontiguousarray(rgb[:, :, ::-1]), [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not is_done:
        raise ValueError(f"a picture of shape {rgb.shape} cannot be encoded")
    return bytes(data)


def video_writer(path: Path, rate_hz: float, size: tuple[int, int]) -> Writer | None:
    """A writer of MPEG-4 frames; None if the file cannot be written."""
    import cv2

    fourcc = cv2.VideoWriter.fourcc(*"mp4v")
    writer = cv2.VideoWriter(str(path), fourcc, rate_hz, size)
    return writer if writer.isOpened() else None


def add_frame(writer: Writer, rgb: NDArray[np.uint8]) -> None:
    writer.write(np.ascontiguousarray(rgb[:, :, ::-1]))
