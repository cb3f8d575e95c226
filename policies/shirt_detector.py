"""The owner in an image, by the blue of their shirt: where, and how far away by the depth beside the colour.

In: one image of the onboard camera, 10 Hz. Out: direction and range, or the place of the chest, for a scripted
follower and policies that say nothing of the owner. What is blue and has a depth is taken for the shirt.
"""

from dataclasses import dataclass
from math import atan2, cos, hypot, radians, sin, tan

import numpy as np
from numpy.typing import NDArray

from common.attitude import Vector, levelled, rotated
from policies.tasks.follow_me.observe import DEPTH_HALF_M, HFOV_DEG, camera_mount

BLUE_OVER_RED, BLUE_OVER_GREEN = 1.6, 1.3  # ratios of sRGB values; measured on the shirt, near and far, sun and shade
PIXELS_MIN = 3  # fewer are chance
SHIRT_OVER_CHEST_M = 0.18  # measured: what is seen is 0.68 of the stature up; a chest counts as 1.0 m above the feet
_BLUE_MIN = 40  # darker colours have no ratio
_NO_RETURN = 255
_HALF_BODY_M = 0.12  # from the shirt to the middle of the chest


@dataclass(frozen=True, slots=True)
class Sight:
    """The owner's shirt in the camera frame rdf."""

    azimuth_rad: float  # from the optical axis to the right
    elevation_rad: float  # and up
    range_m: float  # from the lens
    pixels: int  # that show it

    @property
    def position_rdf(self) -> Vector:
        """Right, down, ahead [m]."""
        level_m = self.range_m * cos(self.elevation_rad)
        down_m = -self.range_m * sin(self.elevation_rad)
        return (level_m * sin(self.azimuth_rad), down_m, level_m * cos(self.azimuth_rad))


def find_owner(pixels: NDArray[np.uint8], hfov_deg: float, depth_half_m: float) -> Sight | None:
    """The owner, None if they are not to be seen.

    Args:
        pixels: red, green, blue and depth, shape (height, width, 4).
        hfov_deg: horizontal field of view.
        depth_half_m: a depth byte is 255 d / (d + depth_half_m).
    """
    height, width, _ = pixels.shape
    red, green, blue, depth = (pixels[..., k].astype(np.float32) for k in range(4))
    is_shirt = (blue > BLUE_OVER_RED * red) & (blue > BLUE_OVER_GREEN * green) & (blue > _BLUE_MIN)
    is_shirt &= depth < _NO_RETURN
    count = int(np.count_nonzero(is_shirt))
    if count < PIXELS_MIN:
        return None
    rows, columns = np.nonzero(is_shirt)
    per_pixel = 2.0 * tan(radians(0.5 * hfov_deg)) / width
    right = (float(np.median(columns)) + 0.5 - 0.5 * width) * per_pixel
    down = (float(np.median(rows)) + 0.5 - 0.5 * height) * per_pixel
    byte = float(np.median(depth[is_shirt])) + 0.5  # bytes were rounded down
    along_m = depth_half_m * byte / (255.0 - byte)
    level = hypot(1.0, right)
    return Sight(atan2(right, 1.0), atan2(-down, level), along_m * hypot(level, down) + _HALF_BODY_M, count)


def chest_hfrd(pixels: NDArray[np.uint8], down_frd: tuple[float, float]) -> Vector | None:
    """The owner's chest from the vehicle: ahead, right and down [m], level; None if they are not to be seen.

    Args:
        pixels: of the policy's camera, shape (height, width, 4).
        down_frd: the first two elements of the unit vector down in the body frame: how the vehicle leans.
    """
    sight = find_owner(pixels, HFOV_DEG, float(DEPTH_HALF_M))
    if sight is None:
        return None
    position = rotated(camera_mount(), sight.position_rdf)  # from the lens, a decimetre off the middle
    ahead, right, down = levelled(position, down_frd)
    return ahead, right, down + SHIRT_OVER_CHEST_M
