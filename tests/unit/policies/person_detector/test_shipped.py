"""The detectors that ship, as they fly and drive, on worlds that no training has: figures of the documentation hold."""

from itertools import combinations
from math import dist

import numpy as np
import pytest

from common.image_stream import ImageFrame
from policies.companion.senses.senses import Senses
from policies.companion.telemetry import Own, Owner
from policies.person_detector.detector import LOW_WEIGHTS, STRIDE, SURE, WEIGHTS, Detection, PersonDetector, shipped
from policies.person_detector.scenes import scenes
from policies.person_detector.training import is_sure, judge
from policies.tasks.follow_me.observe import DEPTH_HALF_M, HFOV_DEG, IMAGE_SIZE, TILT_DEG


@pytest.fixture(scope="module")
def there():
    return scenes(1024, 11, is_test=True)


@pytest.fixture(scope="module")
def judged(there):
    """Of pictures with somebody, and of pictures of nobody, whether it is sure of somebody."""
    detector = PersonDetector()
    return tuple(is_sure(detector, there.images[rows]) for rows in (there.has_person, there.is_empty))


def test_it_sees_nobody_in_pictures_of_nobody(judged):
    _, ghosts = judged
    assert len(ghosts) > 250
    assert ghosts.mean() < 0.02  # 0.7 % of 2,000


def test_it_sees_who_is_there(judged):
    seen, _ = judged
    assert len(seen) > 400
    assert seen.mean() > 0.88  # 92.2 % of 3,700


def test_that_of_rovers_sees_who_is_there_and_nobody_else_from_near_the_ground():
    there, detector = scenes(1024, 11, is_test=True, heights_m=(0.25, 0.6)), PersonDetector(shipped(LOW_WEIGHTS))
    seen, ghosts = (is_sure(detector, there.images[rows]) for rows in (there.has_person, there.is_empty))
    assert ghosts.mean() < 0.03  # 1.3 % of 1,900
    assert seen.mean() > 0.87  # 90.7 % of 3,800


def test_its_ranges_by_depth_hold_in_the_middle_of_an_image_and_at_its_edge(there):
    """Who is cut off by the edge, before a vehicle that leans, must not be thought farther off than they are."""
    detector, from_middle, ratios = PersonDetector(), [], []
    for k in np.flatnonzero(there.has_person):
        cells = np.argwhere(there.cells[k] == 1)
        for found in detector.find(there.images[k], (0.0, 0.0)):
            off = np.abs(cells - (np.array(found.pixel[::-1]) / STRIDE - 0.5)).max(1)
            row, column = cells[off.argmin()]
            if found.probability >= SURE and found.has_depth and off.min() < 1.5:
                from_middle.append(max(abs(row - 7.5), abs(column - 7.5)))
                ratios.append(np.linalg.norm(found.chest_hfrd) / there.ranges_m[k, row, column])
    for is_meant in (np.array(from_middle) < 5.0, np.array(from_middle) > 5.0):
        of_these = np.array(ratios)[is_meant]
        assert len(of_these) > 150
        assert 0.85 < np.quantile(of_these, 0.05) < np.quantile(of_these, 0.95) < 1.15
        assert (of_these > 1.2).mean() < 0.02


def test_its_probabilities_are_as_often_true_as_they_say(there):
    found = judge(shipped(WEIGHTS).eval(), there)
    assert found["calibration error"] < 0.03  # 0.8 % of 5,900 images
    assert found["range"] < 0.17  # by looks alone, the median: 13.6 % of 6,400 images


@pytest.mark.parametrize(("probability", "is_seen"), [(SURE - 0.01, False), (SURE + 0.01, True)])
def test_in_flight_its_word_counts_from_the_probability_that_it_is_judged_at(probability, is_seen):
    pixels = np.full((IMAGE_SIZE, IMAGE_SIZE, 4), 200, np.uint8)
    senses, own = Senses(detector=Says(probability)), Own(pos_ned=(0.0, 0.0, -1.6), range_m=1.6)
    for time_us in range(100_000, 1_100_000, 100_000):
        own.boot_us = time_us
        senses.sense(own, Owner(), ImageFrame(time_us, 0, pixels, HFOV_DEG, TILT_DEG, float(DEPTH_HALF_M)))
    assert (senses.silence_s(own) < 1.0) is is_seen


class Says:
    """A detector that finds somebody three metres ahead, with a probability."""

    def __init__(self, probability):
        self._found = [Detection(probability, (3.0, 0.0, 0.6), (32.0, 32.0))]

    def find(self, *_):
        return self._found


def test_somebody_near_is_one(there):
    """Whose chest is wider than the cells that tell two people apart."""
    detector = PersonDetector()
    for image in there.images[there.has_person][:200]:
        places = [one.chest_hfrd[:2] for one in detector.find(image, (0.0, 0.0))]
        assert all(dist(a, b) > 0.4 for a, b in combinations(places, 2))
