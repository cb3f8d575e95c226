"""What a policy without images is told: in flight as in training."""

import numpy as np
import pytest

from common.image_stream import ImageFrame
from policies.companion.senses.senses import Senses
from policies.companion.telemetry import Own, Owner
from policies.companion.tracked_observer import TrackedObserver
from policies.tasks.follow_me.observe import DEPTH_HALF_M, HFOV_DEG, IMAGE_SIZE, TILT_DEG
from policies.tasks.follow_me.tracked.vector import TRACKED_ELEMENTS


@pytest.mark.parametrize(("depth", "told"), [(120, 1.0), (255, 0.0)])
def test_it_is_told_whether_depth_is_measured_or_told_from_colours(depth, told):
    pixels = np.full((IMAGE_SIZE, IMAGE_SIZE, 4), 200, np.uint8)
    pixels[..., 3] = depth  # 255: no return anywhere
    senses, own = Senses(), Own(pos_ned=(0.0, 0.0, -1.6), vel_ned=(0.0, 0.0, 0.0), range_m=1.6)
    for time_us in (100_000, 200_000):
        own.boot_us = time_us
        senses.sense(own, Owner(), ImageFrame(time_us, 0, pixels, HFOV_DEG, TILT_DEG, float(DEPTH_HALF_M)))
    vector = TrackedObserver(senses).vector(own, 0.0)
    assert vector[[element.name for element in TRACKED_ELEMENTS].index("has_depth")] == told
