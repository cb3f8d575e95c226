"""Advantage-weighted actor-critic (Nair et al. 2020, arXiv 2006.09359).

The critics value the policy's own actions; a recorded action counts by how much better than those it is.
"""

from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from policies.learn.config.offline import AwacHyperparameters
from policies.learn.networks.policy import Policy
from policies.offline.action_model import ActionModel
from policies.offline.algorithm import NormalizedBatches, require_plain, side_by_side
from policies.offline.critics import TwinCritics
from policies.offline.flat_parameters import FlatOptimizer
from policies.offline.losses import advantage_weights, td_loss, td_targets, weighted_cloning_loss


class Awac:
    """See `policies/offline/algorithm.py`."""

    tags: tuple[str, ...] = ("Losses/Critic Loss", "Losses/Policy Loss", "Policy/Extrinsic Value")

    def __init__(
        self,
        policy: Policy,
        batches: NormalizedBatches,
        hyperparameters: AwacHyperparameters,
        gamma: float,
        generators: tuple[torch.Generator, torch.Generator],
    ) -> None:
        """Untrained critics for a policy.

        Args:
            policy: untrained, trained in place.
            batches: what it learns from.
            hyperparameters: of AWAC.
            gamma: discount of the rewards.
            generators: of the critics' weights, on the CPU, and of the policy's draws.

        Raises:
            OfflineError: a policy with memory or images.
        """
        require_plain(policy, "awac")
        self._batches, self._settings, self._gamma = batches, hyperparameters, gamma
        self._generator = generators[1]
        self._actions = ActionModel(policy, deviation=1.0)
        self._critics = TwinCritics(policy, hyperparameters.tau, generators[0])
        learning = [*self._critics.networks.parameters(), *self._actions.parameters()]
        self._optimizer = FlatOptimizer(learning, hyperparameters.learning_rate, hyperparameters.max_grad_norm)

    def step(self, rows: Tensor) -> Tensor:
        """One step of critics and policy together; then the targets follow."""
        batch, settings, actions = self._batches.take(rows), self._settings, self._actions
        distribution = actions(batch.observations)
        outputs = self._critics.values(side_by_side(batch.observations, batch.continuous), batch.branches)
        with torch.no_grad():
            after = actions(batch.next_observations)
            seen = side_by_side(batch.next_observations, actions.draw(after, self._generator))
            next_values = self._critics.expected(seen, after.choice_logs, of_targets=True)
            targets = td_targets(batch.rewards, batch.is_terminated, next_values, self._gamma)
            seen = side_by_side(batch.observations, actions.draw(distribution, self._generator))
            own = self._critics.expected(seen, distribution.choice_logs)
            advantages = outputs.amin(dim=0) - own
            weights = advantage_weights(advantages, settings.inverse_temperature, settings.greatest_weight)
        critic_loss = td_loss(outputs, targets)
        log_probs = actions.log_probs(distribution, batch.continuous, batch.branches)
        policy_loss = weighted_cloning_loss(log_probs, weights)
        self._optimizer.step(critic_loss + policy_loss)
        self._critics.follow(self._optimizer)
        return torch.stack((critic_loss, policy_loss, own.mean())).detach()

    def set_learning_rate(self, learning_rate: float) -> None:
        """Of the next steps."""
        self._optimizer.set_learning_rate(learning_rate)

    def state(self) -> dict[str, Any]:
        """Critics, Adam and the generator of draws."""
        return {
            **self._critics.state(),
            "optimizer": self._optimizer.state(),
            "generator": self._generator.get_state(),
        }

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on from what `state` returned."""
        self._batches.refresh()
        self._critics.load_state(state)
        self._optimizer.load_state(state["optimizer"])
        self._generator.set_state(state["generator"].cpu())

    def take_critics(self, state: Mapping[str, Any]) -> None:
        """Starts from another run's critics if they fit."""
        self._batches.refresh()
        if self._critics.takes(state):
            self._critics.load_state(state)
