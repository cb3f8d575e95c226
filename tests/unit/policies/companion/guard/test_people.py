"""The guard's rule of people, asked as the guard asks it."""

import numpy as np
import pytest

from policies.companion.guard.people import PeopleRule
from policies.companion.guard.settings import GuardSettings
from policies.companion.senses.seen_owner import PersonNow
from policies.companion.telemetry import Own

CHEST_M = 1.3


def closing_max(height_m: float, vertical: float) -> float:
    """How fast a vehicle may go [m/s] that moves up or down [m/s, down] at a height, 2.3 m before who stands."""
    own = Own(boot_us=0, pos_ned=(0.0, 0.0, -height_m), vel_ned=(0.0, 0.0, vertical), range_m=height_m)
    sure = 0.01 * np.eye(2)
    somebody = PersonNow(np.array([2.3, 0.0, -CHEST_M]), sure, np.zeros(2), sure, 0.0)
    asked = np.array([9.0, 0.0])
    level, (bound,) = PeopleRule(GuardSettings()).bound(asked, own, [somebody], has_depth=True, passes_over=False)
    assert level[0] == pytest.approx(bound.closing_max)
    return bound.closing_max


def test_height_that_a_vehicle_is_losing_lets_it_come_no_nearer() -> None:
    high, low = CHEST_M + 1.3, CHEST_M
    assert closing_max(high, 0.0) > closing_max(low, 0.0)  # it may pass over their head
    assert closing_max(high, 1.5) < closing_max(high, 0.5) < closing_max(high, 0.0)
    assert closing_max(high, -1.5) == closing_max(high, 0.0)  # nor does height that it only will have
    assert closing_max(low, 1.5) == closing_max(low, 0.0)
