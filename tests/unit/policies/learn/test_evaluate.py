"""Evaluation: exactly so many episodes, none favoured for being short, the same for the same seed."""

import numpy as np
import pytest
import torch

from policies.learn.config.network import Memory, NetworkSettings
from policies.learn.evaluate import _quota, _Tally, evaluate
from policies.learn.networks.policy import Policy
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.layout import Element, Layout, LayoutError
from policies.tasks.task_params import Sampler

SETTINGS = task_settings("RollerBall", {})


def make_policy(layout=None, **network):
    layout = layout or build_task("RollerBall", 1).layout
    settings = NetworkSettings(hidden_units=16, num_layers=1, **network)
    return Policy(layout, settings, torch.Generator().manual_seed(0))


@pytest.mark.parametrize("episodes", [1, 7, 500, 1003])
def test_exactly_so_many_episodes_count(episodes):
    assert evaluate(make_policy(), "RollerBall", SETTINGS, episodes=episodes, seed=1).episodes == episodes


def test_each_environment_plays_the_same_number_of_episodes():
    quota = _quota(1003, 500)
    assert quota.sum() == 1003
    assert set(quota) == {2, 3}


def test_short_episodes_are_not_favoured():
    """One environment fails after 1 decision each time, the other succeeds after 10: the rate is one half."""
    tally = _Tally(np.array([4, 4]), longest=100)
    step = 0
    while not tally.is_complete:
        step += 1
        outcomes = np.array([Outcome.FELL, Outcome.SUCCESS if step % 10 == 0 else Outcome.RUNNING], dtype=np.int32)
        tally.count(np.array([-1.0, 0.5], dtype=np.float32), outcomes)
    evaluation = tally.evaluation()
    assert evaluation.success_rate == 0.5
    assert evaluation.mean_length == pytest.approx(5.5)
    assert evaluation.mean_return == pytest.approx(0.5 * -1.0 + 0.5 * 5.0)


def test_same_seed_gives_the_same_figures_and_another_seed_other_episodes():
    policy = make_policy()
    first, again, other = (evaluate(policy, "RollerBall", SETTINGS, episodes=50, seed=seed) for seed in (3, 3, 4))
    assert first == again
    assert first != other


def test_policy_is_not_changed():
    policy = make_policy(normalize=True, memory=Memory(memory_size=8))
    before = {name: tensor.clone() for name, tensor in policy.state_dict().items()}
    evaluate(policy, "RollerBall", SETTINGS, episodes=20, seed=1, is_greedy=False)
    assert all(torch.equal(tensor, before[name]) for name, tensor in policy.state_dict().items())


def test_endless_episodes_are_cut_and_count_as_timeouts():
    small = {"force_n": Sampler.constant(0.1)}
    evaluation = evaluate(make_policy(), "RollerBall", SETTINGS, episodes=20, seed=1, params=small, longest=3)
    assert evaluation.outcomes["timeout"] == 20 - evaluation.outcomes["success"]
    assert evaluation.mean_length <= 3.0


def test_policy_of_another_task_is_refused():
    policy = make_policy(Layout("Other", 1, (Element("a", "1"),), continuous=(Element("b", "1"),)))
    with pytest.raises(LayoutError, match="policy: made for another task or preset: task is Other there"):
        evaluate(policy, "RollerBall", SETTINGS, episodes=1, seed=0)
