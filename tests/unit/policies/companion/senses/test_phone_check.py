"""What the phone says of whom is taken for the owner."""

from collections.abc import Callable

import numpy as np
import pytest

from policies.companion.senses.looks import Looks
from policies.companion.senses.phone_check import PhoneCheck, PhoneFit, Suitor, Word
from policies.companion.senses.seen_owner import PersonNow

OFF = np.array([1.5, -1.0])  # [m] the phone's slow error
STEP_S = 0.5
Walk = Callable[[float], tuple[float, float]]


def north(t: float) -> tuple[float, float]:
    return (1.3 * t, 0.0)


def east(t: float) -> tuple[float, float]:
    return (0.0, 1.3 * t + 2.0)


def stands(_: float) -> tuple[float, float]:
    return (0.0, 0.0)


def askew(t: float) -> tuple[float, float]:
    return (1.13 * t, 0.65 * t)


def beside(t: float) -> tuple[float, float]:
    return (1.3 * t + 1.0, 1.5)


def person(walk: Walk, t: float, seen: np.random.Generator | None = None) -> PersonNow:
    """As somebody is, or as they are seen: off by 0.1 m and 0.2 m/s."""
    place, then = np.array(walk(t)), np.array(walk(t - 0.01))
    vel = (place - then) / 0.01
    if seen is not None:
        place, vel = place + seen.normal(0.0, 0.1, 2), vel + seen.normal(0.0, 0.2, 2)
    return PersonNow(np.array([*place, -1.0]), 0.01 * np.eye(2), vel, 0.04 * np.eye(2), 0.0)


class Talk:
    """A phone in somebody's pocket, a report each half second, with its usual noise or more."""

    def __init__(
        self, has_phone: Walk, noise: float = 1.0, seed: int = 5, wears: dict[Walk, tuple[float, ...]] | None = None
    ) -> None:
        self.wears = wears or {}
        self.check, self.rng = PhoneCheck(), np.random.default_rng(seed)
        self.has_phone, self.noise, self.t = has_phone, noise, 0.0
        self.fits: dict[Walk, PhoneFit] = {}

    def hear(self, owner: Walk | None, *others: Walk, met: bool = True, has_vel: bool = True) -> tuple[Word, int]:
        self.t += STEP_S
        who = person(self.has_phone, self.t)
        phone = who.pos_ned[:2] + self.noise * OFF + self.rng.normal(0.0, 0.3 * self.noise, 2)
        vel = who.vel + self.rng.normal(0.0, 0.2 * self.noise, 2)
        known = [
            Suitor(person(walk, self.t, self.rng), self.fits.setdefault(walk, PhoneFit()), self.looks(walk))
            for walk in (owner, *others)
            if walk
        ]
        first, rest = (known[0], known[1:]) if owner else (None, known)
        return self.check.hear(phone, vel if has_vel else None, STEP_S, first, rest, has_met_others=met)

    def looks(self, walk: Walk) -> Looks:
        looks = Looks()
        for _ in range(8 if walk in self.wears else 0):
            looks.see(self.rng.normal(self.wears[walk], (0.1, 0.2, 0.2)))
        return looks

    def words(
        self, owner: Walk | None, *others: Walk, times: int, met: bool = True, has_vel: bool = True
    ) -> list[Word]:
        return [self.hear(owner, *others, met=met, has_vel=has_vel)[0] for _ in range(times)]


@pytest.mark.parametrize("has_vel", [True, False])
def test_who_goes_as_the_phone_says_is_the_owner(has_vel: bool) -> None:
    assert Word.ANOTHER in Talk(north).words(east, north, times=12, has_vel=has_vel)
    assert set(Talk(north).words(north, east, times=60, has_vel=has_vel)) == {Word.AGREES}


def test_who_goes_another_way_is_not_the_owner_though_nobody_else_is_seen() -> None:
    talk = Talk(north)
    assert set(talk.words(north, times=10, met=False)) == {Word.AGREES}
    assert Word.NOBODY in talk.words(east, times=20, met=False)


@pytest.mark.parametrize("noise", [1.0, 4.0])
def test_an_owner_alone_is_not_doubted_however_bad_the_phone(noise: float) -> None:
    assert set(Talk(north, noise).words(north, times=120, met=False)) == {Word.AGREES}


def test_who_is_not_known_is_the_owner_after_reports_that_fit_and_others_are_not() -> None:
    talk = Talk(north)
    talk.words(north, times=20)
    talk.fits.clear()
    assert set(talk.words(None, east, times=10)) == {Word.AGREES}
    talk.fits.clear()
    said = [talk.hear(None, east, north) for _ in range(6)]
    assert (Word.ANOTHER, 1) in said
    assert (Word.ANOTHER, 0) not in said


@pytest.mark.parametrize("has_vel", [True, False])
def test_who_walks_beside_the_owner_is_not_preferred(has_vel: bool) -> None:
    said = [set(Talk(north, seed=k).words(north, beside, times=240, has_vel=has_vel)) for k in range(20)]
    assert sum(Word.ANOTHER in words for words in said) <= 2


def test_who_goes_thirty_degrees_another_way_is_seldom_taken_for_the_owner_and_not_for_long() -> None:
    reports, taken = 60 * 80, 0
    for seed in range(60):
        talk, is_taken = Talk(north, seed=seed), False
        for _ in range(80):
            taken += is_taken
            word, _ = talk.hear(askew if is_taken else None, *([] if is_taken else [askew]))
            is_taken = word is Word.ANOTHER or (is_taken and word is Word.AGREES)
    assert taken < 0.15 * reports


def test_a_phone_that_stands_still_is_not_with_who_walks() -> None:
    talk = Talk(stands)
    assert set(talk.words(stands, times=10, met=False)) == {Word.AGREES}
    assert Word.NOBODY in talk.words(north, times=20, met=False)


def test_its_slow_error_is_learned() -> None:
    talk = Talk(north)
    talk.words(north, times=30)
    owner = talk.check.owner(np.array(north(talk.t)) + OFF)
    assert owner is not None
    assert np.hypot(*(owner - np.array(north(talk.t)))) < 0.5


BLUE, RED = (-0.3, 0.5, 0.0), (0.6, 0.1, 0.0)


def test_who_looks_otherwise_than_the_owner_is_another_by_the_next_report() -> None:
    talk = Talk(north, wears={north: BLUE, east: RED})
    assert set(talk.words(north, east, times=20)) == {Word.AGREES}
    talk.fits[east], talk.fits[north] = talk.fits[north], talk.fits[east]  # they have met, and the owner is lost
    assert talk.hear(east, north) == (Word.ANOTHER, 0)


def test_who_looks_otherwise_is_the_owner_all_the_same_if_the_phone_is_with_them() -> None:
    talk = Talk(north, wears={north: BLUE, east: RED})
    talk.words(north, times=20)
    talk.wears[north] = RED  # they have put something on
    said = [talk.hear(None, north)[0] for _ in range(30)]
    assert Word.ANOTHER in said
    assert set(talk.words(north, times=20)) == {Word.AGREES}


def test_whom_the_phone_leaves_was_not_the_owner_and_what_they_wear_does_not_count() -> None:
    talk = Talk(north, wears={north: BLUE, beside: RED})
    talk.words(beside, times=20)
    talk.has_phone = east
    talk.wears[east] = BLUE
    assert Word.NOBODY in talk.words(beside, times=20)
    talk.fits.clear()
    assert (Word.ANOTHER, 0) in [talk.hear(None, east) for _ in range(8)]
