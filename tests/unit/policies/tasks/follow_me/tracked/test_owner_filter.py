"""The owner's filter: laws of what it makes of sights."""

import numpy as np
import pytest

from policies.companion.senses.poses import Pose
from policies.companion.senses.seen_owner import SeenOwner, Sight

LEVEL = (0.0, 0.0, 0.0, 1.0)


def pose(k: int) -> Pose:
    return Pose(100_000 * k, (0.0, 0.0, -1.6), LEVEL)


def walked(vel: tuple[float, float], count: int, std_m: float = 0.0) -> SeenOwner:
    rng, owner = np.random.default_rng(0), SeenOwner()
    for k in range(1, count + 1):
        place = np.array([2.0 + 0.1 * k * vel[0], 0.1 * k * vel[1], -1.0])
        place[:2] += std_m * rng.normal(size=2)
        owner.see(Sight(place, has_depth=True), pose(k))
    return owner


def test_who_keeps_going_is_where_they_go() -> None:
    place, vel = walked((1.5, -0.5), 40).now(4_000_000)
    assert vel == pytest.approx([1.5, -0.5], abs=0.02)
    assert place == pytest.approx([8.0, -2.0, -1.0], abs=0.02)


def test_what_is_late_is_carried_on() -> None:
    place, _ = walked((2.0, 0.0), 40).now(4_300_000)
    assert place[0] == pytest.approx(10.0 + 0.6, abs=0.05)


def test_noise_is_filtered() -> None:
    _, vel = walked((1.0, 0.0), 60, std_m=0.05).now(6_000_000)
    assert vel == pytest.approx([1.0, 0.0], abs=0.35)


def test_who_stops_is_noticed_sooner_than_noise_would_be() -> None:
    owner = walked((3.0, 0.0), 40)
    for k in range(41, 46):
        owner.see(Sight(np.array([2.0 + 12.0, 0.0, -1.0]), has_depth=True), pose(k))
    assert owner.now(4_500_000)[1][0] < 1.0


def test_who_has_not_been_seen_for_long_is_believed_to_slow_down() -> None:
    owner = walked((2.0, 0.0), 40)
    _, soon = owner.now(4_300_000)
    _, late = owner.now(8_000_000)
    assert soon[0] == pytest.approx(2.0, abs=0.05)
    assert late[0] < 0.3


def test_who_comes_back_after_long_is_somebody_new() -> None:
    owner = walked((2.0, 0.0), 40)
    owner.see(Sight(np.array([0.0, 5.0, -1.0]), has_depth=True), pose(100))
    place, vel = owner.now(10_000_000)
    assert place == pytest.approx([0.0, 5.0, -1.0])
    assert vel == pytest.approx([0.0, 0.0])


def test_a_range_by_colours_alone_counts_less_than_its_direction() -> None:
    owner = SeenOwner()
    for k in range(1, 20):
        owner.see(Sight(np.array([2.0, 0.0, -1.0]), has_depth=True), pose(k))
    owner.see(Sight(np.array([2.6, 0.0, -1.0]), has_depth=False), pose(20))
    along = owner.now(2_000_000)[0][0] - 2.0
    owner.see(Sight(np.array([2.0, 0.6, -1.0]), has_depth=False), pose(21))
    aside = owner.now(2_100_000)[0][1]
    assert 0.0 < along < 0.1
    assert aside > 2.0 * along


@pytest.mark.parametrize("seed", range(5))
def test_wild_sights_do_not_make_it_diverge(seed: int) -> None:
    rng, owner, place, time_us = np.random.default_rng(seed), SeenOwner(), np.array([2.0, 0.0, -1.0]), 0
    for _ in range(300):
        time_us += int(rng.choice([0, 100_000, 300_000, 2_500_000]))
        place = place + rng.normal(0.0, 0.3, 3)
        eye = place + rng.normal(0.0, rng.choice([0.01, 1.0, 5.0]), 3)
        owner.see(Sight(place, has_depth=bool(rng.random() < 0.6)), Pose(time_us, tuple(eye), LEVEL))
        assert np.abs(owner.now(time_us)[1]).max() < 50.0
