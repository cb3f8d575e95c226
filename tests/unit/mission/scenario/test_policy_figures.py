"""How a policy did, as checks ask it: figures, and the moment when each was at its worst."""

from dataclasses import fields
from math import isnan, nan
from typing import get_args

import numpy as np
import pytest

from common.intervals import Interval
from mission.scenario.judging.event_checks import BUSY_S, MEASURED, busiest_s
from mission.scenario.judging.policy_figures import following_figures, scorecard_figures
from mission.scenario.parts.checks import Check, FigureName, MeasuredName
from mission.scenario.runner import AFTER_S, run_scenario
from mission.scenario.scenario import Scenario
from policies.tasks.follow_me.scorecard import Scorecard
from policies.tasks.follow_me.track import Track

BEGUN_S = 20.0
GOOD = [2.0] * 60


def track_of(distance_m, hidden=(), collided=(), bearing_deg=0.0, planned_s=None):
    """A sample each tenth of a second; and the simulated time of each."""
    count = len(distance_m)
    time_s = 0.1 * np.arange(1, count + 1)
    samples = np.arange(count)
    track = Track(
        time_s, np.array(distance_m), np.radians(np.broadcast_to(bearing_deg, count)), ~np.isin(samples, hidden),
        np.isin(samples, collided), 0.1 * count if planned_s is None else planned_s,
    )  # fmt: skip
    return track, BEGUN_S + time_s


def results(checks):
    return {each.name: each for each in checks}


def followed(flown, **asked):
    return results(following_figures(*flown, Check(following=asked).following))


def scored(flown, name, **bounds):
    (found,) = scorecard_figures(*flown, Check(scorecard={name: bounds}).scorecard)
    return found


EXCURSION = track_of([*GOOD[:20], 3.4, 3.8, 3.2, *GOOD[:20], 0.7, *GOOD[:16]], hidden=(5, 30, 31, 32), collided=(43,))


def test_following_is_worst_where_it_was_nearest_farthest_hidden_or_off_its_band():
    found = followed(EXCURSION, in_band_min=0.9, in_view_min=0.9, distance_min_m=1, distance_max_m=3)
    moments = {"in band": 22.2, "in view": 23.1, "nearest": 24.4, "farthest": 22.2, "collision": 24.4}
    assert {name: each.worst_s for name, each in found.items()} == pytest.approx(moments)
    assert found["farthest"].happened == "3.80 m at 22.2 s"
    assert found["collision"].happened == "a collision at 24.4 s"


def test_what_was_never_bad_has_no_worst_moment():
    found = followed(track_of(GOOD), in_band_min=0.9, in_view_min=0.9)
    assert all(each.passed and isnan(each.worst_s) for each in found.values())
    assert all(isnan(scored(track_of(GOOD), name, min=1).worst_s) for name in ("success", "tracking", "in_band"))


def test_what_ended_too_early_was_worst_at_its_end():
    found = followed(track_of(GOOD, planned_s=12.0), in_band_min=0.9, in_view_min=0.9, has_collision=False)
    assert [found[name].worst_s for name in ("in band", "in view")] == pytest.approx([26.0, 26.0])
    assert isnan(found["collision"].worst_s)


@pytest.mark.parametrize(
    ("name", "bound", "worst_s"),
    [
        ("success", "min", 24.4),
        ("tracking", "min", 22.1),
        ("collision", "max", 24.4),
        ("in_band", "min", 22.2),
        ("distance_rmse_m", "max", 22.2),
        ("distance_median_m", "max", 22.2),
        ("distance_median_m", "min", 24.4),
        ("bearing_error_deg", "max", 22.6),
        ("in_view", "min", 23.1),
        ("losses_per_minute", "max", 23.1),
        ("loss_s", "max", 23.1),
        ("reacquired", "min", 23.1),
        ("in_view", "max", nan),
        ("loss_s", "min", nan),
    ],
)
def test_each_figure_of_the_scorecard_has_its_worst_moment(name, bound, worst_s):
    bearing_deg = np.zeros(60)
    bearing_deg[25] = -40.0
    flown = EXCURSION[0].distance_m, (5, 30, 31, 32), (43,), bearing_deg
    assert scored(track_of(*flown), name, **{bound: 1}).worst_s == pytest.approx(worst_s, nan_ok=True)


def test_who_follows_no_more_in_the_end_fails_there():
    assert scored(track_of([*GOOD, 3.5]), "success", min=1).worst_s == pytest.approx(26.1)


def test_interventions_are_worst_where_most_came_within_ten_seconds():
    assert busiest_s(np.array([4.0, 20.0, 21.0, 20.0 + 0.5 * BUSY_S, 40.0, 41.0])) == 25.0
    assert isnan(busiest_s(np.array([])))


@pytest.fixture(scope="module")
def follow_flight():
    """A few seconds of following behind an owner, judged."""
    scenario = {
        "world": {"kind": "follow", "seed": 3000003},
        "owner": {"pace": "walk"},
        "vehicle": {"policy": {"name": "scripted"}, "script": ["arm", {"takeoff": 2.5}, {"let_policy_fly": 4}]},
        "checks": [
            {"following": {"distance_min_m": 0.5, "distance_max_m": 30}},
            {"scorecard": {"distance_median_m": {"max": 30}}},
            {"interventions": 10_000},
            {"figures": {"park_s": {"max": 30}}},
        ],
    }
    return run_scenario(Scenario.model_validate(scenario))


def test_moments_are_of_simulated_time(follow_flight):
    found = results(follow_flight.checks)
    begun_s = follow_flight.simulated_s - AFTER_S - 4.0
    for name in ("following: nearest", "following: farthest", "scorecard"):
        assert found[name].passed
        assert begun_s - 1.0 < found[name].worst_s < follow_flight.simulated_s
    changed = found["interventions"]
    assert (changed.margin == 10_000) == isnan(changed.worst_s)
    assert not changed.worst_s < begun_s - 1.0


def test_a_figure_that_no_step_has_measured_fails(follow_flight):
    figure = results(follow_flight.checks)["figures"]
    assert (figure.asked, figure.happened) == ("park_s max 30", "park_s was never measured")
    assert not figure.passed


def test_figures_have_bounds_and_the_moment_when_they_were_measured(tmp_path):
    (tmp_path / "parks.py").write_text(
        "async def parks(drone, run):\n    await drone.sleep(3.0)\n"
        "    run.measure(park_distance_m=0.25, policy_goto_s=12.0)\n    await drone.sleep(2.0)\n"
    )
    checks = [{"figures": {"park_distance_m": {"max": 0.2}, "policy_goto_s": {"min": 10, "max": 30}}}]
    given = {"vehicle": {"python": f"{tmp_path / 'parks.py'}:parks"}, "checks": checks}
    found = run_scenario(Scenario.model_validate(given)).checks
    assert [(each.name, each.passed, each.asked) for each in found] == [
        ("figures: park distance", False, "park distance at most 0.2 m"),
        ("figures: goto time", True, "goto time at least 10 s"),
        ("figures: goto time", True, "goto time at most 30 s"),
    ]
    assert found[0].happened == "0.25 m at 3.0 s"
    assert [each.margin for each in found] == pytest.approx([-0.05, 2.0, 18.0])


def test_names_are_those_of_what_is_measured():
    assert set(get_args(FigureName)) == {each.name for each in fields(Scorecard) if each.type is Interval}
    assert set(get_args(MeasuredName)) == MEASURED.keys()
