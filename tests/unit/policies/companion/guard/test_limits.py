"""How fast the guard lets a vehicle go: laws of stopping, kept by what it answers."""

import pytest

from policies.companion.guard.limits import faded, stopping_speed


@pytest.mark.parametrize("free_m", [0.1, 1.0, 7.0])
@pytest.mark.parametrize("delay_s", [0.0, 0.3])
def test_who_brakes_after_the_delay_stands_at_the_end_of_the_way(free_m: float, delay_s: float) -> None:
    speed = stopping_speed(free_m, delay_s, 4.0)
    assert speed * delay_s + speed**2 / 8.0 == pytest.approx(free_m)


def test_no_way_no_speed() -> None:
    assert stopping_speed(0.0, 0.2, 4.0) == stopping_speed(-1.0, 0.2, 4.0) == 0.0


def test_speed_fades_between_two_ages() -> None:
    assert [faded(age_s, 1.0, 3.0) for age_s in (0.5, 1.0, 2.0, 3.0, 9.0)] == [1.0, 1.0, 0.5, 0.0, 0.0]
