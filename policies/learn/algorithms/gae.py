"""Generalised advantage estimation (Schulman et al. 2016, arXiv 1506.02438), for each reward signal by itself."""

import torch
from torch import Tensor


def advantages(
    rewards: Tensor,
    values: Tensor,
    next_values: Tensor,
    is_final: Tensor,
    is_cut: Tensor,
    gammas: Tensor,
    lambd: float,
) -> Tensor:
    """Advantages, shape (steps, envs, signals).

    Args:
        rewards: times their strength, shape (steps, envs, signals).
        values: of what each decision saw, shape (steps, envs, signals).
        next_values: of what came of it, the end of an episode included, shape (steps, envs, signals).
        is_final: where nothing is to come after the decision, by signal, shape (steps, envs, signals).
        is_cut: where the trace ends: episodes that ended, and trajectories cut at the time horizon; (steps, envs).
        gammas: discounts, shape (signals,).
        lambd: λ.
    """
    surprises = rewards + gammas * next_values.masked_fill(is_final, 0.0) - values
    keeps = (gammas * lambd * ~is_cut[..., None]).to(surprises.dtype)
    for t in range(len(surprises) - 2, -1, -1):
        surprises[t].addcmul_(keeps[t], surprises[t + 1])
    return surprises


def cut_at_horizon(is_over: Tensor, time_horizon: int) -> Tensor:
    """Where trajectories end: with their episode, or when they are `time_horizon` decisions long; (steps, envs)."""
    is_cut = is_over.clone()
    length = torch.zeros_like(is_over[0], dtype=torch.int64)
    for t in range(len(is_over) if len(is_over) > time_horizon else 0):
        length += 1
        is_cut[t] |= length == time_horizon
        length.masked_fill_(is_cut[t], 0)
    return is_cut
