"""The newest decisions of all environments as stretches of consecutive ones, images as bytes, in one preallocated ring.

In: what was seen and what a teacher would have done, decision by decision. Out: stretches drawn at random, with the
memory that the policy had before the first of them, as recurrent policies learn from them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from policies.learn.networks.action_distributions import Actions
from policies.learn.networks.observations import Observation
from policies.tasks.layout import Layout


@dataclass(frozen=True, slots=True)
class Stretches:
    """Consecutive decisions, (steps, stretches, ...)."""

    observation: Observation  # with the privileged elements: the labels of perception
    actions: Actions  # the teacher's, continuous ones in [-1, 1]
    is_start: Tensor  # (steps, stretches): an episode starts with this decision
    memory: Tensor  # (stretches, memory) of the policy before the first decision, when it was there


class SequenceRing:
    """A ring of rounds; each holds one stretch of every environment. Memory is taken as it fills."""

    def __init__(
        self, layout: Layout, capacity: int, env_count: int, *, length: int, memory_size: int, device: torch.device
    ) -> None:
        """An empty ring.

        Args:
            layout: of the task.
            capacity: decisions it holds, rounded down to whole rounds (at least one).
            env_count: stretches in a round.
            length: decisions in a stretch.
            memory_size: floats of the policy's memory.
            device: where it lies.
        """
        self.length = length
        self.env_count = env_count
        self.slots = max(1, capacity // (length * env_count))
        self.rounds = 0  # begun since the beginning
        shape = (self.slots, length, env_count)

        def zeros(*sizes: int, dtype: torch.dtype = torch.float32) -> Tensor:
            return torch.zeros((*shape, *sizes), dtype=dtype, device=device)

        self._parts = {
            "vectors": zeros(layout.observation_size),
            "images": zeros(*layout.image_shape, dtype=torch.uint8),
            "privileged": zeros(len(layout.privileged)),
            "continuous": zeros(len(layout.continuous)),
            "branches": zeros(len(layout.branches), dtype=torch.int64),
            "is_start": zeros(dtype=torch.bool),
            "memories": torch.zeros(self.slots, env_count, memory_size, device=device),
        }
        self._has_image = layout.image is not None

    def __len__(self) -> int:
        """Stretches that lie in the ring."""
        return min(self.rounds, self.slots) * self.env_count

    def open(self, memory: Tensor) -> int:
        """Begins a round over the oldest one, with the policy's memory before it; where it is written."""
        slot = self.rounds % self.slots
        self._parts["memories"][slot] = memory
        self.rounds += 1
        return slot

    def record(self, slot: int, t: int, observation: Observation, actions: Actions, is_start: Tensor) -> None:
        """Writes decision `t` of a round, of all environments."""
        parts = {"vectors": observation.vector, "images": observation.image, "privileged": observation.privileged}
        parts |= {"continuous": actions.continuous, "branches": actions.branches, "is_start": is_start}
        for name, part in parts.items():
            if part is not None:
                self._parts[name][slot, t] = part

    def vectors(self, slot: int) -> Tensor:
        """The floats seen in a round, shape (steps, envs, observation)."""
        return self._parts["vectors"][slot]

    def draw(self, count: int, generator: torch.Generator) -> Stretches:
        """Stretches, uniformly and with replacement."""
        device = self._parts["vectors"].device
        drawn = torch.randint(len(self), (count,), generator=generator, device=device)
        slot, i_env = drawn // self.env_count, drawn % self.env_count
        t = torch.arange(self.length, device=device)[:, None]
        picked = {name: part[slot, t, i_env] for name, part in self._parts.items() if name != "memories"}
        image = picked["images"] if self._has_image else None
        return Stretches(
            Observation(picked["vectors"], image, picked["privileged"]),
            Actions(picked["continuous"], picked["branches"]),
            picked["is_start"],
            self._parts["memories"][slot, i_env],
        )

    def state(self) -> dict[str, Any]:
        """What has been written."""
        filled = min(self.rounds, self.slots)
        return {"rounds": self.rounds, **{name: part[:filled].clone() for name, part in self._parts.items()}}

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Restores what `state` returned, of a ring of the same size."""
        self.rounds = state["rounds"]
        for name, part in self._parts.items():
            part[: len(state[name])] = state[name]
