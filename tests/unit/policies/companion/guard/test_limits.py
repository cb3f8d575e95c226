"""How fast the guard lets a vehicle go: laws of stopping, kept by what it answers."""

import numpy as np
import pytest

from policies.companion.guard.limits import closing_max, faded, kept_off, stopping_speed
from policies.companion.guard.settings import GuardSettings

S = GuardSettings()
NORTH = np.array([1.0, 0.0])
STILL = np.zeros(2)


@pytest.mark.parametrize("free_m", [0.1, 1.0, 7.0])
@pytest.mark.parametrize("delay_s", [0.0, 0.3])
def test_who_brakes_after_the_delay_stands_at_the_end_of_the_way(free_m: float, delay_s: float) -> None:
    speed = stopping_speed(free_m, delay_s, 4.0)
    assert speed * delay_s + speed**2 / 8.0 == pytest.approx(free_m)


def test_no_way_no_speed() -> None:
    assert stopping_speed(0.0, 0.2, 4.0) == stopping_speed(-1.0, 0.2, 4.0) == 0.0


def test_full_speed_at_somebody_who_stands_never_touches_them() -> None:
    """The vehicle answers at once after the delay, and cannot brake better than it is taken to."""
    step_s, place, speed, wanted = 0.02, -8.0, 0.0, np.array([7.0, 0.0])
    commands = [0.0] * round(S.reaction_s / step_s)
    for _ in range(1000):
        most = closing_max(np.array([-place, 0.0]), np.array([speed, 0.0]), STILL, S.reaction_s, S)
        commands.append(float(kept_off(wanted, NORTH, most)[0]))
        speed += float(np.clip(commands.pop(0) - speed, -4.0 * step_s, 4.0 * step_s))
        place += speed * step_s
        assert place < -0.7
    assert place == pytest.approx(-S.owner_m, abs=0.15)


def test_who_comes_closer_is_given_way_to() -> None:
    away = kept_off(STILL, NORTH, closing_max(1.2 * NORTH, STILL, -2.0 * NORTH, 0.3, S))
    assert away[0] < -1.0
    assert away[1] == 0.0


def test_going_past_somebody_is_let_be() -> None:
    past = np.array([0.0, 3.0])
    assert kept_off(past, NORTH, closing_max(2.0 * NORTH, past, STILL, 0.3, S)) == pytest.approx(past)


def test_speed_fades_between_two_ages() -> None:
    assert [faded(age_s, 1.0, 3.0) for age_s in (0.5, 1.0, 2.0, 3.0, 9.0)] == [1.0, 1.0, 0.5, 0.0, 0.0]
