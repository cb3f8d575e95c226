"""Flights of the reproduction: what never comes to follow counts against the policy."""

from collections import Counter

from bench.follow.flights import FLIGHTS, fly, seeds_of
from bench.follow.stages import CELLS, Cell
from policies.experts.follower import ScriptedFollower
from policies.tasks.follow_me.scorecard import scorecard

CELL = Cell(50.0, 2.0)


class Misfit(ScriptedFollower):
    """Wants pictures that no camera sends."""

    image_shape = (3, 3, 4)


def test_no_flight_has_a_seed_of_trainings_or_of_another_flight():
    seeds = [seed for i in range(len(CELLS)) for seed in seeds_of(i)]
    assert len(set(seeds)) == len(CELLS) * FLIGHTS
    assert all(seed % 2 == 1 for seed in seeds)


def test_each_wind_blows_as_often_in_every_cell():
    for i in range(len(CELLS)):
        assert set(Counter(seed % 5 for seed in seeds_of(i)).values()) == {FLIGHTS // 5}


def test_a_flight_is_judged_from_the_companions_first_decision_on():
    track = fly(ScriptedFollower(), CELL, 4, seconds=2.0)
    assert len(track.time_s) == 20
    assert (track.trees_per_ha, track.owner_speed_max) == (50.0, 2.0)


def test_a_policy_that_never_engages_has_not_followed(capsys):
    card = scorecard([fly(Misfit(), CELL, 4, seconds=60.0)])
    assert (card.success.value, card.tracking.value) < (0.01, 0.01)
    assert "never followed: pictures of another size" in capsys.readouterr().out
