"""Implicit Q-learning (Kostrikov, Nair and Levine 2021, arXiv 2110.06169): only recorded actions are ever valued."""

from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from policies.learn.config.offline import IqlHyperparameters
from policies.learn.networks.policy import Policy
from policies.offline.action_model import ActionModel
from policies.offline.algorithm import NormalizedBatches, require_plain, side_by_side
from policies.offline.critics import TwinCritics
from policies.offline.flat_parameters import FlatOptimizer
from policies.offline.losses import advantage_weights, expectile_loss, td_loss, td_targets, weighted_cloning_loss
from policies.offline.stacked_networks import value_network


class Iql:
    """See `policies/offline/algorithm.py`. All networks share one vector, so a step has one gradient and one Adam."""

    tags: tuple[str, ...] = ("Losses/Critic Loss", "Losses/Value Loss", "Losses/Policy Loss", "Policy/Extrinsic Value")

    def __init__(
        self,
        policy: Policy,
        batches: NormalizedBatches,
        hyperparameters: IqlHyperparameters,
        gamma: float,
        generator: torch.Generator,
    ) -> None:
        """Untrained critics for a policy.

        Args:
            policy: untrained, trained in place.
            batches: what it learns from.
            hyperparameters: of IQL.
            gamma: discount of the rewards.
            generator: draws the critics' weights, on the CPU.

        Raises:
            OfflineError: a policy with memory or images.
        """
        require_plain(policy, "iql")
        self._batches, self._settings, self._gamma = batches, hyperparameters, gamma
        self._actions = ActionModel(policy, deviation=1.0)
        self._critics = TwinCritics(policy, hyperparameters.tau, generator)
        self._value = value_network(policy.layout, policy.settings, generator).to(next(policy.parameters()).device)
        learning = [*self._critics.networks.parameters(), *self._value.parameters(), *self._actions.parameters()]
        self._optimizer = FlatOptimizer(learning, hyperparameters.learning_rate, hyperparameters.max_grad_norm)

    def step(self, rows: Tensor) -> Tensor:
        """One step of critics, value and policy together; then the targets follow."""
        batch, settings = self._batches.take(rows), self._settings
        seen = side_by_side(batch.observations, batch.continuous)
        with torch.no_grad():
            best = self._critics.values(seen, batch.branches, of_targets=True).amin(dim=0)
            next_values = self._value(batch.next_observations)[0, :, 0]
            targets = td_targets(batch.rewards, batch.is_terminated, next_values, self._gamma)
        values = self._value(batch.observations)[0, :, 0]
        apart = best - values
        value_loss = expectile_loss(apart, settings.expectile)
        critic_loss = td_loss(self._critics.values(seen, batch.branches), targets)
        weights = advantage_weights(apart.detach(), settings.inverse_temperature, settings.greatest_weight)
        distribution = self._actions(batch.observations)
        log_probs = self._actions.log_probs(distribution, batch.continuous, batch.branches)
        policy_loss = weighted_cloning_loss(log_probs, weights)
        self._optimizer.step(critic_loss + value_loss + policy_loss)
        self._critics.follow(self._optimizer)
        return torch.stack((critic_loss, value_loss, policy_loss, best.mean())).detach()

    def set_learning_rate(self, learning_rate: float) -> None:
        """Of the next steps."""
        self._optimizer.set_learning_rate(learning_rate)

    def state(self) -> dict[str, Any]:
        """Critics, value and Adam."""
        return {
            **self._critics.state(),
            "value": self._value.state_dict(),
            "optimizer": self._optimizer.state(),
        }

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on from what `state` returned."""
        self._batches.refresh()
        self._critics.load_state(state)
        self._value.load_state_dict(state["value"])
        self._optimizer.load_state(state["optimizer"])

    def take_critics(self, state: Mapping[str, Any]) -> None:
        """Starts from another run's critics if they fit."""
        self._batches.refresh()
        if self._critics.takes(state):
            self._critics.load_state(state)
