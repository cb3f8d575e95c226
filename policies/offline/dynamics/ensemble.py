"""An ensemble of probabilistic networks that say what comes next (Chua et al. 2018, PETS; Janner et al. 2019, MBPO).

In: a store. Out: of observation and action, each member's Gaussian of the observation's change and the reward, and the
probability that the episode ends. Every member learns from decisions of its own, drawn anew of the recorded ones; what
it is at its likeliest on held-out episodes is kept.
"""

import math
from dataclasses import dataclass

import torch
import torch.nn.functional as F  # noqa: N812  (the name of the field)
from torch import Tensor

from policies.offline.evaluation.behavior_model import split_rows
from policies.offline.flat_parameters import FlatOptimizer
from policies.offline.stacked_networks import StackedNetworks
from policies.offline.store import OfflineStore
from policies.tasks.layout import Layout

MEMBERS = 5
_RATE, _BATCH, _LOOK, _PATIENCE = 1.0e-3, 256, 200, 5
_LOG_DEVIATION = -5.0, 1.0  # bounds, in deviations of what is predicted (guess)
_HELD_MOST = 8192  # held-out decisions that are looked at


@dataclass(frozen=True, slots=True)
class Prediction:
    """Of every member."""

    mean: Tensor  # (members, rows, elements + 1) change of the observation and reward, in deviations
    log_deviation: Tensor  # the same
    end_logit: Tensor  # (members, rows)


class DynamicsEnsemble:
    """The networks and the scales of what they see and say."""

    def __init__(self, layout: Layout, hidden: int, scales: dict[str, Tensor], generator: torch.Generator) -> None:
        """Untrained networks.

        Args:
            layout: of observations and continuous actions.
            hidden: units of each of two layers.
            scales: mean and scale of observations; mean and deviation of what is predicted.
            generator: of all draws.
        """
        self._generator = generator
        self.elements, self.hidden, self.scales = layout.observation_size, hidden, scales
        inputs = self.elements + len(layout.continuous)
        self.networks = StackedNetworks(MEMBERS, [inputs, hidden, hidden, 2 * (self.elements + 1) + 1], generator)
        self.held_out = math.nan  # mean squared error of the held-out decisions, in variances

    def fit(self, store: OfflineStore, steps: int) -> int:
        """Learns until held-out decisions get no likelier, or so many steps; returns how many they were."""
        optimizer = FlatOptimizer(self.networks.parameters(), _RATE)
        held, learnt = split_rows(store, self._generator)
        held = held[:_HELD_MOST]
        drawn = torch.randint(len(learnt), (MEMBERS, len(learnt)), generator=self._generator)
        best, best_vector, waited, step = math.inf, optimizer.vector.detach().clone(), 0, 0
        counts = torch.stack([torch.bincount(each, minlength=len(learnt)) for each in drawn]).float()
        for step in range(1, steps + 1):
            chosen = torch.randint(len(learnt), (_BATCH,), generator=self._generator)
            optimizer.step((counts[:, chosen] * self._loss(store, learnt[chosen])).mean(dim=1).sum())
            if step % _LOOK == 0 or step == steps:
                with torch.no_grad():
                    loss = float(self._loss(store, held).mean())
                waited = 0 if loss < best else waited + 1
                if loss < best:
                    best, best_vector = loss, optimizer.vector.detach().clone()
                elif waited >= _PATIENCE:
                    break
        optimizer.vector.data.copy_(best_vector)
        with torch.no_grad():
            found = self.predict(store.observations[held], store.continuous[held]).mean.mean(dim=0)
            self.held_out = float((found - self._scaled_targets(store, held)).square().mean())
        return step

    def predict(self, observations: Tensor, actions: Tensor) -> Prediction:
        """What every member says of rows (B, elements) and (B, actions)."""
        seen = ((observations - self.scales["mean"]) * self.scales["scale"]).clamp(-10.0, 10.0)
        outputs = self.networks(torch.cat((seen, actions), dim=-1))
        n = self.elements + 1
        return Prediction(outputs[..., :n], outputs[..., n : 2 * n].clamp(*_LOG_DEVIATION), outputs[..., -1])

    def disagreement(self, prediction: Prediction) -> Tensor:
        """The root mean square of how far members are from their mean, in deviations of the data, shape (B,)."""
        return prediction.mean.var(dim=0, unbiased=False).mean(dim=-1).sqrt()

    def _loss(self, store: OfflineStore, rows: Tensor) -> Tensor:
        """Negative log likelihood of the decisions in some rows, shape (members, B)."""
        found = self.predict(store.observations[rows], store.continuous[rows])
        apart = (self._scaled_targets(store, rows) - found.mean) * (-found.log_deviation).exp()
        ends = store.is_terminated[rows].expand_as(found.end_logit)
        missed = F.binary_cross_entropy_with_logits(found.end_logit, ends, reduction="none")
        return (0.5 * apart.square() + found.log_deviation).sum(dim=-1) + missed

    def _scaled_targets(self, store: OfflineStore, rows: Tensor) -> Tensor:
        return (_targets_of(store, rows) - self.scales["target_mean"]) / self.scales["target_deviation"]


def ensemble_for(store: OfflineStore, *, seed: int = 0, hidden: int = 128) -> DynamicsEnsemble:
    """Untrained networks with the scales of a store of continuous actions."""
    statistics = store.statistics()
    targets = _targets_of(store, store.decisions)
    scales = {
        "mean": statistics.mean.float(),
        "scale": (statistics.variance.float() + 1e-6).rsqrt(),
        "target_mean": targets.mean(0),
        "target_deviation": targets.std(0) + 1e-6,
    }
    return DynamicsEnsemble(store.layout, hidden, scales, torch.Generator().manual_seed(seed))


def _targets_of(store: OfflineStore, rows: Tensor) -> Tensor:
    """Changes of the observation and rewards, shape (rows, elements + 1)."""
    changes = store.observations[rows + 1] - store.observations[rows]
    return torch.cat((changes, store.rewards[rows, None]), dim=1)
