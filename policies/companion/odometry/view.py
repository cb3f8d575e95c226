"""A picture made ready to be aligned with the next: grey, blurred against noise, inverse depth, their slopes.

In: pixels of colour and depth. Out: a `View`, and the half as large one of it. Colour carries what the ground and
trunks look like, depth how they stand; in inverse depth a plane is a plane, and noise about the same everywhere.
"""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from policies.tasks.follow_me.observe import HFOV_DEG, depth_of

Floats = NDArray[np.float32]
FAR_M = 15.0  # farther away nothing tells how fast it goes: a pixel is 0.5 m there
_NONE = 255  # of the depth channel: no return
_BLUR_PIXELS = 0.8
_LUMA = np.array([0.299, 0.587, 0.114], np.float32)  # ITU-R BT.601
_NO_INVERSE = -1.0  # [1/m] where no depth is: what is sampled beside it is negative, or far off


@dataclass(frozen=True, eq=False)
class View:
    """One picture at one size."""

    grey: Floats
    """(height, width), 0 to 255."""
    inverse_depth: Floats
    """[1/m] (height, width), along the optical axis."""
    is_return: NDArray[np.bool_]
    """(height, width) Whether there is depth nearer than FAR_M."""

    @property
    def focal(self) -> float:
        """The focal length [pixels]."""
        return 0.5 * float(self.grey.shape[1]) / float(np.tan(np.radians(0.5 * HFOV_DEG)))

    @property
    def centre(self) -> float:
        """Where the optical axis is [pixels], in columns and in rows."""
        return 0.5 * float(self.grey.shape[1] - 1)

    @cached_property
    def looks(self) -> Floats:
        """(height, width, 3): grey, its slope to the right, its slope downwards [1/pixel]."""
        return _with_slopes(self.grey)

    @cached_property
    def shape(self) -> Floats:
        """(height, width, 4): inverse depth [1/m], its slopes likewise, 1 where there is depth."""
        return np.dstack([_with_slopes(self.inverse_depth), self.is_return.astype(np.float32)])

    @cached_property
    def rays(self) -> Floats:
        """(height, width, 3): right, down and ahead of the lens, of depth 1."""
        steps = (np.arange(self.grey.shape[1], dtype=np.float32) - self.centre) / self.focal
        right, down = np.meshgrid(steps, steps)
        return np.dstack([right, down, np.ones_like(right)]).astype(np.float32)

    @cached_property
    def half(self) -> "View":
        """The same at half the size."""
        size = (self.grey.shape[1] // 2, self.grey.shape[0] // 2)
        count = cv2.resize(self.is_return.astype(np.float32), size, interpolation=cv2.INTER_AREA)
        whole = cv2.resize(np.where(self.is_return, self.inverse_depth, 0.0), size, interpolation=cv2.INTER_AREA)
        is_return = count > 0.99  # no mean of what is near and what is not there
        grey = np.asarray(cv2.resize(self.grey, size, interpolation=cv2.INTER_AREA), np.float32)
        return View(grey, np.where(is_return, whole, 0.0).astype(np.float32), is_return)


def view_of(pixels: NDArray[np.uint8]) -> View:
    """A picture as the companion gets it, (height, width, 4), made ready."""
    luma = pixels[..., :3].astype(np.float32) @ _LUMA
    grey = np.asarray(cv2.GaussianBlur(luma, (0, 0), _BLUR_PIXELS), np.float32)
    byte = pixels[..., 3].astype(np.float32)
    depth_m = depth_of(np.minimum(byte, _NONE - 1.0))
    is_return = (byte < _NONE) & (depth_m < FAR_M)
    return View(grey, (1.0 / depth_m).astype(np.float32), is_return)


def _with_slopes(plane: Floats) -> Floats:
    right = cv2.Sobel(plane, cv2.CV_32F, 1, 0, scale=0.125)
    down = cv2.Sobel(plane, cv2.CV_32F, 0, 1, scale=0.125)
    return np.dstack([plane, right, down])
