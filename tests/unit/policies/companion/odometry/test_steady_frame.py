"""A frame that stays where it was when the vehicle's estimate is set right."""

import pytest

from policies.companion.odometry.steady_frame import SteadyFrame

VEL_NED = (2.0, -1.0, 0.5)


def flown(frame, steps, start=0, jump=(0.0, 0.0, 0.0)):
    """So many positions of telemetry at 50 Hz, a jump of the estimate in the middle; the last in this frame."""
    for k in range(start, start + steps):
        is_set = k >= start + steps // 2
        pos = tuple(0.02 * k * v + (j if is_set else 0.0) for v, j in zip(VEL_NED, jump, strict=True))
        last = frame.steady(20_000 * k, pos, VEL_NED)
    return last


def test_a_jump_that_is_watched_moves_nothing_but_height():
    frame = SteadyFrame()
    frame.is_watched = True
    north, east, down = flown(frame, 100, jump=(3.0, -2.0, 0.4))
    assert (north, east, down) == pytest.approx((0.02 * 99 * 2.0, -0.02 * 99, 0.02 * 99 * 0.5 + 0.4))
    assert frame.shift_ne == pytest.approx((3.0, -2.0))


def test_whoever_is_known_by_gnss_stays_where_they_are_from_the_vehicle():
    frame = SteadyFrame()
    frame.is_watched = True
    own = flown(frame, 100, jump=(3.0, -2.0, 0.0))
    phone = frame.of((0.02 * 99 * 2.0 + 3.0 + 5.0, -0.02 * 99 - 2.0, 0.0))  # 5 m north of where the vehicle really is
    assert (phone[0] - own[0], phone[1] - own[1]) == pytest.approx((5.0, 0.0))


def test_a_jump_that_nobody_watches_is_passed_on():
    frame = SteadyFrame()
    assert flown(frame, 100, jump=(3.0, 0.0, 0.0))[0] == pytest.approx(0.02 * 99 * 2.0 + 3.0)
    assert frame.shift_ne == (0.0, 0.0)


def test_a_restart_begins_with_the_vehicles_own_frame():
    frame = SteadyFrame()
    frame.is_watched = True
    flown(frame, 100, start=1000, jump=(3.0, 0.0, 0.0))
    assert flown(frame, 1)[0] == 0.0
    assert frame.shift_ne == (0.0, 0.0)


def test_what_was_flown_while_nothing_was_heard_is_no_correction():
    frame = SteadyFrame()
    frame.is_watched = True
    frame.steady(0, (0.0, 0.0, 0.0), VEL_NED)
    assert frame.steady(3_000_000, (6.5, -3.5, 0.0), VEL_NED)[0] == 6.5


def test_a_message_that_was_overtaken_changes_nothing():
    frame = SteadyFrame()
    frame.is_watched = True
    flown(frame, 100, jump=(3.0, -2.0, 0.0))
    frame.steady(20_000 * 99 - 10_000, (0.0, 0.0, 0.0), VEL_NED)
    assert frame.shift_ne == pytest.approx((3.0, -2.0))
