"""The policy: what acts. Observations in, actions out; saved with the layout it was made for."""

import torch
from torch import Tensor, nn

from policies.learn.config.network import NetworkSettings
from policies.learn.networks.action_distributions import ActionDistribution, ActionHeads, Actions, bounded
from policies.learn.networks.networks import policy_body
from policies.learn.networks.observations import Observation
from policies.learn.networks.perception import Beliefs, Perception
from policies.tasks.layout import Layout


class Policy(nn.Module):
    """An actor for one layout. `forward` and `act` take as many rows as they are given; each is for itself."""

    def __init__(
        self, layout: Layout, settings: NetworkSettings, generator: torch.Generator, *, is_squashed: bool = False
    ) -> None:
        """An untrained policy.

        Args:
            layout: of the task.
            settings: of the network.
            generator: draws the weights, on the CPU.
            is_squashed: SAC's continuous actions, tanh of a Gaussian whose deviation depends on the observation, in
                place of PPO's, which are clipped.
        """
        super().__init__()
        self.layout = layout
        self.settings = settings
        self.is_squashed = is_squashed
        self.body = policy_body(layout, settings, generator)
        self.heads = ActionHeads(
            self.body.size,
            len(layout.continuous),
            layout.branch_sizes,
            generator,
            is_sigma_learned_by_state=is_squashed,
            components=settings.mixture,
        )
        self.perception = (
            Perception(self.body.size, layout, settings.perceives, generator) if settings.perceives else None
        )

    @property
    def memory_size(self) -> int:
        """Floats of memory per row; 0: feed-forward."""
        return self.body.memory_size

    def start_memory(self, row_count: int) -> Tensor:
        """Memory at the start of an episode, shape (rows, memory)."""
        return torch.zeros(row_count, self.memory_size, device=next(self.parameters()).device)

    def forward(
        self, observations: Tensor | Observation, memory: Tensor | None = None, is_start: Tensor | None = None
    ) -> ActionDistribution:
        """Of (..., observation), or with memory of (steps, sequences, observation): see `Recurrence.forward`."""
        distribution: ActionDistribution = self.heads(self.body(observations, memory, is_start))
        return distribution

    def act(
        self, observations: Tensor | Observation, memory: Tensor, generator: torch.Generator | None = None
    ) -> tuple[Actions, Tensor]:
        """One decision per row.

        Args:
            observations: shape (rows, observation); with its image if the layout has one.
            memory: from `start_memory` or from the last decision, shape (rows, memory).
            generator: draws the actions; none: the most probable ones.

        Returns:
            The actions, and the memory after them.
        """
        features, memory = self.body.step(observations, memory)
        distribution: ActionDistribution = self.heads(features)
        if generator is None:
            return distribution.mode(), memory
        return distribution.draw(generator), memory

    def act_and_believe(
        self, observations: Tensor | Observation, memory: Tensor
    ) -> tuple[Actions, Tensor, Beliefs | None]:
        """One decision per row as `act` takes it without a generator, and what is believed; none without beliefs."""
        features, memory = self.body.step(observations, memory)
        beliefs: Beliefs | None = self.perception(features) if self.perception is not None else None
        return self.heads(features).mode(), memory, beliefs

    def bounded(self, actions: Actions) -> Tensor:
        """The continuous actions as the task takes them, [-1, 1], shape (rows, continuous)."""
        return actions.continuous.tanh() if self.is_squashed else bounded(actions.continuous)
