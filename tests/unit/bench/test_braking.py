"""What the guard's rule takes a vehicle to need to a stand is what one in flight does need."""

import pytest

from bench.follow.braking import config_of, rule_m, stops
from policies.tasks.follow_me.observe import DECISION_S
from policies.tasks.follow_me.tracked.quick_vehicle import QUICK


@pytest.mark.parametrize("parameters", [{}, QUICK], ids=["as it ships", "quick"])
@pytest.mark.parametrize("speed", [2.0, 4.0])
def test_the_rule_allows_for_the_way_to_a_stand_and_for_a_decision_but_not_for_much_more(speed, parameters) -> None:
    config = config_of("x500", 0.0, parameters)
    needed_m = float(stops(config, speed)[0].max()) + speed * float(DECISION_S)
    assert 0.85 * rule_m(config, speed) < needed_m < rule_m(config, speed)
