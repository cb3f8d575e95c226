"""Who recorded the decisions, as far as the recording tells: a Gaussian of actions, fitted by behavioural cloning.

In: some episodes of a store, all of one pilot. Out: how likely actions are at an observation. A tenth of the episodes
is held out, and the weights with which these are likeliest are kept. Actions at a bound are taken to be clipped.
"""

import math

import torch
from torch import Tensor

from policies.offline.flat_parameters import FlatOptimizer
from policies.offline.losses import clipped_log_probs
from policies.offline.stacked_networks import StackedNetworks
from policies.offline.store import OfflineStore

_RATE, _BATCH, _LOOK, _PATIENCE = 1.0e-3, 512, 100, 5
_LOG_DEVIATION = -3.0, 0.7  # bounds, of actions in -1 to 1 (guess)


class BehaviorModel:
    """A Gaussian of recorded continuous actions, clipped to their bounds.

    Args:
        store: what was recorded.
        episodes: those of the pilot; none: all.
        seed: of all draws.
        hidden: units of each of two layers.
        steps: gradient steps at most.
    """

    def __init__(
        self, store: OfflineStore, episodes: range | None = None, *, seed: int = 0, hidden: int = 64, steps: int = 3000
    ) -> None:
        generator = torch.Generator().manual_seed(seed)
        statistics = store.statistics()
        self._mean, self._scale = statistics.mean.float(), (statistics.variance.float() + 1e-6).rsqrt()
        self._actions = len(store.layout.continuous)
        sizes = [store.layout.observation_size, hidden, hidden, 2 * self._actions]
        self._network = StackedNetworks(1, sizes, generator)
        optimizer = FlatOptimizer(self._network.parameters(), _RATE)
        held, learnt = split_rows(store, generator, episodes)
        best, best_vector, waited = math.inf, optimizer.vector.detach().clone(), 0
        for step in range(steps):
            rows = learnt[torch.randint(len(learnt), (_BATCH,), generator=generator)]
            optimizer.step(-self.log_density(store.observations[rows], store.continuous[rows]).mean())
            if (step + 1) % _LOOK == 0:
                with torch.no_grad():
                    loss = -float(self.log_density(store.observations[held], store.continuous[held]).mean())
                waited = 0 if loss < best else waited + 1
                if loss < best:
                    best, best_vector = loss, optimizer.vector.detach().clone()
                elif waited >= _PATIENCE:
                    break
        optimizer.vector.data.copy_(best_vector)

    def __call__(self, observations: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and log deviation of the actions before they are clipped, each of shape (rows, actions)."""
        inputs = ((observations - self._mean) * self._scale).clamp(-10.0, 10.0)
        mean, log_deviation = self._network(inputs)[0].split(self._actions, dim=-1)
        return mean, log_deviation.clamp(*_LOG_DEVIATION)

    def log_density(self, observations: Tensor, actions: Tensor) -> Tensor:
        """Of actions, shape (rows,)."""
        return clipped_log_probs(*self(observations), actions)

    def distance(self, observations: Tensor, actions: Tensor) -> Tensor:
        """How many deviations actions are from the mean within the bounds, as a length, shape (rows,)."""
        mean, log_deviation = self(observations)
        return ((actions - mean.clamp(-1.0, 1.0)) * (-log_deviation).exp()).square().sum(-1).sqrt()


def split_rows(store: OfflineStore, generator: torch.Generator, episodes: range | None = None) -> tuple[Tensor, Tensor]:
    """Rows of decisions of a tenth of some episodes, and of their others; of one episode both are the same."""
    chosen = range(store.episode_count) if episodes is None else episodes
    place = torch.zeros(store.episode_count, dtype=torch.long)  # 0: of none, 1: learnt from, 2: held out
    place[chosen.start : chosen.stop] = 1
    if len(chosen) > 1:
        place[chosen.start + torch.randperm(len(chosen), generator=generator)[: max(1, len(chosen) // 10)]] = 2
    placed = torch.repeat_interleave(place, store.lengths)
    learnt = store.decisions[placed == 1]
    return (store.decisions[placed == 2] if len(chosen) > 1 else learnt), learnt
