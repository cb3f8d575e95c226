"""Whether an image is one that policies and senses were made for: its size, and the lens that it was taken with."""

from math import isclose

from common.image_stream import ImageFrame
from policies.tasks.follow_me.observe import DEPTH_HALF_M, HFOV_DEG, TILT_DEG

LENS = (HFOV_DEG, TILT_DEG, float(DEPTH_HALF_M))  # of the images that policies are trained on
OTHER_SIZE, OTHER_LENS = "pictures of another size", "pictures of another lens"
NO_IMAGES, OLD_IMAGES, OTHER_CLOCK = "no new pictures", "old pictures", "pictures from the future"
_LENS_TOLERANCE = 0.02  # guess: a fifth of a degree of tilt, two of the field of view


def misfit(image: ImageFrame, shape: tuple[int, int, int]) -> str:
    """What is wrong with an image where (height, width, channels) are needed; "" if nothing is."""
    if image.pixels.shape != shape:
        return OTHER_SIZE
    lens = (image.hfov_deg, image.pitch_deg, image.depth_half_m)
    is_ours = all(isclose(here, there, rel_tol=_LENS_TOLERANCE) for here, there in zip(lens, LENS, strict=True))
    return "" if is_ours else OTHER_LENS
