"""What a reward signal is: where the reward comes from, the task itself (extrinsic), demonstrations (GAIL) or novelty.

Signals see transitions, whoever collected them: a whole rollout of PPO (T, N), a minibatch (B,) of it or of a replay
memory. Each has its own discount and its own value head; the learner multiplies its rewards by its strength.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Protocol, runtime_checkable

import torch
from torch import Tensor


@dataclass(frozen=True, slots=True)
class Transitions:
    """Decisions and what came of them. All tensors share their leading dimensions, (T, N) or (B,)."""

    observations: Tensor  # (..., observation) float32
    next_observations: Tensor  # (..., observation); what the episode saw last, where it ended
    continuous: Tensor  # (..., continuous actions) float32, in [-1, 1]
    branches: Tensor  # (..., branches) int64
    rewards: Tensor  # (...) of the task
    is_ended: Tensor  # (...) bool, by what happened or by a limit

    def __getitem__(self, rows: Any) -> "Transitions":
        """Those that `rows` picks along the leading dimensions."""
        return Transitions(
            self.observations[rows],
            self.next_observations[rows],
            self.continuous[rows],
            self.branches[rows],
            self.rewards[rows],
            self.is_ended[rows],
        )

    def to(self, device: torch.device | str) -> "Transitions":
        """The same on a device."""
        return Transitions(*(getattr(self, column.name).to(device) for column in fields(self)))


@runtime_checkable
class RewardSignal(Protocol):
    """A source of reward, trained beside the policy."""

    name: str
    """As ML-Agents names it in TensorBoard tags, small: "extrinsic", "gail", "curiosity", "rnd"."""
    gamma: float
    strength: float
    is_episodic: bool
    """False: episode ends do not end the return of this signal (novelty does not end with an episode)."""

    def rewards(self, transitions: Transitions) -> Tensor:
        """Rewards before strength, one per transition, in one forward pass; no gradient."""
        ...

    def update(self, batch: Transitions) -> dict[str, float]:
        """Learns from one minibatch of the policy's transitions, (B,); TensorBoard tags to values."""
        ...

    def state(self) -> dict[str, Any]:
        """Networks, optimiser, generator: tensors and plain values."""
        ...

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on, bit for bit, from what `state` returned."""
        ...
