"""The page of the cars is what its recorded runs say, and the policy that ships is the one that was chosen."""

import numpy as np
import pytest

from bench.cars.__main__ import RUNS, shipped
from bench.cars.experiment import NEW_SPOTS, VALIDATION, Experiment
from bench.cars.experiments import EXPERIMENTS, SECTIONS
from bench.cars.page import DOCS, page_text
from bench.cars.result import Evaluated, Result, read_all
from bench.cars.run import configured, with_settings
from policies.tasks.catalogue import settings_of


def recorded():
    by_name = {}
    for result in read_all(RUNS):
        by_name.setdefault(result.experiment, []).append(result)
    return by_name


def test_the_page_is_what_its_recorded_runs_say():
    assert (DOCS / "cars.md").read_text(encoding="utf-8") == page_text(recorded())


def test_what_the_page_says_of_the_strength_of_imitation_is_what_was_trained():
    runs, text = recorded(), " ".join((DOCS / "cars.md").read_text(encoding="utf-8").split())
    rows = [f"parking1-goals-gail{kind}" for kind in ("", "-strong", "-even", "-alone")]
    signals = [configured(EXPERIMENTS[name], 1, "runs").behavior.reward_signals for name in ("parking1-gail", *rows)]
    assert [each.gail.strength for each in signals] == [0.002, 0.002, 0.05, 1.0, 1.0]
    assert [each.extrinsic.strength for each in signals] == [1.0, 1.0, 1.0, 1.0, 0.0]
    found = [[run.evaluations[0].successes == run.evaluations[0].episodes for run in runs[name]] for name in rows]
    assert [sum(each) for each in found] == [4, 5, 4, 3]
    assert (
        "are all found by four seeds of five with 0.002, by five with 0.05, by four with 1, as much as the task pays,"
        " and by three with GAIL alone" in text
    )
    on_goals, drawn, on_new = (
        100.0 * np.mean([getattr(run.evaluations[k], count) / run.evaluations[k].episodes for run in runs[rows[0]]])
        for k, count in ((0, "successes"), (0, "drawn_successes"), (1, "successes"))
    )
    assert f"{on_goals:.0f} % on those goals, {drawn:.0f} % with drawn actions, {on_new:.0f} % on new spots" in text


def test_recorded_runs_were_judged_on_what_their_experiments_name():
    for name, runs in recorded().items():
        labels = [judged.label for judged in EXPERIMENTS[name].judged]
        assert all([evaluated.label for evaluated in run.evaluations] == labels for run in runs)


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_experiment_is_of_a_recipe_and_settings_that_there_are(name):
    experiment = EXPERIMENTS[name]
    environment = configured(experiment, 1, "runs").env_settings
    for judged in experiment.judged:
        settings_of(environment.env_path, with_settings(environment.env_args, judged.settings))


def run(seed, *successes):
    evaluations = [Evaluated(str(k), count, 100, count, 0.0, {}) for k, count in enumerate(successes)]
    return Result("some", seed, 1, 1.0, 1, "", 1, [], evaluations)


def test_the_seed_that_ships_is_the_best_by_validation_not_by_test():
    experiment = Experiment("some", "Some", "parking1", judged=(NEW_SPOTS, VALIDATION))
    seed, judged = shipped(experiment, [run(1, 99, 90), run(2, 97, 95), run(3, 98, 95)])
    assert (seed, judged.successes) == (2, 95)
    assert shipped(experiment, []) is None
    assert shipped(Experiment("other", "Other", "parking1"), [run(1, 80), run(2, 90)]) is None


@pytest.mark.parametrize("experiment", SECTIONS[0].experiments, ids=lambda experiment: experiment.name)
def test_every_policy_of_the_headline_is_chosen_among_three_seeds_and_more(experiment):
    assert experiment.seeds >= 3
    assert sum(judged.chooses for judged in experiment.judged) == 1
