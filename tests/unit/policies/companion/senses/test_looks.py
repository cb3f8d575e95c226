"""Whether two look like one person."""

import numpy as np
import pytest

from policies.companion.senses.looks import Looks, likeness

BLUE, RED = np.array([-0.3, 0.5, 0.0]), np.array([0.6, 0.1, 0.0])


def seen(colours: np.ndarray, images: int, rng: np.random.Generator | None = None) -> Looks:
    looks = Looks()
    for _ in range(images):
        looks.see(colours if rng is None else rng.normal(colours, (0.1, 0.2, 0.2)))
    return looks


def test_who_looks_the_same_may_be_the_same_and_who_looks_otherwise_hardly_is() -> None:
    assert likeness(seen(BLUE, 8), seen(BLUE, 8)) == pytest.approx(1.6)
    assert likeness(seen(BLUE, 8), seen(RED, 8)) == pytest.approx(-4.0)


def test_it_is_the_same_both_ways() -> None:
    one, other = seen(BLUE, 8), seen(0.7 * BLUE + 0.3 * RED, 3)
    assert likeness(one, other) == likeness(other, one)


def test_nothing_is_said_of_who_was_not_seen() -> None:
    assert likeness(Looks(), seen(BLUE, 8)) == 0.0
    assert likeness(seen(BLUE, 1), seen(RED, 2)) == 0.0
    hidden = seen(BLUE, 8)
    hidden.see(None)
    assert likeness(hidden, seen(BLUE, 8)) == pytest.approx(1.6)


def test_one_image_of_somebody_says_less_than_many() -> None:
    other = BLUE + np.array([0.1, -0.3, 0.3])
    assert likeness(seen(other, 1), seen(BLUE, 8)) > likeness(seen(other, 8), seen(BLUE, 8))


def test_one_person_is_seldom_taken_for_two() -> None:
    rng = np.random.default_rng(3)
    said = [likeness(seen(BLUE, 8, rng), seen(BLUE, 20, rng)) for _ in range(300)]
    assert np.mean(np.array(said) < -3.0) < 0.01
    assert np.mean(said) > 1.0
