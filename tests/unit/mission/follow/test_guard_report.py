"""What a guard has changed, as the scorecard has it."""

from types import SimpleNamespace

import pytest

from mission.follow.guard_report import guard_row
from policies.companion.guard.interventions import HEIGHT, NEAR_SOMEBODY, NEAR_SOMETHING, NO_DEPTH, Interventions


@pytest.mark.parametrize(
    ("changed", "row"),
    [
        (None, ("changed by the guard", "no guard")),
        ({}, ("changed by the guard, per minute", "none")),
        (
            {HEIGHT: 3, NEAR_SOMETHING: 300, NEAR_SOMEBODY: 60, NO_DEPTH: 2},
            ("changed by the guard, per minute", "150 near something, 30 near somebody, 2 height"),
        ),
    ],
)
def test_the_scorecard_has_what_the_guard_changed_most_per_minute_of_decisions(changed, row):
    interventions = None if changed is None else Interventions()
    if changed:
        interventions.update(changed)
    skill = SimpleNamespace(interventions=interventions)
    assert guard_row(SimpleNamespace(skill=skill, decision_count=1200)) == row
