"""What the guard's rule takes a vehicle to need to a stand is what one in flight does need."""

import pytest

from bench.follow.braking import rule_m, stopping_m
from policies.tasks.follow_me.observe import DECISION_S


@pytest.mark.parametrize("speed", [2.0, 4.0])
def test_the_rule_allows_for_the_way_to_a_stand_and_for_a_decision_but_not_for_much_more(speed: float) -> None:
    needed_m = float(stopping_m("x500", speed, 0.0).max()) + speed * float(DECISION_S)
    assert 0.85 * rule_m(speed) < needed_m < rule_m(speed)
