import math

import pytest
import torch

from policies.learn.signals.signal_losses import (
    MAX_LOGIT,
    cloning_loss,
    code_divergence,
    discriminator_loss,
    gradient_penalty,
    half_squared_error,
    imitation_reward,
    inverse_loss,
)

NONE = torch.zeros(2, 0)
NO_BRANCH = torch.zeros(2, 0, dtype=torch.int64)


def logit(probability):
    return torch.tensor([math.log(p / (1 - p)) for p in probability], dtype=torch.float64)


def test_the_discriminator_loss_is_the_cross_entropy_of_both_batches():
    loss = discriminator_loss(logit([0.8, 0.5]), logit([0.1, 0.3]))
    expert = -(math.log(0.8) + math.log(0.5)) / 2
    policy = -(math.log(0.9) + math.log(0.7)) / 2
    assert loss.item() == pytest.approx(expert + policy)


def test_the_gradient_penalty_of_a_linear_discriminator_is_its_slope():
    weights = torch.tensor([0.3, -0.4], dtype=torch.float64)  # of length 0.5, everywhere
    expert, policy = torch.randn(2, 7, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    penalty = gradient_penalty(lambda x: x @ weights, expert, policy, torch.full_like(expert, 0.3))
    assert penalty.item() == pytest.approx(0.25, rel=1e-6)


def test_the_gradient_penalty_is_taken_between_expert_and_policy():
    expert, policy = torch.tensor([[0.0, 0.0]]), torch.tensor([[1.0, 2.0]])
    fractions = torch.tensor([[0.25, 0.5]])
    penalty = gradient_penalty(lambda x: 0.5 * x.square().sum(dim=-1), expert, policy, fractions)  # slope = input
    assert penalty.item() == pytest.approx((math.hypot(0.25, 1.0) - 1) ** 2, rel=1e-4)


def test_a_flat_discriminator_has_a_finite_gradient():
    weight = torch.zeros(2, requires_grad=True)
    gradient_penalty(lambda x: x @ weight, torch.ones(3, 2), torch.zeros(3, 2), torch.rand(3, 2)).backward()
    assert torch.isfinite(weight.grad).all()


def test_unit_codes_have_no_divergence_and_others_that_of_gaussians():
    zero, one = torch.zeros(4, 3), torch.ones(3)
    assert code_divergence(zero, zero, one).item() == 0
    mean = torch.tensor([[1.0, 2.0, 0.0]])
    sigma = torch.tensor([0.5, 1.0, 2.0])
    gaussian = 0.5 * (sigma**2 + mean**2 - 1 - 2 * sigma.log()).sum()
    other = 0.5 * (sigma**2 - 1 - 2 * sigma.log()).sum()
    assert code_divergence(mean, torch.zeros(1, 3), sigma).item() == pytest.approx((gaussian + other).item())


def test_reward_forms_are_those_of_their_formulas():
    d = torch.tensor([0.1, 0.5, 0.9], dtype=torch.float64)
    logits = logit(d.tolist())
    torch.testing.assert_close(imitation_reward(logits, "ml-agents"), -(1 - d).log())
    torch.testing.assert_close(imitation_reward(logits, "log"), d.log())
    torch.testing.assert_close(imitation_reward(logits, "logit"), d.log() - (1 - d).log())


def test_rewards_are_bounded_and_keep_their_sign():
    logits = torch.tensor([-1e4, 1e4])
    assert imitation_reward(logits, "ml-agents").tolist() == pytest.approx([0, MAX_LOGIT], abs=1e-6)
    assert imitation_reward(logits, "log").tolist() == pytest.approx([-MAX_LOGIT, 0], abs=1e-6)
    assert imitation_reward(logits, "logit").tolist() == pytest.approx([-MAX_LOGIT, MAX_LOGIT])


def test_the_forward_error_is_half_the_squared_distance():
    assert half_squared_error(torch.tensor([[1.0, 2.0]]), torch.tensor([[0.0, 4.0]])).tolist() == [2.5]


def test_the_inverse_loss_sums_over_actions_and_branches():
    guessed, taken = torch.tensor([[1.0, 0.0], [0.0, 0.0]]), torch.tensor([[0.0, 0.0], [1.0, 1.0]])
    assert inverse_loss(guessed, NONE, taken, NO_BRANCH, ()).item() == pytest.approx(1.5)
    logits = torch.tensor([[0.2, 0.8, 0.5, 0.3, 0.2]]).log().repeat(2, 1)
    branches = torch.tensor([[1, 0], [0, 2]])
    loss = inverse_loss(NONE, logits, NONE, branches, (2, 3))
    expected = -(math.log(0.8) + math.log(0.5) + math.log(0.2) + math.log(0.2)) / 2
    assert loss.item() == pytest.approx(expected)


def test_the_cloning_loss_is_a_mean_over_actions_and_branches():
    means, expert = torch.tensor([[1.0, 0.0], [0.0, 0.0]]), torch.tensor([[0.0, 0.0], [1.0, 1.0]])
    no_logs = torch.zeros(2, 0, 1)
    assert cloning_loss(means, no_logs, expert, NO_BRANCH).item() == pytest.approx(0.75)
    logs = torch.tensor([[[0.2, 0.8, 0.0], [0.5, 0.3, 0.2]]]).log().repeat(2, 1, 1)
    branches = torch.tensor([[1, 0], [0, 2]])
    expected = -(math.log(0.8) + math.log(0.5) + math.log(0.2) + math.log(0.2)) / 4
    assert cloning_loss(NONE, logs, NONE, branches).item() == pytest.approx(expected)
    assert cloning_loss(means, logs, expert, branches).item() == pytest.approx(0.75 + expected)
