"""What each reward signal paid per episode, ML-Agents' `Policy/(Signal) Reward`: sums that go on between iterations."""

from collections.abc import Sequence

import torch
from torch import Tensor


class EpisodeRewards:
    """The sums of the episodes that are running, one row per environment."""

    def __init__(self, names: Sequence[str], env_count: int, device: torch.device) -> None:
        """Of signals of these names, in the order of the rewards' last dimension."""
        self._tags = [f"Policy/{name.capitalize()} Reward" for name in names]
        self.sums = torch.zeros(env_count, len(names), device=device)

    def add(self, rewards: Tensor, is_over: Tensor) -> dict[str, float]:
        """Counts decisions; by tag the mean sums of the episodes that ended with them, nothing if none did.

        Args:
            rewards: times their strength, shape (steps, envs, signals).
            is_over: where an episode ended with the decision, shape (steps, envs).
        """
        sums = rewards.cumsum(0) + self.sums
        steps = torch.arange(1, len(is_over) + 1, device=is_over.device)
        last = (steps[:, None] * is_over).amax(0)  # decisions until the last end of each environment; 0: none ended
        until = sums.gather(0, (last - 1).clamp(min=0)[None, :, None].expand(1, -1, sums.shape[-1]))[0]
        until = until * (last > 0)[:, None]
        self.sums = sums[-1] - until
        count = int(is_over.sum())
        if not count:
            return {}
        return {tag: total / count for tag, total in zip(self._tags, until.sum(0).tolist(), strict=True)}

    def clear(self) -> None:
        """All episodes begin anew."""
        self.sums = torch.zeros_like(self.sums)

    def load(self, sums: Tensor) -> None:
        """Goes on from sums that were saved."""
        self.sums = sums.to(self.sums.device)
