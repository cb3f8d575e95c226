"""The reward of the task itself."""

from collections.abc import Mapping
from typing import Any

from torch import Tensor

from policies.learn.signals.signal import Transitions


class ExtrinsicSignal:
    """What the task gives; nothing is learned."""

    name = "extrinsic"
    is_episodic = True

    def __init__(self, gamma: float = 0.99, strength: float = 1.0) -> None:
        self.gamma = gamma
        self.strength = strength

    def rewards(self, transitions: Transitions) -> Tensor:
        return transitions.rewards

    def update(self, batch: Transitions) -> dict[str, float]:  # noqa: ARG002  (the interface of all signals)
        return {}

    def state(self) -> dict[str, Any]:
        return {}

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Has nothing to restore."""
