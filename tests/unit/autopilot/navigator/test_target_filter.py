"""The filter of a followed target, and the circle of orbits."""

from math import cos, hypot, pi, sin

import numpy as np
import pytest

from autopilot.navigator.paths.orbit_circle import Circle, speed_limit
from autopilot.navigator.target_filter import TargetFilter

S = 1_000_000


def test_first_report_is_believed_and_carried_on():
    target = TargetFilter(0.3)
    assert target.time_us is None
    target.report(S, (1.0, 2.0, -3.0), (1.0, 0.0, 0.0), 0.5)
    assert target.at(3 * S) == pytest.approx((3.0, 2.0, -3.0))


@pytest.mark.parametrize("period_s", [0.2, 1.0])
def test_velocity_is_found_from_noisy_positions(period_s):
    rng = np.random.default_rng(0)
    target = TargetFilter(0.2)
    for i in range(int(40 / period_s)):
        t = i * period_s
        pos = np.array([2.0 * t, -1.0 * t, 0.0]) + rng.normal(0.0, 1.0, 3)
        target.report(int(t * S), tuple(pos), None, 1.0)
    assert target.vel_ned[:2] == pytest.approx((2.0, -1.0), abs=0.6)
    assert target.course_std < 0.4


def test_filter_is_as_wrong_as_it_says():
    """Normalised errors squared of 400 targets: chi-square with two degrees of freedom has the mean 2."""
    errors = []
    for seed in range(400):
        rng = np.random.default_rng(seed)
        target = TargetFilter(0.3)
        pos, vel = np.zeros(3), rng.normal(0.0, 1.0, 3)
        for i in range(12):
            if i:
                accel = rng.normal(0.0, 0.3, 3)
                pos, vel = pos + vel + 0.5 * accel, vel + accel
            target.report(i * S, tuple(pos + rng.normal(0.0, 0.5, 3)), None, 0.5)
        errors.append(((target.pos_ned[0] - pos[0]) ** 2 + (target.pos_ned[1] - pos[1]) ** 2) / target._level.pos_var)
    assert 1.7 < np.mean(errors) < 2.3


def test_a_jump_is_another_place_and_not_noise():
    target = TargetFilter(0.2)
    for i in range(20):
        target.report(i * S, (0.0, 0.0, 0.0), None, 0.5)
    target.report(20 * S, (200.0, 0.0, 0.0), None, 0.5)
    assert target.pos_ned == (200.0, 0.0, 0.0)
    assert target.vel_ned == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("speed", [61.0, 3.4e38, float("inf"), float("nan")])
def test_no_report_of_a_speed_that_nobody_has_is_believed_not_even_the_first(speed):
    target = TargetFilter(0.3)
    target.report(S, (1.0, 2.0, -3.0), (speed, 0.0, 0.0), 0.5)
    assert target.time_us is None
    target.report(2 * S, (1.0, 2.0, -3.0), (1.0, 0.0, 0.0), 0.5)
    target.report(3 * S, (2.0, 2.0, -3.0), (0.0, -speed, 0.0), 0.5)
    assert target.at(4 * S) == pytest.approx((3.0, 2.0, -3.0))


@pytest.mark.parametrize("position", [float("nan"), float("inf"), 3.4e38])
def test_a_place_that_is_none_does_not_stay(position):
    target = TargetFilter(0.3)
    for i in range(5):
        target.report(i * S, (0.0, position, 0.0), None, 0.5)
        target.report(i * S, (0.0, 0.0, position), None, 0.5)
    for i in range(5, 40):
        target.report(i * S, (10.0, 20.0, -3.0), None, 0.5)
    assert target.pos_ned == pytest.approx((10.0, 20.0, -3.0), abs=0.01)


@pytest.mark.parametrize("radius", [10.0, -25.0])
def test_point_runs_round_at_its_speed(radius):
    circle = Circle((5.0, 6.0, -7.0), radius, 3.0, (105.0, 6.0, 0.0))
    assert circle.pos_ned == pytest.approx((5.0 + abs(radius), 6.0, -7.0))
    before = circle.pos_ned
    circle.advance(0.001)
    moved = [(b - a) / 0.001 for a, b in zip(before, circle.pos_ned, strict=True)]
    assert moved == pytest.approx(circle.vel_ned, abs=0.01)
    assert (moved[1] > 0.0) == (radius > 0.0)  # clockwise seen from above: from north to east
    quarter = abs(radius) * 0.5 * pi / 3.0
    circle.advance(quarter)
    assert circle.turned_rad == pytest.approx(0.5 * pi, abs=0.01)
    assert hypot(circle.pos_ned[0] - 5.0, circle.pos_ned[1] - 6.0) == pytest.approx(abs(radius))


def test_headings_of_a_circle():
    circle = Circle((0.0, 0.0, 0.0), 10.0, 2.0, (0.0, 10.0, 0.0))
    assert (cos(circle.yaw_to_centre), sin(circle.yaw_to_centre)) == pytest.approx((0.0, -1.0), abs=1e-9)
    assert abs(circle.yaw_along) == pytest.approx(pi)  # at the east end of a clockwise circle: southwards
    assert circle.yaw_rate == pytest.approx(0.2)


def test_small_circles_are_slow():
    assert speed_limit(2.0, 3.0) < speed_limit(20.0, 3.0)
    assert speed_limit(10.0, 3.0) ** 2 / 10.0 < 3.0
