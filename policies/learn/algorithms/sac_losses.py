"""What soft actor-critic makes small, as functions of tensors (Haarnoja et al. 2018, arXiv 1812.05905).

An action has a continuous part, branches, or both. A critic gives a base value of observation and continuous part, and
a value for each choice of each branch; an action is worth the base and the values of its choices. So what is expected
over choices is exact, and only the continuous part is sampled. All values have a column per reward signal.
"""

import math
from collections.abc import Sequence

import torch
from torch import Tensor

DISCRETE_ENTROPY = 0.2  # of the greatest entropy of a branch, as ML-Agents aims at


def target_entropies(continuous_size: int, branch_sizes: Sequence[int]) -> list[float]:
    """The entropy each temperature aims at [nat]: of the continuous part if there is one, then of each branch."""
    continuous = [-float(continuous_size)] if continuous_size else []
    return continuous + [DISCRETE_ENTROPY * math.log(size) for size in branch_sizes]


def entropies(log_probs: Tensor, choice_logs: Tensor) -> Tensor:
    """The entropy of each part of the action [nat], shape (B, parts); of the continuous part one sample of it.

    Args:
        log_probs: of the continuous dimensions as drawn, shape (B, dimensions).
        choice_logs: log-probabilities of all choices, shape (B, branches, choices).
    """
    branches = -(choice_logs.exp() * choice_logs).sum(dim=2)
    return torch.cat((-log_probs.sum(dim=1, keepdim=True), branches), dim=1) if log_probs.shape[1] else branches


def action_values(values: Tensor, branches: Tensor) -> Tensor:
    """What each critic thinks of actions taken, shape (critics, B, signals).

    Args:
        values: base, then choices branch by branch, shape (critics, B, signals, 1 + branches x choices).
        branches: the choices taken, shape (B, branches).
    """
    base: Tensor = values[..., 0]
    if not branches.shape[1]:
        return base
    choices = values[..., 1:]
    choices = choices.reshape(*choices.shape[:3], branches.shape[1], -1)
    index = branches[None, :, None, :, None].expand(*choices.shape[:4], 1)
    taken: Tensor = choices.gather(4, index)[..., 0]
    return base + taken.sum(dim=3)


def expected_values(values: Tensor, choice_logs: Tensor) -> Tensor:
    """What the policy expects, by the lesser critic of each signal, shape (B, signals).

    Args:
        values: as in `action_values`, with the continuous part that the policy drew.
        choice_logs: log-probabilities of all choices, shape (B, branches, choices).
    """
    choices = (values[..., 1:] * choice_logs.exp().flatten(1)[:, None]).sum(dim=3)
    return (values[..., 0] + choices).amin(dim=0)


def critic_targets(rewards: Tensor, goes_on: Tensor, next_values: Tensor, gammas: Tensor) -> Tensor:
    """What the critics are to say, shape (B, signals).

    Args:
        rewards: of each signal, shape (B, signals).
        goes_on: 0.0 after a true end, 1.0 otherwise: what follows a timeout counts; shape (B, signals).
        next_values: of the observations after the decisions, entropy included, shape (B, signals).
        gammas: shape (signals,).
    """
    return rewards + gammas * goes_on * next_values


def critic_losses(values: Tensor, targets: Tensor) -> Tensor:
    """Half the mean squared error of each critic, shape (critics,).

    Args:
        values: shape (critics, B, signals).
        targets: shape (B, signals).
    """
    return 0.5 * (values - targets).square().mean(dim=(1, 2))


def policy_loss(expected: Tensor, entropy: Tensor, temperatures: Tensor) -> Tensor:
    """Falls as the policy expects more, over all signals, and as its entropy by temperature rises.

    Args:
        expected: shape (B, signals).
        entropy: shape (B, parts).
        temperatures: shape (parts,).
    """
    return -(expected.sum(dim=1) + entropy @ temperatures).mean()


def temperature_loss(log_temperatures: Tensor, entropy: Tensor, targets: Tensor) -> Tensor:
    """Falls with the temperature of a part whose entropy, shape (B, parts), is above its target, shape (parts,)."""
    return (log_temperatures * (entropy.detach().mean(dim=0) - targets)).sum()
