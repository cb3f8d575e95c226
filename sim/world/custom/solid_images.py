"""Images on solids: read from files, and the mark of a landing pad."""

from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim.world.custom.world_file import WorldError

MAX_SIDE = 8192
_MARK_SIDE = 256
_CONCRETE, _PAINT = (84, 84, 80), (236, 236, 232)


def read_image(file: Path, loc: tuple[int | str, ...]) -> NDArray[np.uint8]:
    """An image file as sRGB, (height, width, 3).

    Raises:
        WorldError: it cannot be read.
    """
    import cv2

    try:
        data = np.frombuffer(file.read_bytes(), np.uint8)
    except OSError as error:
        raise WorldError(loc, f"{file}: {(error.strerror or 'cannot be read').lower()}") from error
    image = cv2.imdecode(data, cv2.IMREAD_COLOR) if len(data) else None
    if image is None or max(image.shape) > MAX_SIDE:
        raise WorldError(loc, f"{file} is no image (PNG, JPEG) of at most {MAX_SIDE} pixels a side")
    return np.ascontiguousarray(image[:, :, ::-1]).astype(np.uint8)


@lru_cache(maxsize=1)
def pad_mark() -> NDArray[np.uint8]:
    """A ring and an H, the H's top at the image's."""
    side = _MARK_SIDE
    along = (np.arange(side) + 0.5) * (2.0 / side) - 1.0
    right, down = np.meshgrid(along, along)
    off = np.hypot(right, down)
    is_ring = (off > 0.86) & (off < 0.97)
    is_post = (np.abs(np.abs(right) - 0.30) < 0.065) & (np.abs(down) < 0.48)
    is_bar = (np.abs(down) < 0.065) & (np.abs(right) < 0.30)
    is_painted = (is_ring | is_post | is_bar)[:, :, None]
    return np.where(is_painted, np.array(_PAINT, np.uint8), np.array(_CONCRETE, np.uint8))
