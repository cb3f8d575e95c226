"""What soft actor-critic makes small, as functions of tensors (Haarnoja et al. 2018, arXiv 1812.05905).

An action has a continuous part, branches, or both. The critics give one value per choice of each branch, and what an
action is worth is the sum over its branches; an action without branches counts as one branch of a single choice. So
the expectation over choices is taken exactly, and only the continuous part is sampled.
"""

from collections.abc import Sequence

import torch
from torch import Tensor

DISCRETE_ENTROPY = 0.2  # of the greatest entropy of a branch, as ML-Agents aims at


def target_entropies(continuous_size: int, branch_sizes: Sequence[int]) -> list[float]:
    """The entropy each temperature aims at [nat]: of the continuous part if there is one, then of each branch."""
    continuous = [-float(continuous_size)] if continuous_size else []
    return continuous + [DISCRETE_ENTROPY * float(torch.tensor(float(size)).log()) for size in branch_sizes]


def values_of(values: Tensor, branches: Tensor, sizes: Sequence[int]) -> Tensor:
    """What each critic thinks of the actions taken, shape (critics, B).

    Args:
        values: of all choices, branch by branch, shape (critics, B, sum of sizes).
        branches: the choices taken, shape (B, branches).
        sizes: choices of each branch; empty: `values` has one column.
    """
    if not sizes:
        return values[..., 0]
    starts = torch.tensor([sum(sizes[:k]) for k in range(len(sizes))], device=branches.device)
    columns = (branches + starts).expand(len(values), -1, -1)
    return values.gather(2, columns).sum(dim=2)


def entropies(log_prob: Tensor | None, log_probs: Sequence[Tensor]) -> Tensor:
    """The entropy of each part of the action [nat], shape (B, parts); of the continuous part one sample of it.

    Args:
        log_prob: of the sampled continuous part, shape (B,); None: there is none.
        log_probs: of all choices of each branch, (B, choices) each.
    """
    continuous = [-log_prob] if log_prob is not None else []
    return torch.stack(continuous + [-(branch.exp() * branch).sum(dim=1) for branch in log_probs], dim=1)


def soft_values(values: Tensor, log_probs: Sequence[Tensor], entropy: Tensor, temperatures: Tensor) -> Tensor:
    """What a state is worth to the policy: the lesser critic's value plus entropy by temperature, shape (B,).

    Args:
        values: of all choices, with the sampled continuous part, shape (critics, B, sum of choices or 1).
        log_probs: of all choices of each branch, (B, choices) each; none: `values` has one column.
        entropy: of each part, shape (B, parts).
        temperatures: of each part, shape (parts,).
    """
    least = values.amin(dim=0)
    probabilities = torch.cat(list(log_probs), dim=1).exp() if log_probs else torch.ones_like(least)
    return (probabilities * least).sum(dim=1) + (entropy * temperatures).sum(dim=1)


def critic_targets(rewards: Tensor, is_terminated: Tensor, next_values: Tensor, gamma: float) -> Tensor:
    """What the critics are to say, shape (B,): a timeout is no end, the value after it counts."""
    return rewards + gamma * (1.0 - is_terminated) * next_values


def critic_losses(values: Tensor, targets: Tensor) -> Tensor:
    """Half the mean squared error of each critic, shape (critics,)."""
    return 0.5 * (values - targets).square().mean(dim=1)


def temperature_loss(log_temperatures: Tensor, entropy: Tensor, targets: Tensor) -> Tensor:
    """Falls with the temperature of a part whose entropy, shape (B, parts), is above its target, shape (parts,)."""
    return (log_temperatures * (entropy.detach().mean(dim=0) - targets)).sum()
