"""Behavioural cloning from a store: of single decisions, or of stretches for policies with memory; also of mixtures.

Filtered cloning is the same on the best episodes: the learner draws from those.
"""

from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from policies.learn.config.offline import BcHyperparameters
from policies.learn.networks.action_distributions import CLIP, ActionDistribution
from policies.learn.networks.observations import Observation
from policies.learn.networks.policy import Policy
from policies.learn.rollout.replay_buffer import ReplayBatch
from policies.learn.signals.signal_losses import cloning_loss
from policies.offline.flat_parameters import FlatOptimizer
from policies.offline.losses import choice_log_probs, mixture_log_probs
from policies.offline.store import OfflineStore


class StoreCloning:
    """See `policies/offline/algorithm.py`; rows have the shape (B,), or (steps, sequences) of a policy with memory."""

    tags: tuple[str, ...] = ("Losses/Policy Loss",)

    def __init__(self, policy: Policy, store: OfflineStore, hyperparameters: BcHyperparameters) -> None:
        """Cloning that has not begun.

        Args:
            policy: trained in place.
            store: what it learns from.
            hyperparameters: of cloning.
        """
        self._policy, self._store = policy, store
        self._device = next(policy.parameters()).device
        learning = [parameter for name, parameter in policy.named_parameters() if not name.startswith("perception")]
        self._optimizer = FlatOptimizer(learning, hyperparameters.learning_rate, hyperparameters.max_grad_norm)

    def step(self, rows: Tensor) -> Tensor:
        """One step towards what was recorded."""
        batch = self._store.take(rows.flatten())
        features = self._features(batch, rows)
        heads = self._policy.heads
        actions, branches = batch.continuous.to(self._device), batch.branches.to(self._device)
        if heads.mixture is not None:
            logs, means, log_sigmas = heads.components(features)
            means = self._bounded(means)
            log_probs = mixture_log_probs(logs, means, log_sigmas, actions)
            loss = -log_probs.mean()
            if branches.shape[1]:
                loss = loss - choice_log_probs(heads(features).choice_logs, branches).mean()
        else:
            distribution: ActionDistribution = heads(features)
            loss = cloning_loss(self._bounded(distribution.mean), distribution.choice_logs, actions, branches)
        self._optimizer.step(loss)
        return loss.detach()[None]

    def _features(self, batch: ReplayBatch, rows: Tensor) -> Tensor:
        """Of all decisions of a batch, flat, shape (B, features)."""
        body = self._policy.body
        images = None if self._store.images is None else self._store.images[rows.flatten()].to(self._device)
        observation = Observation(batch.observations.to(self._device), images)
        if not self._policy.memory_size:
            features: Tensor = body(observation)
            return features
        shaped = observation.mapped(lambda part: part.view(*rows.shape, *part.shape[1:]))
        is_ended = batch.is_ended.view(rows.shape)
        is_start = torch.cat([torch.ones_like(is_ended[:1]), is_ended[:-1]]).to(self._device)
        outputs: Tensor = body(shaped, self._policy.start_memory(rows.shape[1]), is_start)
        return outputs.flatten(0, 1)

    def _bounded(self, means: Tensor) -> Tensor:
        """As the task takes them; of clipped policies unclipped, for the slope."""
        return means.tanh() if self._policy.is_squashed else means / CLIP

    def set_learning_rate(self, learning_rate: float) -> None:
        """Of the next steps."""
        self._optimizer.set_learning_rate(learning_rate)

    def state(self) -> dict[str, Any]:
        """Adam."""
        return {"optimizer": self._optimizer.state()}

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on from what `state` returned."""
        self._optimizer.load_state(state["optimizer"])

    def take_critics(self, state: Mapping[str, Any]) -> None:
        """Cloning has none."""
