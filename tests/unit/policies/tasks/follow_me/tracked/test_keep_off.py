"""The guard's rule of the owner: laws of how fast it may come nearer, and who obeys it stands in time."""

import numpy as np
import pytest
import warp as wp

from policies.tasks.follow_me.tracked.keep_off import (
    OWNER_BRAKE_M_S2,
    OWNER_M,
    REACTION_S,
    bounds,
    closing_max,
    distance_then,
    keep_off,
    kept_off,
    level_m,
    sinking_max,
)

RULE = keep_off()
_STOPS_M_S2 = 2.5  # how fast people are taken to stop
_DT_S = 0.01


def most(far_m: float, own: float = 0.0, leaving: float = 0.0, age_s: float = 0.0, over_m: float = 0.0) -> float:
    """How fast it may close [m/s] with somebody ahead."""
    return float(closing_max(RULE, wp.vec2(far_m, 0.0), wp.vec2(own, 0.0), wp.vec2(leaving, 0.0), 0.0, age_s, over_m))


def nearest_m(speed: float, age_s: float, start_m: float) -> float:
    """How near it comes to somebody who walks away and then stops, of whom it knows what was so long ago.

    The vehicle wants to go 3 m/s faster than they; what it may do it does after its reaction, and it brakes as well as
    the rule takes it to.
    """
    late, answers = round(age_s / _DT_S), round(REACTION_S / _DT_S)
    owner, own, velocities = [start_m], 0.0, [speed]
    at, asked, gaps = 0.0, [0.0] * (answers + 1), []
    for k in range(round(12.0 / _DT_S)):
        slower = max(velocities[-1] - _STOPS_M_S2 * _DT_S, 0.0) if k > round(5.0 / _DT_S) else velocities[-1]
        velocities.append(slower)
        owner.append(owner[-1] + slower * _DT_S)
        seen = max(len(owner) - 1 - late, 0)
        place = owner[seen] + age_s * velocities[seen]  # carried on, as the filter does
        asked.append(min(most(place - at, own, velocities[seen], age_s), speed + 3.0))
        change = np.clip(asked[-1 - answers] - own, -OWNER_BRAKE_M_S2 * _DT_S, 4.0 * _DT_S)
        own += float(change)
        at += own * _DT_S
        gaps.append(owner[-1] - at)
    return min(gaps)


@pytest.mark.parametrize("age_s", [0.0, 0.1, 0.2, 0.3])
@pytest.mark.parametrize("speed", [1.0, 2.0, 4.0])
def test_who_obeys_it_stands_in_time_behind_people_who_stop(speed: float, age_s: float) -> None:
    assert nearest_m(speed, age_s, start_m=3.0) > OWNER_M - 0.15


def test_full_speed_at_somebody_who_stands_ends_before_them() -> None:
    at, own, asked = -8.0, 0.0, [0.0] * round(REACTION_S / _DT_S)
    for _ in range(1500):
        asked.append(min(most(-at, own), 7.0))
        own += float(np.clip(asked.pop(0) - own, -OWNER_BRAKE_M_S2 * _DT_S, 4.0 * _DT_S))
        at += own * _DT_S
        assert at < 0.15 - OWNER_M
    untold_m = 0.5 * _STOPS_M_S2 * (REACTION_S + 0.25) ** 2  # of who sets off before the vehicle can know
    assert at == pytest.approx(-OWNER_M - untold_m, abs=0.2)


@pytest.mark.parametrize("age_s", [0.0, 0.2])
@pytest.mark.parametrize("far_m", [3.0, 5.0, 8.0])
@pytest.mark.parametrize("across", [0.0, 2.0])
def test_full_speed_at_somebody_who_then_turns_at_it_stands_before_they_meet(
    age_s: float, far_m: float, across: float
) -> None:
    """They set off at the vehicle when it can least bear that: as soon as it has come that near."""
    late, owner, vel = round(age_s / _DT_S), np.array([0.0, 0.0]), np.array([0.0, across])
    pos, own, asked = np.array([-12.0, -across * 2.0]), 0.0, [0.0] * round(REACTION_S / _DT_S)
    seen: list[tuple[np.ndarray, np.ndarray]] = []
    for _ in range(1500):
        way = owner - pos
        gap_m = float(np.hypot(*way))
        if gap_m < far_m:  # from now on they come
            vel = vel + _STOPS_M_S2 * _DT_S * -way / gap_m
        owner = owner + _DT_S * vel
        seen.append((owner.copy(), vel.copy()))
        place, told = seen[max(len(seen) - 1 - late, 0)]
        to_them = place + age_s * told - pos
        unit = to_them / np.hypot(*to_them)
        asked.append(
            min(closing_max(RULE, wp.vec2(*to_them), wp.vec2(*(own * unit)), wp.vec2(*told), 0.0, age_s, 0.0), 7.0)
        )
        own += float(np.clip(asked.pop(0) - own, -OWNER_BRAKE_M_S2 * _DT_S, 4.0 * _DT_S))
        if gap_m < far_m and own <= 0.0:
            break
        pos = pos + _DT_S * own * unit
    assert float(np.hypot(*(owner - pos))) > OWNER_M - 0.15


def test_who_is_over_somebody_need_not_give_way_to_them() -> None:
    assert most(0.3, leaving=-2.0, over_m=1.5) >= 0.0 > most(0.3, leaving=-2.0)


def test_going_past_somebody_is_let_be() -> None:
    past, way = wp.vec2(0.0, 3.0), wp.vec2(2.0, 0.0)
    most_m_s = closing_max(RULE, way, past, wp.vec2(0.0, 0.0), 0.0, 0.0, 0.0)
    assert tuple(kept_off(past, way, most_m_s)) == pytest.approx((0.0, 3.0))


def test_too_near_it_gives_way_and_the_faster_the_nearer() -> None:
    assert most(0.8) < 0.0
    assert most(0.5) < most(0.8)


def test_who_comes_is_given_way_to_and_who_goes_gives_room() -> None:
    assert most(2.0, leaving=-1.0) < most(2.0) < most(2.0, leaving=2.0)


def test_it_is_slower_the_older_the_picture() -> None:
    closing = [most(3.0, own=2.0, leaving=2.0, age_s=age_s) for age_s in (0.0, 0.1, 0.2, 0.3)]
    assert closing == sorted(closing, reverse=True)
    assert closing[0] > closing[-1]


def test_over_their_head_the_level_distance_does_not_count() -> None:
    assert float(level_m(RULE, 0.0)) == pytest.approx(OWNER_M)
    assert 0.0 < float(level_m(RULE, 1.0)) < OWNER_M
    assert float(level_m(RULE, 1.5)) == 0.0
    assert most(1.2, over_m=1.2) > most(1.2)


def sinks(far_m: float, own: tuple[float, float, float], other: float, over_m: float = 0.3) -> float:
    """How fast a vehicle may sink [m/s] near somebody in a direction between the axes; velocities along the way."""
    along, aside = np.array([0.6, -0.8]), np.array([0.8, 0.6])
    level = own[0] * along + own[1] * aside
    own_vel, other_vel = wp.vec3(*level, own[2]), wp.vec2(*(other * along))
    return float(bounds(RULE, wp.vec2(*(far_m * along)), own_vel, other_vel, 0.0, 0.1, over_m, 1).sinking_max)


def test_nearer_than_allowed_it_climbs_until_it_is_over_them() -> None:
    assert sinks(0.5, (0.0, 0.0, 0.0), 0.0) == pytest.approx(-2.3)
    assert sinks(0.5, (0.0, 0.0, 0.0), 0.0, over_m=1.45) == pytest.approx(0.0, abs=1e-6)


def test_who_can_be_given_way_to_no_more_is_climbed_over() -> None:
    assert sinks(2.5, (3.0, 0.0, 0.0), 0.0) == pytest.approx(-2.3)  # too fast at somebody who stands
    assert sinks(2.5, (0.0, 0.0, 0.0), -3.0) == pytest.approx(-2.3)  # they at it
    assert sinks(2.5, (1.0, 0.0, 0.0), 0.0) > 1.0  # it can brake
    assert sinks(2.0, (3.0, 0.0, 0.0), 3.0) > 1.0  # behind who runs away as fast
    assert sinks(2.5, (0.0, 3.0, 0.0), 0.0) > 1.0  # past them


def test_who_comes_is_climbed_over_in_time_even_if_it_goes_back_as_fast_as_they_come() -> None:
    """A trunk may end its way back."""
    assert sinks(2.2, (-4.0, 0.0, 0.0), -4.0) == pytest.approx(-2.3)
    assert sinks(1.6, (0.0, 0.0, 0.0), -2.0) < -1.0 < 1.0 < sinks(1.6, (0.0, 0.0, 0.0), 0.0)
    assert sinks(1.6, (0.0, 0.0, 0.0), 2.0) > 1.0  # they go


def test_what_it_climbs_over_somebody_is_by_the_height_that_it_has_when_it_answers() -> None:
    """It would climb on into crowns otherwise."""
    for down in (1.0, 0.0, -1.0):
        over_m = 1.3 - REACTION_S * down
        assert sinks(1.0, (0.0, 0.0, down), 0.0, over_m=1.3) == pytest.approx(2.0 * (over_m - 1.45), abs=1e-6)


def test_who_climbs_over_somebody_is_soon_over_them_and_goes_little_farther() -> None:
    """A vehicle that answers 0.2 s later, by 4.3 m/s² at most, as traces of flights show, asked ten times a second."""
    over_m, vel, asked, step_s, heights = 0.3, 0.0, [0.0] * 20, 0.01, []
    for k in range(300):
        if k % 10 == 0:
            down = sinks(0.8, (0.0, 0.0, -vel), 0.0, over_m=over_m)
        asked.append(max(-down, 0.0))
        vel += float(np.clip(asked.pop(0) - vel, -4.3 * step_s, 4.3 * step_s))
        over_m += vel * step_s
        heights.append(over_m)
    assert heights[120] > 1.15
    assert heights[200] > 1.35
    assert max(heights) < 1.6


def test_height_that_it_is_losing_is_none_to_keep_off_by_and_none_that_it_gains_yet() -> None:
    def keeps(down: float) -> float:
        vel = wp.vec3(0.0, 0.0, down)
        return float(bounds(RULE, wp.vec2(1.2, 0.0), vel, wp.vec2(0.0, 0.0), 0.0, 0.1, 1.2, 1).closing_max)

    assert keeps(1.0) < keeps(0.0)
    assert keeps(-1.0) == keeps(0.0)


def test_with_late_pictures_it_stays_over_the_chest_of_who_is_near_from_where_it_is_soon_over_their_head() -> None:
    assert float(sinking_max(RULE, 0.3, 2.0, 0.0, 0.0, 0.2, 1)) < -0.5
    assert float(sinking_max(RULE, 1.0, 2.0, 0.0, 0.0, 0.2, 1)) == pytest.approx(0.0, abs=1e-6)
    assert float(sinking_max(RULE, 2.0, 2.0, 0.0, 0.0, 0.2, 1)) > 1.0
    assert float(sinking_max(RULE, 0.3, 5.0, 0.0, 0.0, 0.2, 1)) > 10.0
    assert float(sinking_max(RULE, 0.3, 2.0, 0.0, 0.0, 0.1, 1)) > 10.0


def test_without_depth_it_stays_over_the_chest_of_who_is_near_as_with_late_pictures() -> None:
    """How far away they look is a seventh off."""
    for over_m, far_m in ((0.3, 2.0), (1.0, 2.0), (2.0, 2.0), (0.3, 5.0)):
        late, by_looks = (float(sinking_max(RULE, over_m, far_m, 0.0, 0.0, *how)) for how in ((0.2, 1), (0.1, 0)))
        assert late == by_looks


def test_what_it_takes_off_is_only_what_brings_it_nearer() -> None:
    kept = kept_off(wp.vec2(2.0, 1.0), wp.vec2(3.0, 0.0), 0.5)
    assert tuple(kept) == pytest.approx((0.5, 1.0))
    assert tuple(kept_off(wp.vec2(-2.0, 1.0), wp.vec2(3.0, 0.0), 0.5)) == pytest.approx((-2.0, 1.0))


def test_the_distance_then_is_less_by_what_both_do_meanwhile() -> None:
    then_m = float(distance_then(wp.vec2(3.0, 0.0), wp.vec2(2.0, 0.0), wp.vec2(0.0, 0.0), 0.5, 0.2))
    assert then_m == pytest.approx(3.0 - 0.5 * 2.0 - 0.5 * _STOPS_M_S2 * 0.49)
