"""The velocity that a guard chooses, of maps whose solid cells are known: flown on, it stays clear."""

import numpy as np
import pytest

from policies.companion.guard.people import Somebody
from policies.companion.guard.rollouts import Rollouts
from policies.companion.guard.settings import GuardSettings
from policies.companion.senses.local_map import CELL_M, LocalMap
from policies.companion.senses.poses import Pose
from policies.companion.telemetry import Own

S = GuardSettings()
LEVEL = (0.0, 0.0, 0.0, 1.0)
SECTOR_RAD = np.pi / 90.0  # as fine as a picture of depth
BEARINGS = np.arange(180) * SECTOR_RAD


def around(trunk: tuple[float, float] | None, pos: np.ndarray) -> LocalMap:
    """A map of one sweep all round, in which a trunk of 0.2 m may stand."""
    ranges_m = np.full(180, 12.0)
    if trunk is not None:
        off = np.array(trunk) - pos
        angles = BEARINGS[:, None] + SECTOR_RAD * (np.arange(8) / 8.0 - 0.5)  # rays of each sector
        along_m = off[0] * np.cos(angles) + off[1] * np.sin(angles)
        chord_m2 = 0.2**2 - (off @ off - along_m**2)
        is_met = (along_m > 0.0) & (chord_m2 > 0.0)
        hit_m = np.where(is_met, along_m - np.sqrt(np.maximum(chord_m2, 0.0)), 12.0)
        ranges_m = np.minimum(hit_m.min(1), 12.0)
    seen = LocalMap()
    seen.sweep(BEARINGS, SECTOR_RAD, ranges_m, 12.0, Pose(0, (*pos, -1.6), LEVEL), 0)
    return seen


def own_at(pos: np.ndarray, vel: np.ndarray) -> Own:
    return Own(boot_us=0, pos_ned=(*pos, -1.6), vel_ned=(*vel, 0.0))


def test_what_is_clear_is_flown_as_wanted() -> None:
    wanted = np.array([3.0, -2.0])
    kept = Rollouts(S, asks_beside=True).clear_velocity(
        wanted, wanted, own_at(np.zeros(2), wanted), around(None, np.zeros(2))
    )
    assert kept == pytest.approx(wanted)


def test_where_nothing_has_been_seen_it_creeps() -> None:
    still = np.zeros(2)
    kept = Rollouts(S, asks_beside=True).clear_velocity(np.array([3.0, 0.0]), still, own_at(still, still), LocalMap())
    assert 0.3 < float(np.hypot(*kept)) <= S.unseen_speed + 1e-6


@pytest.mark.parametrize("asks_beside", [True, False])
def test_who_flies_along_the_edge_of_what_it_has_seen_keeps_its_hull_within_it_if_asked(asks_beside: bool) -> None:
    """A trunk just beyond the edge would be met by what is beside its middle."""
    wanted, pos, still = np.array([3.0, 0.0]), np.array([0.0, 0.2]), np.zeros(2)
    east = np.pi > BEARINGS
    seen = LocalMap()
    seen.sweep(BEARINGS[east], SECTOR_RAD, np.full(180, 12.0)[east], 12.0, Pose(0, (*pos, -1.6), LEVEL), 0)
    kept = Rollouts(S, asks_beside=asks_beside).clear_velocity(wanted, still, own_at(pos, still), seen)
    if not asks_beside:
        assert kept == pytest.approx(wanted)
        return
    assert float(kept[1]) > 0.0
    assert float(kept[0]) > 0.5 * float(wanted[0])  # away from the edge it goes on


def test_who_flies_past_a_trunk_that_it_knows_goes_on_away_from_it() -> None:
    """What is near where it is already, and unseen behind the trunk, is no reason to stand."""
    pos, wanted = np.zeros(2), np.array([0.0, 3.0])
    kept = Rollouts(S, asks_beside=True).clear_velocity(wanted, wanted, own_at(pos, wanted), around((0.0, -0.75), pos))
    assert float(kept[1]) > 2.0


def test_who_is_pressed_goes_back_to_where_it_has_not_looked() -> None:
    back, still = np.array([-2.0, 0.0]), np.zeros(2)
    pressing = [Somebody(np.array([1.0, 0.0]), -2.0, 1.0, 0.0)]
    kept = Rollouts(S, asks_beside=True).clear_velocity(back, still, own_at(still, still), LocalMap(), pressing)
    assert kept == pytest.approx(back)


@pytest.mark.parametrize("aside_m", [-0.3, 0.0, 0.3])
def test_who_has_to_give_way_gives_way_past_a_trunk_and_not_into_it(aside_m: float) -> None:
    """It would come to a stand there anyway, and then be nearer than on the way past."""
    back, still = np.array([-3.0, 0.0]), np.zeros(2)
    pressing = [Somebody(np.array([1.0, 0.0]), -3.0, 1.0, 0.0)]
    trunk = (-1.6, aside_m)
    around_it, own = around(trunk, still), own_at(still, still)
    kept = Rollouts(S, asks_beside=True).clear_velocity(back, still, own, around_it, pressing)
    assert float(kept[0]) < -0.5
    passes_m = abs(trunk[0] * float(kept[1]) - trunk[1] * float(kept[0])) / float(np.hypot(*kept))
    assert passes_m > 0.6


def test_who_gives_way_past_a_trunk_comes_nearer_to_nobody_else_than_they_allow() -> None:
    back, still = np.array([-3.25, 0.0]), np.zeros(2)
    for bearing in np.arange(0.0, 6.2, 0.1):
        other = Somebody(np.array([np.cos(bearing), np.sin(bearing)]), 0.7, 1.3, 0.0)
        people = [Somebody(np.array([1.0, 0.0]), -3.25, 1.0, 0.0), other]
        kept = Rollouts(S, asks_beside=True).clear_velocity(
            back, still, own_at(still, still), around((-1.1, -0.2), still), people
        )
        assert float(kept @ other.way) <= 0.7 + 1e-5
        if np.cos(bearing) > 0.5:  # nobody stands behind it
            assert float(kept[0]) < -0.5


def test_who_can_go_round_a_trunk_does_so_at_speed() -> None:
    """Slower and slower towards it, it would be left behind by whom it follows."""
    wanted, pos = np.array([4.0, 0.0]), np.zeros(2)
    kept = Rollouts(S, asks_beside=True).clear_velocity(wanted, wanted, own_at(pos, wanted), around((4.4, 0.1), pos))
    assert abs(float(kept[1])) > 0.5
    assert float(np.hypot(*kept)) == pytest.approx(4.0, abs=0.01)


@pytest.mark.parametrize("seed", range(12))
def test_who_flies_at_a_trunk_goes_round_it_or_stands_and_never_nearer_to_somebody_than_allowed(seed: int) -> None:
    """The vehicle answers a decision later, with a lag, and changes its velocity no faster than it is taken to."""
    rng = np.random.default_rng(seed)
    trunk, step_s = (float(rng.uniform(1.5, 8.0)), float(rng.uniform(-1.0, 1.0))), 0.1
    speed, closing_max, angle = rng.uniform(1.0, 6.0), rng.uniform(0.0, 3.0), rng.uniform(0.0, 6.2)
    person = Somebody(
        np.array([np.cos(angle), np.sin(angle)]), max(closing_max, speed * float(np.cos(angle))), 9.0, 0.0
    )
    wanted, pos, vel = np.array([speed, 0.0]), np.zeros(2), np.zeros(2)
    rollouts, asked, lag_s = Rollouts(S, asks_beside=True), [np.zeros(2)], S.reaction_s - step_s
    for _ in range(60):
        asked.append(rollouts.clear_velocity(wanted, asked[-1], own_at(pos, vel), around(trunk, pos), [person]))
        assert float(asked[-1] @ person.way) <= person.closing_max + 1e-5
        change = asked.pop(0) - vel
        vel = vel + change * min(step_s / lag_s, S.brake * step_s / max(float(np.hypot(*change)), 1e-6))
        pos = pos + step_s * vel
        assert float(np.hypot(*(pos - trunk))) > 0.2 + S.solid_m - 0.1 - 0.5**0.5 * CELL_M  # its floor, half a cell off
