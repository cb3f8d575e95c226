"""Flights of the reproduction: what never comes to follow counts against the policy."""

from bench.follow.flights import fly
from bench.follow.stages import Cell
from policies.experts.follower import ScriptedFollower
from policies.tasks.follow_me.scorecard import scorecard

CELL = Cell(50.0, 2.0)


class Misfit(ScriptedFollower):
    """Wants pictures that no camera sends."""

    image_shape = (3, 3, 4)


def test_a_flight_is_judged_from_the_companions_first_decision_on():
    track = fly(ScriptedFollower(), CELL, 4, seconds=2.0)
    assert len(track.time_s) == 20
    assert (track.trees_per_ha, track.owner_speed_max) == (50.0, 2.0)


def test_a_policy_that_never_engages_has_not_followed(capsys):
    card = scorecard([fly(Misfit(), CELL, 4, seconds=60.0)])
    assert (card.success.value, card.tracking.value) < (0.01, 0.01)
    assert "never followed: pictures of another size" in capsys.readouterr().out
