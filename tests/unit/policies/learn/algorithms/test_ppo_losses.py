import math

import pytest
import torch

from policies.learn.algorithms.gae import advantages, cut_at_horizon
from policies.learn.algorithms.ppo_losses import divergence, policy_loss, standardized, value_loss


def logs(*ratios):
    return torch.log(torch.tensor(ratios))


def test_the_policy_loss_clips_each_head_by_itself():
    # advantage 2: min(1.5 x 2, 1.2 x 2) = 2.4 and 0.5 x 2 = 1.0
    # advantage -1: 1.1 x -1 = -1.1 and min(-0.5, -0.8) = -0.8
    log_probs = logs([1.5, 0.5], [1.1, 0.5])
    loss = policy_loss(log_probs, torch.zeros(2, 2), torch.tensor([2.0, -1.0]), 0.2)
    assert loss.item() == pytest.approx(-(2.4 + 1.0 - 1.1 - 0.8) / 4.0)


def test_the_joint_ratio_is_clipped_once():
    # 1.5 x 0.5 = 0.75: min(0.75 x -1, 0.8 x -1) = -0.8
    joint = logs([1.5, 0.5]).sum(-1, keepdim=True)
    assert policy_loss(joint, torch.zeros(1, 1), torch.tensor([-1.0]), 0.2).item() == pytest.approx(0.8)


def test_a_clipped_ratio_has_no_gradient():
    log_probs = logs([1.5, 0.5]).requires_grad_()
    policy_loss(log_probs, torch.zeros(1, 2), torch.tensor([1.0]), 0.2).backward()
    assert log_probs.grad[0, 0] == 0.0
    assert log_probs.grad[0, 1] == pytest.approx(-0.25)  # half of -0.5: the mean of two heads


def test_the_value_loss_takes_the_greater_of_plain_and_clipped_error():
    # first row: value 1.0 from 0.0, clipped to 0.2; return 0.9: 0.01 against 0.49
    # second row: value 0.1 from 0.0, not clipped; return 0.5: 0.16
    values, old = torch.tensor([[1.0], [0.1]]), torch.zeros(2, 1)
    assert value_loss(values, old, torch.tensor([[0.9], [0.5]]), 0.2).item() == pytest.approx((0.49 + 0.16) / 2.0)


def test_divergence_is_zero_without_change_and_follows_its_formula():
    assert divergence(torch.zeros(3, 2), torch.zeros(3, 2)).item() == 0.0
    # whole action: ratio 1.5 x 0.5 = 0.75; -0.25 - ln 0.75
    assert divergence(logs([1.5, 0.5]), torch.zeros(1, 2)).item() == pytest.approx(-0.25 - math.log(0.75))


def test_standardized_advantages_have_mean_0_and_deviation_1():
    # mean 2, deviation sqrt(8 / 3)
    expected = torch.tensor([-2.0, 0.0, 2.0]) / math.sqrt(8.0 / 3.0)
    assert torch.allclose(standardized(torch.tensor([0.0, 2.0, 4.0])), expected)


def test_advantages_of_three_decisions_by_hand():
    # gamma 0.5, lambda 0.5; surprises 1 + 0.5 x 2 - 1 = 1; 0 + 0.5 x 3 - 2 = -0.5; 2 + 0.5 x 4 - 3 = 1
    # 1 at the end; -0.5 + 0.25 x 1 = -0.25; 1 + 0.25 x -0.25 = 0.9375
    def column(*params):
        return torch.tensor(params).view(-1, 1, 1)

    nothing = torch.zeros(3, 1, 1, dtype=torch.bool)
    found = advantages(
        column(1.0, 0.0, 2.0),
        column(1.0, 2.0, 3.0),
        column(2.0, 3.0, 4.0),
        nothing,
        nothing[..., 0],
        torch.tensor([0.5]),
        0.5,
    )
    assert found.flatten().tolist() == pytest.approx([0.9375, -0.25, 1.0])


def plain_advantages(rewards, values, next_values, is_final, is_cut, gamma, lambd):
    """Of one environment and one signal: each trajectory by itself, the sum of the definition."""
    found = []
    for t in range(len(rewards)):
        total, weight = 0.0, 1.0
        for k in range(t, len(rewards)):
            after = 0.0 if is_final[k] else next_values[k]
            total += weight * (rewards[k] + gamma * after - values[k])
            weight *= gamma * lambd
            if is_cut[k]:
                break
        found.append(total)
    return found


def test_advantages_are_those_of_each_trajectory_and_each_signal_by_itself():
    generator = torch.Generator().manual_seed(0)
    shape = (20, 5, 2)
    rewards, values, next_values = (torch.randn(shape, generator=generator) for _ in range(3))
    is_over = torch.rand(shape[:2], generator=generator) < 0.2
    is_terminated = is_over & (torch.rand(shape[:2], generator=generator) < 0.5)
    is_final = is_terminated[..., None] & torch.tensor([True, False])  # the second signal does not end with episodes
    is_cut = cut_at_horizon(is_over, 6)
    gammas = torch.tensor([0.9, 0.99])
    found = advantages(rewards, values, next_values, is_final, is_cut, gammas, 0.8)
    for i in range(shape[1]):
        for k in range(shape[2]):
            rows = (rewards[:, i, k], values[:, i, k], next_values[:, i, k], is_final[:, i, k], is_cut[:, i])
            expected = plain_advantages(*(row.tolist() for row in rows), gammas[k].item(), 0.8)
            assert found[:, i, k].tolist() == pytest.approx(expected, abs=1e-5)


def test_trajectories_are_cut_when_they_are_a_horizon_long():
    is_over = torch.zeros(8, 2, dtype=torch.bool)
    is_over[3, 1] = True
    cuts = cut_at_horizon(is_over, 3)
    assert cuts[:, 0].nonzero().flatten().tolist() == [2, 5]
    assert cuts[:, 1].nonzero().flatten().tolist() == [2, 3, 6]
