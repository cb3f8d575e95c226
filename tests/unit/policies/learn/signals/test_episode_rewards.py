"""Sums of rewards per episode, counted by hand: two environments, two signals."""

import pytest
import torch

from policies.learn.signals.episode_rewards import EpisodeRewards

TAGS = ("Policy/Extrinsic Reward", "Policy/Gail Reward")


def added(episodes, extrinsic, ends):
    """One iteration; the second signal pays ten times the first."""
    rewards = torch.tensor(extrinsic)
    return episodes.add(torch.stack((rewards, 10.0 * rewards), dim=-1), torch.tensor(ends))


def test_an_episode_counts_in_the_iteration_in_which_it_ends_with_all_that_it_was_paid():
    episodes = EpisodeRewards(("extrinsic", "gail"), 2, torch.device("cpu"))
    assert added(episodes, [[1.0, 5.0], [2.0, 5.0]], [[False, False], [False, False]]) == {}
    second = added(episodes, [[3.0, 5.0], [4.0, 5.0]], [[True, False], [False, False]])
    assert second == {TAGS[0]: 6.0, TAGS[1]: 60.0}
    third = added(episodes, [[8.0, 5.0], [1.0, 5.0]], [[True, True], [True, False]])
    assert third[TAGS[0]] == pytest.approx((12.0 + 1.0 + 25.0) / 3)
    assert episodes.sums.tolist() == [[0.0, 0.0], [5.0, 50.0]]


def test_cleared_sums_begin_anew():
    episodes = EpisodeRewards(("extrinsic", "gail"), 1, torch.device("cpu"))
    added(episodes, [[7.0]], [[False]])
    episodes.clear()
    assert added(episodes, [[2.0]], [[True]]) == {TAGS[0]: 2.0, TAGS[1]: 20.0}
