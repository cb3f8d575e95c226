"""A training stops early by episodes of its own split, and these are not played before they are worth it."""

from dataclasses import replace

import pytest
import torch
from pydantic import TypeAdapter

from policies.learn.config.environment import EnvironmentParameter
from policies.learn.config.network import NetworkSettings
from policies.learn.curriculum import Curriculum, RecentEpisodes
from policies.learn.evaluate import Evaluation, evaluate
from policies.learn.networks.policy import Policy
from policies.learn.success_target import SuccessTarget
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.task import Scores

SETTINGS = task_settings("Parking1", {"preset": "improved"})
TARGET = SuccessTarget(0.9, "Parking1", SETTINGS, episode_count=100)


def recent(successes, failures, least=10):
    episodes = RecentEpisodes(least)
    outcomes = [0] * len(Outcome)
    outcomes[Outcome.SUCCESS], outcomes[Outcome.HIT_WALL] = successes, failures
    episodes.add(Scores(tuple(outcomes), 0.0, 0.0))
    return episodes


def untrained():
    layout = build_task("Parking1", 1, SETTINGS).layout
    return Policy(layout, NetworkSettings(hidden_units=16), torch.Generator().manual_seed(0))


def curriculum(**parameters):
    adapter = TypeAdapter(EnvironmentParameter)
    return Curriculum({name: adapter.validate_python(value) for name, value in parameters.items()})


def test_policy_is_judged_on_the_runs_own_split():
    policy = untrained()
    judged = TARGET.judge(policy, recent(9, 1), curriculum(), 7)
    assert judged == evaluate(policy, "Parking1", SETTINGS, episodes=100, seed=7)
    unseen = SETTINGS.model_copy(update={"split": "test"})
    assert judged != evaluate(policy, "Parking1", unseen, episodes=100, seed=7)


@pytest.mark.parametrize("episodes", [recent(5, 5), recent(8, 0)], ids=["many fail", "few have ended"])
def test_policy_is_not_judged_before_training_episodes_succeed(episodes):
    assert TARGET.judge(untrained(), episodes, curriculum(), 7) is None


def test_policy_is_not_judged_before_the_last_lesson():
    criteria = {"behavior": "B", "measure": "progress", "threshold": 0.5}
    lessons = [{"name": "a", "value": 1.0, "completion_criteria": criteria}, {"name": "b", "value": 2.0}]
    assert TARGET.judge(untrained(), recent(10, 0), curriculum(some={"curriculum": lessons}), 7) is None


def test_target_is_reached_when_the_lower_end_of_the_interval_reaches_it():
    def judged(successes):
        return Evaluation({"success": successes, "hit_wall": 1000 - successes}, 0.0, 0.0)

    assert not TARGET.is_reached(judged(905))
    assert TARGET.is_reached(judged(930))


def test_policies_of_which_some_succeed_are_worth_more_than_any_return():
    """Of an environment that says of success no sooner than somebody does."""
    silent = Evaluation({"success": 0, "timeout": 100}, mean_return=400.0, mean_length=10.0, says_success=False)
    better = replace(silent, mean_return=401.0)
    succeeds = replace(silent, outcomes={"success": 1, "timeout": 99}, mean_return=-5.0, says_success=True)
    assert silent.worth < better.worth < succeeds.worth
