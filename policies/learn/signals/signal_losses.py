"""Losses and rewards of imitation and novelty, as pure functions of tensors.

A logit is what the discriminator D gives before its sigmoid: D near 1 says "an expert did this".
"""

from collections.abc import Callable, Sequence
from typing import Literal

import torch
from torch import Tensor
from torch.nn import functional

RewardForm = Literal["ml-agents", "logit", "log"]

MAX_LOGIT = 16.1  # -log(1e-7): ML-Agents keeps D that far from 0 and 1
_TINY = 1e-7  # keeps the square root's slope finite where a gradient is zero


def discriminator_loss(expert_logits: Tensor, policy_logits: Tensor) -> Tensor:
    """Binary cross-entropy with the expert's rows as 1 and the policy's as 0: -log D(expert) - log(1 - D(policy))."""
    return functional.softplus(-expert_logits).mean() + functional.softplus(policy_logits).mean()


def gradient_penalty(estimate: Callable[[Tensor], Tensor], expert: Tensor, policy: Tensor, fractions: Tensor) -> Tensor:
    """How far the slope of D is from 1, squared, between the expert's inputs and the policy's (arXiv 1704.00028).

    As in ML-Agents the slope is that of D itself, not of its logit, and each input has a fraction of its own.

    Args:
        estimate: inputs (B, I) to D (B,).
        expert: inputs, (B, I).
        policy: inputs, (B, I).
        fractions: of the policy in the mixture, (B, I) in [0, 1].
    """
    inputs = torch.lerp(expert, policy, fractions).requires_grad_()
    (slope,) = torch.autograd.grad(estimate(inputs).sum(), inputs, create_graph=True)
    return ((slope.square().sum(dim=-1) + _TINY).sqrt() - 1.0).square().mean()


def code_divergence(expert_mean: Tensor, policy_mean: Tensor, sigma: Tensor) -> Tensor:
    """Divergence of VAIL's codes (B, C) with deviations (C,) from unit Gaussians, the expert's plus the policy's."""
    spread = 1.0 + sigma.square().log() - sigma.square()
    return -(spread - 0.5 * expert_mean.square() - 0.5 * policy_mean.square()).sum(dim=-1).mean()


def imitation_reward(logits: Tensor, form: RewardForm) -> Tensor:
    """GAIL's reward from the discriminator's logits.

    `ml-agents`: -log(1 - D), never negative. Each step pays, so whoever lives longer earns more: right where episodes
    end by failure only (walking, hovering), wrong where success ends them (the policy waits before the goal).
    `log`: log D, never positive. Each step costs, so the shortest way to any end is best: right where only success
    ends episodes; wrong where a crash does too (the policy seeks the wall).
    `logit`: log D - log(1 - D), of both signs, zero where policy and expert cannot be told apart (AIRL's form): the
    choice where episodes end by success and by failure.
    """
    logits = logits.clamp(-MAX_LOGIT, MAX_LOGIT)
    if form == "ml-agents":
        return functional.softplus(logits)
    if form == "log":
        return -functional.softplus(-logits)
    return logits


def half_squared_error(prediction: Tensor, target: Tensor) -> Tensor:
    """Half the squared distance of each row: ICM's reward and the terms of its forward loss."""
    return 0.5 * (prediction - target).square().sum(dim=-1)


def squared_error(prediction: Tensor, target: Tensor) -> Tensor:
    """The squared distance of each row: RND's reward and the terms of its loss."""
    return (prediction - target).square().sum(dim=-1)


def inverse_loss(
    continuous: Tensor, logits: Tensor, taken: Tensor, branches: Tensor, branch_sizes: Sequence[int]
) -> Tensor:
    """How badly ICM's inverse model guesses the action: summed over actions and branches, mean over rows.

    Args:
        continuous: guessed, (B, continuous actions).
        logits: guessed, (B, sum of branch sizes).
        taken: continuous actions, (B, continuous actions).
        branches: choices, (B, branches).
        branch_sizes: choices per branch; may be empty.
    """
    loss = squared_error(continuous, taken).mean()
    for k, part in enumerate(torch.split(logits, list(branch_sizes), dim=-1) if branch_sizes else ()):
        loss = loss + functional.cross_entropy(part, branches[:, k])
    return loss


def cloning_loss(means: Tensor, choice_logs: Tensor, expert: Tensor, branches: Tensor) -> Tensor:
    """How far a policy is from the expert: mean squared error, plus the mean cross-entropy of the branches.

    Args:
        means: of the policy's continuous actions, (..., continuous actions).
        choice_logs: log-probabilities of its choices, (..., branches, choices).
        expert: continuous actions, (..., continuous actions).
        branches: the expert's choices, (..., branches).
    """
    loss = means.new_zeros(())
    if expert.shape[-1]:
        loss = loss + functional.mse_loss(means, expert)
    if branches.shape[-1]:
        loss = loss - choice_logs.gather(-1, branches[..., None]).mean()
    return loss
