"""Who recorded the decisions, as far as the recording tells: Gaussians of actions, fitted by behavioural cloning.

In: a store. Out: how likely actions are at an observation; several may have recorded it, hence a mixture. A tenth of
the episodes is held out, and the weights with which these are likeliest are kept. Actions at a bound were clipped.
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
_PILOTS = 2  # components
_LEAST_SHARE = 0.05  # of a component that counts as somebody


class BehaviorModel:
    """A mixture of Gaussians of recorded continuous actions.

    Args:
        store: what was recorded.
        seed: of all draws.
        hidden: units of each of two layers.
        steps: gradient steps at most.
    """

    def __init__(self, store: OfflineStore, *, seed: int = 0, hidden: int = 64, steps: int = 3000) -> None:
        generator = torch.Generator().manual_seed(seed)
        statistics = store.statistics()
        self._mean, self._scale = statistics.mean.float(), (statistics.variance.float() + 1e-6).rsqrt()
        self._actions = len(store.layout.continuous)
        sizes = [store.layout.observation_size, hidden, hidden, _PILOTS * (1 + 2 * self._actions)]
        self._network = StackedNetworks(1, sizes, generator)
        optimizer = FlatOptimizer(self._network.parameters(), _RATE)
        held, learnt = split_rows(store, generator)
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

    def __call__(self, observations: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Log share (rows, components), mean and log deviation (rows, components, actions) of each."""
        inputs = ((observations - self._mean) * self._scale).clamp(-10.0, 10.0)
        shares, rest = self._network(inputs)[0].split((_PILOTS, 2 * _PILOTS * self._actions), dim=-1)
        mean, log_deviation = rest.unflatten(-1, (_PILOTS, 2 * self._actions)).split(self._actions, dim=-1)
        return shares.log_softmax(dim=-1), mean, log_deviation.clamp(*_LOG_DEVIATION)

    def log_density(self, observations: Tensor, actions: Tensor) -> Tensor:
        """Of actions, shape (rows,)."""
        shares, mean, log_deviation = self(observations)
        return (shares + clipped_log_probs(mean, log_deviation, actions[:, None])).logsumexp(dim=-1)

    def distance(self, observations: Tensor, actions: Tensor) -> Tensor:
        """How many deviations actions are from the nearest mean, as a length, shape (rows,)."""
        shares, mean, log_deviation = self(observations)
        away = ((actions[:, None] - mean) * (-log_deviation).exp()).square().sum(-1).sqrt()
        return away.masked_fill(shares.exp() < _LEAST_SHARE, torch.inf).amin(-1)


def split_rows(store: OfflineStore, generator: torch.Generator) -> tuple[Tensor, Tensor]:
    """Rows of decisions of a tenth of the episodes, and of the others; of one episode both are the same."""
    order = torch.randperm(store.episode_count, generator=generator)
    count = max(1, store.episode_count // 10)
    is_held = torch.zeros(store.episode_count, dtype=torch.bool)
    is_held[order[:count]] = True
    held = torch.repeat_interleave(is_held, store.lengths)
    if store.episode_count == 1:
        return store.decisions, store.decisions
    return store.decisions[held], store.decisions[~held]
