"""Behavioural cloning: a policy is trained to do what demonstrations did, beside PPO or SAC, or alone before them.

In: a policy and demonstrations. Beside an algorithm it has its own Adam over the policy's parameters, and its learning
rate falls to 0, as ML-Agents has it. Recurrent policies see stretches of consecutive decisions.
"""

import copy
from collections.abc import Iterator, Mapping
from typing import Any

import torch
from torch import Tensor

from policies.learn.config.behavior import BehavioralCloning
from policies.learn.networks.action_distributions import CLIP
from policies.learn.networks.policy import Policy
from policies.learn.signals.signal import Transitions
from policies.learn.signals.signal_losses import cloning_loss


class Cloning:
    """Cloning beside the updates of an algorithm."""

    def __init__(
        self,
        policy: Policy,
        settings: BehavioralCloning,
        demonstrations: Transitions,
        algorithm: tuple[float, int, int],
        seed: int,
    ) -> None:
        """Cloning that has not begun.

        Args:
            policy: trained in place.
            settings: the behaviour's `behavioral_cloning`.
            demonstrations: (decisions,), on the policy's device.
            algorithm: learning rate, batch size and epochs of the algorithm beside it; defaults of the settings.
            seed: of the order.
        """
        learning_rate, batch_size, epoch_count = algorithm
        self._policy = policy
        self._demonstrations = demonstrations
        self._generator = torch.Generator(demonstrations.rewards.device).manual_seed(seed)
        self._anneal_steps = settings.steps
        self._learning_rate = learning_rate * settings.strength
        self._batch_size = settings.batch_size or batch_size
        self._epoch_count = settings.num_epoch or epoch_count
        self._batch_limit = (
            max(1, settings.samples_per_update // self._batch_size) if settings.samples_per_update else 0
        )
        self._optimizer = torch.optim.Adam(policy.parameters(), lr=self._learning_rate)

    def update(self, steps: int) -> dict[str, float]:
        """Some epochs; TensorBoard tag to the mean loss.

        Args:
            steps: decisions the algorithm has collected so far, which the learning rate falls with.
        """
        fraction_left = max(0.0, 1.0 - steps / self._anneal_steps) if self._anneal_steps else 1.0
        if fraction_left == 0.0:
            return {"Losses/Pretraining Loss": 0.0}
        for group in self._optimizer.param_groups:
            group["lr"] = self._learning_rate * fraction_left
        losses: list[float] = []
        for _ in range(self._epoch_count):
            for count, batch in enumerate(
                _batches(self._policy, self._demonstrations, self._batch_size, self._generator)
            ):
                if self._batch_limit and count == self._batch_limit:
                    break
                losses.append(_learn(self._policy, batch, self._optimizer))
        return {"Losses/Pretraining Loss": sum(losses) / len(losses)}

    def state(self) -> dict[str, Any]:
        """The optimiser and the generator; the policy is saved by the algorithm."""
        return {"optimizer": copy.deepcopy(self._optimizer.state_dict()), "generator": self._generator.get_state()}

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on, bit for bit, from what `state` returned."""
        self._optimizer.load_state_dict(copy.deepcopy(state["optimizer"]))
        self._generator.set_state(state["generator"])


def clone(
    policy: Policy,
    demonstrations: Transitions,
    generator: torch.Generator,
    *,
    epoch_count: int = 10,
    batch_size: int = 1024,
    learning_rate: float = 1e-3,
) -> list[float]:
    """Trains a policy on demonstrations alone, a warm start; the mean loss of each epoch.

    A policy that normalises observations and has seen none takes the demonstrations' statistics first.
    """
    body = policy.body
    if body.normalizer is not None and body.normalizer.count == 1:
        body.normalize(demonstrations.observations)
    optimizer = torch.optim.Adam(policy.parameters(), lr=learning_rate)
    epochs = []
    for _ in range(epoch_count):
        losses = [_learn(policy, batch, optimizer) for batch in _batches(policy, demonstrations, batch_size, generator)]
        epochs.append(sum(losses) / len(losses))
    return epochs


def _batches(
    policy: Policy, demonstrations: Transitions, batch_size: int, generator: torch.Generator
) -> Iterator[Transitions]:
    """The demonstrations once in random order, cut to whole batches (at least one): (stretch, B / stretch)."""
    memory = policy.settings.memory
    length = min(memory.sequence_length, len(demonstrations.rewards)) if memory else 1
    count = len(demonstrations.rewards) // length
    size = min(max(batch_size // length, 1), count)
    device = demonstrations.rewards.device
    order = torch.randperm(count, generator=generator, device=device)
    offsets = torch.arange(length, device=device)[:, None]
    for first in range(0, count - size + 1, size):
        yield demonstrations[order[first : first + size] * length + offsets]


def _learn(policy: Policy, batch: Transitions, optimizer: torch.optim.Optimizer) -> float:
    """One step on (stretch, sequences); memory starts empty with each stretch and each episode."""
    if policy.memory_size:
        is_start = torch.cat([torch.ones_like(batch.is_ended[:1]), batch.is_ended[:-1]])
        distribution = policy(batch.observations, policy.start_memory(batch.rewards.shape[1]), is_start)
    else:
        distribution = policy(batch.observations)
    means: Tensor = distribution.mean
    means = means.tanh() if policy.is_squashed else means / CLIP  # as the task takes them; unclipped, for the slope
    loss = cloning_loss(means, distribution.choice_logs, batch.continuous, batch.branches)
    optimizer.zero_grad(set_to_none=True)
    loss.backward()  # type: ignore[no-untyped-call]
    optimizer.step()
    return loss.item()
