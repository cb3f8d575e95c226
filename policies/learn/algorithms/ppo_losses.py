"""What PPO makes small (Schulman et al. 2017, arXiv 1707.06347), in ML-Agents' form; functions of tensors only."""

import torch
from torch import Tensor


def policy_loss(log_probs: Tensor, old_log_probs: Tensor, advantages: Tensor, epsilon: float) -> Tensor:
    """The clipped surrogate, negative, mean over rows and heads.

    Args:
        log_probs: of the actions taken, shape (B, heads): each head's ratio is clipped by itself. One column of sums:
            the ratio of the whole action.
        old_log_probs: when they were taken, shape (B, heads).
        advantages: shape (B,).
        epsilon: how far a ratio may move before it is clipped.
    """
    ratios = (log_probs - old_log_probs).exp()
    weights = advantages[:, None]
    return -torch.minimum(ratios * weights, ratios.clamp(1.0 - epsilon, 1.0 + epsilon) * weights).mean()


def value_loss(values: Tensor, old_values: Tensor, returns: Tensor, epsilon: float) -> Tensor:
    """Squared error, the greater of plain and clipped around the old values, mean over rows; (B, signals) each."""
    clipped = old_values + (values - old_values).clamp(-epsilon, epsilon)
    return torch.maximum((returns - values).square(), (returns - clipped).square()).mean()


def divergence(log_probs: Tensor, old_log_probs: Tensor) -> Tensor:
    """How far the policy has moved: estimate of KL(old, new) of whole actions, mean over rows.

    The estimator is (r - 1) - log r, never negative (Schulman 2020, "Approximating KL divergence", k3).
    """
    log_ratio = (log_probs - old_log_probs).sum(-1)
    return (log_ratio.exp() - 1.0 - log_ratio).mean()


def standardized(advantages: Tensor, among: Tensor | None = None) -> Tensor:
    """Brought to mean 0 and deviation 1, of all of them or of those that are given."""
    among = advantages if among is None else among
    return (advantages - among.mean()) / (among.std(correction=0) + 1e-10)
