"""People in the images of a camera near the ground.

In: an image. Out: detections. The detector of people was trained on what is seen from 0.6 m and more above the ground:
from a rover's nose it finds who is near, and often misses who stands farther than some 5 m off, before the horizon.
Where it is sure of nobody a blue shirt counts as somebody: who wears another colour is only seen from nearby.
"""

import numpy as np
from numpy.typing import NDArray

from policies.person_detector.detector import SURE, Detection, PersonDetector
from policies.shirt_detector import chest_hfrd

_NO_PIXEL = (float("nan"), float("nan"))


class LowDetector(PersonDetector):
    """The detector that ships, helped by the colour of a shirt."""

    def find(self, pixels: NDArray[np.uint8], down_frd: tuple[float, float]) -> list[Detection]:
        found = super().find(pixels, down_frd)
        if any(detection.probability >= SURE for detection in found):
            return found
        chest = chest_hfrd(pixels, down_frd)
        return found if chest is None else [Detection(SURE, chest, _NO_PIXEL), *found]
