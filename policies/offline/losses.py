"""What offline algorithms make small, as pure functions of tensors.

IQL: Kostrikov, Nair and Levine 2021 (arXiv 2110.06169). TD3+BC: Fujimoto and Gu 2021 (arXiv 2106.06860). AWAC: Nair et
al. 2020 (arXiv 2006.09359). Continuous actions are in [-1, 1]; a policy's are a Gaussian around a mean in there.
"""

import math

import torch
from torch import Tensor

LOG_DEVIATION_LIMITS = (-5.0, 2.0)  # those of IQL's authors
_LOG_SQRT_2PI = 0.5 * math.log(2.0 * math.pi)


def expectile_loss(apart: Tensor, expectile: float) -> Tensor:
    """Mean squared distance, where what lies above counts by `expectile`, below by the rest (IQL eq. 5).

    Args:
        apart: critics' values less the estimate, shape (B,).
        expectile: 0.5 for the mean; near 1 for the best action that was recorded.
    """
    weights = torch.where(apart > 0.0, expectile, 1.0 - expectile)
    return (weights * apart.square()).mean()


def td_targets(rewards: Tensor, is_terminated: Tensor, next_values: Tensor, gamma: float) -> Tensor:
    """What the critics are to say, shape (B,): what follows a true end does not count; a timeout's does."""
    return rewards + gamma * (1.0 - is_terminated) * next_values


def td_loss(values: Tensor, targets: Tensor) -> Tensor:
    """Mean squared error of each critic (critics, B), summed over the critics."""
    return (values - targets).square().mean(dim=-1).sum()


def advantage_weights(advantages: Tensor, inverse_temperature: float, most: float) -> Tensor:
    """By how much each recorded action counts: the exponential of its advantage, at most `most`; shape (B,)."""
    return (inverse_temperature * advantages).exp().clamp(max=most)


def gaussian_log_probs(mean: Tensor, log_deviation: Tensor, actions: Tensor) -> Tensor:
    """Log-probability of continuous actions, summed over them, shape (...)."""
    return _log_densities(mean, log_deviation, actions).sum(dim=-1)


def clipped_log_probs(mean: Tensor, log_deviation: Tensor, actions: Tensor) -> Tensor:
    """Log-probability of continuous actions that were drawn and then clipped to [-1, 1], summed, shape (...).

    Where an action is a bound, that of all beyond it (Tobin 1958); elsewhere the density.
    """
    inside, inverse = _log_densities(mean, log_deviation, actions), (-log_deviation).exp()
    beyond = torch.special.log_ndtr(torch.where(actions > 0.0, (mean - 1.0) * inverse, (-1.0 - mean) * inverse))
    return torch.where(actions.abs() >= 1.0, beyond, inside).sum(dim=-1)


def choice_log_probs(choice_logs: Tensor, branches: Tensor) -> Tensor:
    """Log-probability of choices, summed over the branches, shape (...).

    Args:
        choice_logs: of all choices, shape (..., branches, choices).
        branches: the choices taken, shape (..., branches).
    """
    return choice_logs.gather(-1, branches[..., None])[..., 0].sum(dim=-1)


def weighted_cloning_loss(log_probs: Tensor, weights: Tensor) -> Tensor:
    """Falls as recorded actions become likelier, each by its weight, shapes (B,) (IQL eq. 7, AWAC eq. 9)."""
    return -(weights * log_probs).mean()


def td3_bc_policy_loss(
    values: Tensor, actions: Tensor, recorded: Tensor, alpha: float, size: Tensor | None = None
) -> Tensor:
    """TD3+BC eq. 3: climbs the critic, whose values are brought to mean size `alpha`, and stays at what was recorded.

    Args:
        values: of the policy's actions, shape (B,).
        actions: the policy's, shape (B, continuous actions).
        recorded: shape (B, continuous actions).
        alpha: weight of the critic; 0 is behavioural cloning.
        size: mean size of the values; none: that of these.
    """
    mean_size = values.detach().abs().mean() if size is None else size
    scale = alpha / mean_size.clamp(min=1e-6)
    return (actions - recorded).square().mean() - scale * values.mean()


def mixture_log_probs(component_logs: Tensor, means: Tensor, log_deviations: Tensor, actions: Tensor) -> Tensor:
    """Log-probability of actions under a mixture of Gaussians, shape (...).

    Args:
        component_logs: log-probability of each component, shape (..., components).
        means: shape (..., components, continuous actions).
        log_deviations: the same.
        actions: shape (..., continuous actions).
    """
    each = gaussian_log_probs(means, log_deviations, actions[..., None, :])
    return torch.logsumexp(component_logs + each, dim=-1)


def _log_densities(mean: Tensor, log_deviation: Tensor, actions: Tensor) -> Tensor:
    """Of each action by itself."""
    off = (actions - mean) * (-log_deviation).exp()
    return -0.5 * off.square() - log_deviation - _LOG_SQRT_2PI
