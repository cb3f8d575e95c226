"""A policy judged on recorded decisions alone: three estimates of its return, and where it leaves the data.

In: a store and policies without memory. Out: verdicts. Where weights are needed, the judged policy is a Gaussian of a
stated width around its most probable action, for a deterministic one would never take a recorded action again; fitted Q
evaluation judges the most probable action itself.
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from common.intervals import Interval
from policies.learn.networks.policy import Policy
from policies.offline.evaluation.behavior_model import BehaviorModel
from policies.offline.evaluation.weighted_returns import (
    Floats,
    PaddedEpisodes,
    doubly_robust,
    effective_sample_size,
    importance_weighted,
)
from policies.offline.fitted_q import FittedQ
from policies.offline.losses import clipped_log_probs
from policies.offline.store import OfflineStore

CLIP = 1000.0  # of the weights (guess)
WIDTH = 0.4  # of the judged policy's Gaussian, of actions in -1 to 1: narrower, few recorded actions count
SUPPORT = 0.99  # fraction of the recorded actions that is called the data's support
_OWN_ACTIONS = 4  # drawn of the judged policy at each observation, for what it is worth there


@dataclass(frozen=True, slots=True)
class JudgeSettings:
    """How policies are judged."""

    gamma: float
    width: float = WIDTH
    clip: float = CLIP
    steps: int = 3000  # of fitted Q evaluation
    hidden: int = 64
    seed: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """Of one policy: discounted returns from where the recorded episodes began."""

    fitted_q: Interval
    importance: Interval
    robust: Interval
    per_decision: Interval  # [reward] of `fitted_q`, times 1 - gamma: its discounted mean reward
    effective_episodes: float
    outside: Floats  # (decisions,) 1.0 where the policy's action lies outside of the data's support
    distances: Floats  # (decisions,) deviations of the recorded actions that its action is off their mean

    @property
    def outside_fraction(self) -> float:
        return float(self.outside.mean())


class Judge:
    """Judges policies on one store; whoever recorded it is fitted once.

    Args:
        store: what was recorded, of continuous actions.
        settings: how to judge.
    """

    def __init__(self, store: OfflineStore, settings: JudgeSettings) -> None:
        if not store.layout.continuous or store.layout.branches or store.layout.image is not None:
            raise ValueError(f"{store.layout.task}: only recordings of continuous actions without images are judged")
        self._store, self._settings = store, settings
        self._behavior = BehaviorModel(store, seed=settings.seed)
        with torch.no_grad():
            seen, done = store.observations[store.decisions], store.continuous[store.decisions]
            self._densities = self._behavior.log_density(seen, done)
            self.limit = float(np.quantile(self._behavior.distance(seen, done).numpy(), SUPPORT))

    def judge(self, policy: Policy) -> Verdict:
        """What a policy would return.

        Raises:
            ValueError: a policy with memory, images or choices.
        """
        settings, store = self._settings, self._store
        fitted = FittedQ(store, policy, settings.gamma, seed=settings.seed, hidden=settings.hidden)
        fitted.fit(settings.steps)
        found = fitted.estimate()
        episodes = self._episodes(fitted)
        with torch.no_grad():
            own = fitted.actions[store.decisions]
            distances = self._behavior.distance(store.observations[store.decisions], own).double().numpy()
        scale = 1.0 - settings.gamma
        return Verdict(
            Interval(found.mean, found.low, found.high),
            importance_weighted(episodes, settings.gamma, settings.clip, settings.seed),
            doubly_robust(episodes, settings.gamma, settings.clip, settings.seed),
            Interval(scale * found.mean, scale * found.low, scale * found.high),
            effective_sample_size(episodes, settings.clip),
            (distances > self.limit).astype(np.float64),
            distances,
        )

    @torch.no_grad()
    def _episodes(self, fitted: FittedQ) -> PaddedEpisodes:
        """The recorded episodes with the ratios and values of a policy."""
        store, width = self._store, self._settings.width
        rows = store.decisions
        own, done = fitted.actions[rows], store.continuous[rows]
        log_width = torch.full_like(own, float(np.log(width)))
        ratios = clipped_log_probs(own, log_width, done) - self._densities
        generator = torch.Generator().manual_seed(self._settings.seed)
        values = torch.zeros(len(rows))
        for _ in range(_OWN_ACTIONS):
            drawn = own + width * torch.randn(own.shape, generator=generator)
            values += fitted.values(rows, drawn.clamp(-1.0, 1.0)) / _OWN_ACTIONS
        columns = (ratios, store.rewards[rows], fitted.values(rows, done), values)
        return PaddedEpisodes(*(self._padded(column) for column in columns))

    def _padded(self, column: Tensor) -> Floats:
        """A value of each decision as (episodes, decisions)."""
        lengths = self._store.lengths.numpy()
        padded = np.zeros((len(lengths), int(lengths.max())))
        padded[np.arange(padded.shape[1]) < lengths[:, None]] = column.double().numpy()
        return padded
