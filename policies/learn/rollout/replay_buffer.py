"""The replay buffer: the newest transitions of all environments in one preallocated ring, from which batches are drawn.

A transition is one row of floats: what was seen before and after, what was done, what it paid, and whether that was the
end. After an episode's end the row holds what the episode saw last, never what the next one sees first.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from policies.learn.signals.signal import Transitions


@dataclass(frozen=True, slots=True)
class ReplayBatch:
    """Transitions, B of them."""

    observations: Tensor  # (B, elements) before it
    next_observations: Tensor  # (B, elements) after it
    continuous: Tensor  # (B, continuous actions) in [-1, 1]
    branches: Tensor  # (B, branches) int64, the choice of each
    rewards: Tensor  # (B,)
    is_terminated: Tensor  # (B,) 1.0 where nothing follows, 0.0 where it goes on or only the time was up
    is_ended: Tensor  # (B,) bool, also where the time was up

    def transitions(self) -> Transitions:
        """As reward signals see them."""
        return Transitions(
            self.observations, self.next_observations, self.continuous, self.branches, self.rewards, self.is_ended
        )


class Replay:
    """A ring of `slots` rounds, each one decision of all environments."""

    def __init__(
        self,
        capacity: int,
        env_count: int,
        observation_size: int,
        action_sizes: tuple[int, int],
        device: torch.device | str = "cpu",
    ) -> None:
        """An empty ring.

        Args:
            capacity: transitions it holds, rounded down to whole rounds (at least one).
            env_count: transitions in a round.
            observation_size: elements of an observation.
            action_sizes: continuous actions, and branches.
            device: where it lies.
        """
        self.env_count = env_count
        self.slots = max(1, capacity // env_count)
        self.rounds = 0  # written since the beginning
        self._widths = [observation_size, observation_size, *action_sizes, 1, 1, 1]
        self.rows = torch.zeros(self.slots, env_count, sum(self._widths), device=device)
        self._is_skipped: Tensor | None = None  # (slots, envs), what is never drawn; None: nothing

    @property
    def capacity(self) -> int:
        """Transitions that the ring holds when it is full."""
        return self.slots * self.env_count

    def __len__(self) -> int:
        """Transitions that lie in the ring."""
        return min(self.rounds, self.slots) * self.env_count

    def add(self, transitions: ReplayBatch, is_skipped: Tensor | None = None) -> None:
        """Writes one round, a transition of every environment, over the oldest.

        Args:
            transitions: of all environments.
            is_skipped: which of them are none and are never drawn, shape (envs,); not all of them.
        """
        if is_skipped is not None and self._is_skipped is None:
            self._is_skipped = torch.zeros(self.rows.shape[:2], dtype=torch.bool, device=self.rows.device)
        if self._is_skipped is not None:
            self._is_skipped[self.rounds % self.slots] = False if is_skipped is None else is_skipped
        parts = (
            transitions.observations,
            transitions.next_observations,
            transitions.continuous,
            transitions.branches,
            transitions.rewards[:, None],
            transitions.is_terminated[:, None],
            transitions.is_ended[:, None],
        )
        for column, part in zip(
            torch.split(self.rows[self.rounds % self.slots], self._widths, dim=1), parts, strict=True
        ):
            column.copy_(part)
        self.rounds += 1

    def draw(self, count: int, generator: torch.Generator) -> Tensor:
        """Places in the ring, uniformly and with replacement, shape (count,): slot x environments + environment."""
        drawn = torch.randint(len(self), (count,), generator=generator, device=self.rows.device)
        while self._is_skipped is not None:
            again = self._is_skipped.flatten()[drawn].nonzero()[:, 0]
            if not len(again):
                break
            drawn[again] = torch.randint(len(self), (len(again),), generator=generator, device=self.rows.device)
        return drawn

    def take(self, indices: Tensor) -> ReplayBatch:
        """Copies of the transitions at these indices."""
        columns = torch.split(self.rows.flatten(0, 1)[indices], self._widths, dim=1)
        before, after, continuous, branches, rewards, is_terminated, is_ended = columns
        ends = is_terminated[:, 0], is_ended[:, 0] > 0.0
        return ReplayBatch(before, after, continuous, branches.long(), rewards[:, 0], *ends)

    def state(self) -> dict[str, Any]:
        """What has been written."""
        written = slice(min(self.rounds, self.slots))
        skipped = {} if self._is_skipped is None else {"is_skipped": self._is_skipped[written].clone()}
        return {"rounds": self.rounds, "rows": self.rows[written].clone(), **skipped}

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Restores what `state` returned, of a ring of the same size."""
        self.rounds = state["rounds"]
        self.rows[: len(state["rows"])] = state["rows"]
        if "is_skipped" in state:
            self._is_skipped = torch.zeros(self.rows.shape[:2], dtype=torch.bool, device=self.rows.device)
            self._is_skipped[: len(state["rows"])] = state["is_skipped"]
