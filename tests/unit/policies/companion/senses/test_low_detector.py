"""Who is seen from near the ground where the network sees nobody."""

import numpy as np
import pytest

from policies.companion.senses.low_detector import LowDetector
from policies.person_detector.detector import SURE, Detection, PersonDetector
from policies.tasks.follow_me.observe import DEPTH_HALF_M, IMAGE_SIZE

LEVEL = (0.0, 0.0)


def shirt(colour: tuple[int, int, int], range_m: float) -> np.ndarray:
    pixels = np.full((IMAGE_SIZE, IMAGE_SIZE, 4), 128, np.uint8)
    depth = int(255.0 * range_m / (range_m + DEPTH_HALF_M))
    pixels[20:26, 30:34] = (*colour, depth)
    return pixels


@pytest.fixture(autouse=True)
def sees_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PersonDetector, "find", lambda *_: [])


def test_a_blue_shirt_is_somebody_at_the_depth_beside_its_colour() -> None:
    (seen,) = LowDetector().find(shirt((30, 60, 200), 8.0), LEVEL)
    assert seen.probability == SURE
    assert np.hypot(*seen.chest_hfrd[:2]) == pytest.approx(8.0, abs=0.5)


@pytest.mark.parametrize("colour", [(200, 30, 40), (128, 128, 128)])
def test_no_other_colour_is(colour: tuple[int, int, int]) -> None:
    assert not LowDetector().find(shirt(colour, 8.0), LEVEL)


def test_whom_the_network_sees_counts_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    sure = Detection(0.9, (3.0, 0.0, 0.5), (32.0, 32.0))
    monkeypatch.setattr(PersonDetector, "find", lambda *_: [sure])
    assert LowDetector().find(shirt((30, 60, 200), 8.0), LEVEL) == [sure]
