"""What the offline learner asks of an algorithm, and the minibatches that algorithms on single decisions see."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Protocol

import torch
from torch import Tensor

from policies.learn.networks.normalizer import LIMIT
from policies.learn.networks.policy import Policy
from policies.learn.rollout.replay_buffer import ReplayBatch
from policies.offline.store import OfflineStore


class OfflineError(ValueError):
    """What an offline algorithm does not do; the message is one sentence for the user."""


class OfflineAlgorithm(Protocol):
    """An algorithm on a store."""

    tags: tuple[str, ...]
    """Of what `step` returns, for TensorBoard."""

    def step(self, rows: Tensor) -> Tensor:
        """One gradient step on the decisions in these rows of the store; statistics, shape (tags,)."""
        ...

    def set_learning_rate(self, learning_rate: float) -> None:
        """Of the next steps."""
        ...

    def state(self) -> dict[str, Any]:
        """Networks other than the policy, optimisers, generators; critics, if there are any, as SAC keeps them."""
        ...

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on from what `state` returned."""
        ...

    def take_critics(self, state: Mapping[str, Any]) -> None:
        """Starts from the critics in what another run's `state` returned, if they fit."""
        ...


class NormalizedBatches:
    """Minibatches whose observations are as the policy's dense layers see them, and whose rewards are scaled."""

    def __init__(self, store: OfflineStore, policy: Policy, reward_scale: float = 1.0) -> None:
        """Batches for a policy, whose normaliser, if there is one, has its statistics already."""
        self._store = store
        self._reward_scale = reward_scale
        self._normalizer = policy.body.normalizer
        self._device = next(policy.parameters()).device
        self._scaling: tuple[Tensor, Tensor] | None = None
        self.refresh()

    def refresh(self) -> None:
        """Takes over what the policy's normaliser holds now; to be called when it was loaded."""
        if self._normalizer is not None:
            self._scaling = self._normalizer.mean.float(), 1.0 / self._normalizer.deviation

    def take(self, rows: Tensor) -> ReplayBatch:
        """The decisions in these rows of the store."""
        batch = self._store.take(rows)
        if self._device.type != "cpu":
            parts = {name: getattr(batch, name).to(self._device) for name in ReplayBatch.__dataclass_fields__}
            batch = ReplayBatch(**parts)
        rewards = batch.rewards if self._reward_scale == 1.0 else batch.rewards * self._reward_scale
        return replace(
            batch,
            observations=self._normalized(batch.observations),
            next_observations=self._normalized(batch.next_observations),
            rewards=rewards,
        )

    def _normalized(self, observations: Tensor) -> Tensor:
        if self._scaling is None:
            return observations
        mean, scale = self._scaling
        return observations.sub(mean).mul_(scale).clamp_(-LIMIT, LIMIT)


def require_plain(policy: Policy, trainer: str) -> None:
    """Refuses policies whose observations are more than one vector of floats.

    Raises:
        OfflineError: a memory, an image or a goal signal.
    """
    if policy.memory_size:
        raise OfflineError(f"network_settings: memory: is not supported with trainer_type {trainer}; bc has it")
    if policy.body.encoder is not None:
        raise OfflineError(f"trainer_type: {trainer} sees no images, and {policy.layout.task} as it is set shows one")
    if policy.body.hyper is not None:
        raise OfflineError(f"network_settings: goal_signal: is not supported with trainer_type {trainer}")


def side_by_side(observations: Tensor, continuous: Tensor) -> Tensor:
    """What critics see."""
    return torch.cat((observations, continuous), dim=1)
