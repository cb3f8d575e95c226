"""What stories of offline learning are of: tasks and conditions that there are, seeds apart, figures that are right."""

from dataclasses import asdict
from math import isnan, nan

import numpy as np
import pytest
from typer.testing import CliRunner

from bench.offline_story.__main__ import MIXES, TRAINERS, app
from bench.offline_story.page import DOCS, HEADING, LEARNT_FROM, Result, figures_of, section_lines
from bench.offline_story.story import STORIES, figure
from common.intervals import rate
from mission.benchmark.benchmark import TASKS, benchmark_of
from mission.benchmark.goal_flights import Crossing
from mission.benchmark.parking import Parking
from policies.tasks.catalogue import build_task, settings_of

PARKED, TOUCHED = Parking(1, "there", 9.0, 0.1, 2.0, 0.0, ""), Parking(3, "touched", 3.0, 2.0, 40.0, 0.0, "")
ARRIVED, STRUCK = Crossing(1, "arrived", 5.0, 1.0, ""), Crossing(3, "collision", nan, 20.0, "")


@pytest.mark.parametrize("name", STORIES)
def test_a_story_is_of_a_task_and_of_conditions_that_there_are(name):
    story = STORIES[name]
    titles = benchmark_of(story.benchmark).titles
    assert set(story.conditions) | set(story.recorded) <= set(titles)
    task = build_task(story.task, 1, settings_of(story.task, story.env_args))
    task.set_params(dict(story.numbers or {}))
    assert (DOCS / f"{story.page}.md").read_text(encoding="utf-8").count(HEADING) == 1
    assert len(story.pilot_titles) == 4
    assert set(story.pilots) == set(MIXES[""])
    assert story.benchmark in TASKS


@pytest.mark.parametrize("name", STORIES)
def test_nothing_is_judged_on_what_was_learnt_from(name):
    story = STORIES[name]
    count = story.sizes["flown"]
    seeds = {"flown": set(range(story.seeds["flown"], story.seeds["flown"] + 2 * count, 2))}
    assert all(seed % 2 == 1 for seed in seeds["flown"])
    for pilot in story.pilots if story.recorded else ():
        first = story.seeds[pilot]
        seeds[pilot] = set(range(first, first + 2 * story.sizes[pilot], 2))
        assert first % 2 == 0
        assert story.sizes[pilot] % len(story.recorded) == 0
    assert len(set.union(*seeds.values())) == sum(map(len, seeds.values()))


@pytest.mark.parametrize(
    ("name", "outcomes", "figures", "hits"),
    [
        ("park", (PARKED, TOUCHED), ((1.0, 0.0), (9.0, nan)), 1),
        ("navigate", (ARRIVED, STRUCK), ((5.0, 0.0), (1.0, 0.0)), 1),
    ],
)
def test_measures_are_of_the_benchmark_s_outcomes(name, outcomes, figures, hits):
    story, records = STORIES[name], [asdict(outcome) for outcome in outcomes]
    for measure, values in zip(story.measures, figures, strict=True):
        assert [measure.of(record) for record in records] == pytest.approx(values, nan_ok=True)
    assert sum(map(story.is_hit, records)) == hits


def test_a_figure_leaves_out_what_has_none_and_knows_fractions():
    assert figure([1.0, 0.0, 1.0]) == rate(np.array([True, False, True]))
    assert figure([4.0, nan, 6.0]).value == 5.0
    assert isnan(figure([nan]).value)


def test_the_section_says_how_far_from_the_mediocre_pilot_to_the_expert_learning_has_come():
    story = STORIES["park"]
    estimate = {"value": 1.0, "low": 0.0, "high": 2.0}
    verdict = {"robust": estimate, "fitted_q": estimate, "effective_episodes": 2.0, "outside": 0.1}
    reached = {condition: {"parked": [0.5, 0.4, 0.6], "seconds": [9.0, 8.0, 10.0]} for condition in story.conditions}
    names = {mix: [f"{mix}{trainer}" for trainer in TRAINERS] for mix in MIXES}
    forecasts = {mix: {"decisions": 1000, "policies": dict.fromkeys(names[mix], verdict)} for mix in MIXES}
    parked = {"clumsy": 1, "medium": 2, "offline": 3, "shipped": 5}
    flown = {
        pilot: {each: [asdict(PARKED)] * count + [asdict(TOUCHED)] * (5 - count) for each in story.conditions}
        for pilot, count in parked.items()
    }
    result = Result(
        forecasts=forecasts,
        validated={mix: dict.fromkeys(names[mix], reached) for mix in MIXES},
        matched=dict.fromkeys(("medium", "offline", "shipped"), reached),
        flown=flown,
        chosen={mix: names[mix][0] for mix in LEARNT_FROM},
        sizes={"clumsy": 8, "shipped": 4, "steps": 100},
    )
    lines = section_lines(story, result, figures_of(story, result))
    told = "of the way from the mediocre pilot to the policy that ships"
    assert f"- learnt from both, {told}: park 50 %, reverse 50 %" in lines
    (row,) = [line for line in lines if line.startswith("| learnt from both | park |")]
    assert "| 5 | 60.0 % (" in row
    assert row.endswith("| 50.0 % (40.0 to 60.0) | 9.0 s (8.0 to 10.0) | +10.0 |")


def test_a_story_that_there_is_not_is_refused():
    result = CliRunner().invoke(app, ["--story", "hover"])
    assert result.exit_code == 2
    assert "there are follow, park, navigate" in result.output.replace("\n", " ")


@pytest.mark.parametrize("kept", ["{}", None])
def test_a_folder_with_a_story_of_other_numbers_is_not_gone_on_with(tmp_path, kept):
    (tmp_path / "park" / "logs").mkdir(parents=True)
    if kept is not None:
        (tmp_path / "park" / "given.json").write_text(kept)
    result = CliRunner().invoke(app, ["--story", "park", "--folder", str(tmp_path)])
    assert result.exit_code == 1
    assert (
        "holds a story of other numbers; take another --folder, or remove it" in str(result.exception) + result.output
    )
