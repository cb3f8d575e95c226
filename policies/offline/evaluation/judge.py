"""A policy judged on recorded decisions alone: three estimates of its return, and where it leaves the data.

In: a store and policies without memory. Out: verdicts. Where weights are needed, the judged policy is a Gaussian of a
stated width around its most probable action, clipped to the bounds, for a deterministic one would never take a recorded
action again; fitted Q evaluation judges the most probable action itself. What follows a recording that ended because
time was up is fitted Q's.
"""

from collections.abc import Sequence
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
        pilots: how many of the episodes each of those who recorded it has, one after the other; none: one has all.
    """

    def __init__(self, store: OfflineStore, settings: JudgeSettings, pilots: Sequence[int] = ()) -> None:
        if not store.layout.continuous or store.layout.branches or store.layout.image is not None:
            raise ValueError(f"{store.layout.task}: only recordings of continuous actions without images are judged")
        self._store, self._settings = store, settings
        counts = pilots or (store.episode_count,)
        ends = np.cumsum(counts).tolist()
        self._pilots = [
            BehaviorModel(store, range(end - count, end), seed=settings.seed)
            for end, count in zip(ends, counts, strict=True)
        ]
        with torch.no_grad():
            seen, done = store.observations[store.decisions], store.continuous[store.decisions]
            each = np.stack([self._padded(pilot.log_density(seen, done)) for pilot in self._pilots])
            self.limit = float(np.quantile(self._distances(done), SUPPORT))
        log_fractions = np.log(np.array(counts) / store.episode_count)[:, None, None]
        so_far = np.logaddexp.reduce(log_fractions + np.cumsum(each, axis=2), axis=0)
        self._densities = np.diff(so_far, axis=1, prepend=0.0)  # (episodes, decisions) of what all of them do together

    def _distances(self, actions: Tensor) -> Floats:
        """How many deviations actions are off what the nearest of the pilots does, shape (decisions,)."""
        seen = self._store.observations[self._store.decisions]
        return torch.stack([pilot.distance(seen, actions) for pilot in self._pilots]).amin(0).double().numpy()

    def judge(self, policy: Policy) -> Verdict:
        """What a policy would return.

        Raises:
            ValueError: a policy with memory, images or choices.
        """
        settings, store = self._settings, self._store
        fitted = FittedQ(store, policy, settings.gamma, seed=settings.seed, hidden=settings.hidden)
        fitted.fit(settings.steps)
        found = fitted.estimate()
        drawn = FittedQ(store, policy, settings.gamma, seed=settings.seed, hidden=settings.hidden, width=settings.width)
        drawn.fit(settings.steps)
        episodes = self._episodes(drawn)
        with torch.no_grad():
            distances = self._distances(fitted.actions[store.decisions])
        scale = 1.0 - settings.gamma
        return Verdict(
            Interval(found.mean, found.low, found.high),
            importance_weighted(episodes, settings.gamma, settings.clip, settings.seed),
            doubly_robust(episodes, settings.gamma, settings.clip, settings.seed),
            Interval(scale * found.mean, scale * found.low, scale * found.high),
            effective_sample_size(episodes),
            (distances > self.limit).astype(np.float64),
            distances,
        )

    @torch.no_grad()
    def _episodes(self, fitted: FittedQ) -> PaddedEpisodes:
        """The recorded episodes with the ratios and values of a policy's Gaussian."""
        store, width = self._store, self._settings.width
        rows = store.decisions
        own, done = fitted.actions[rows], store.continuous[rows]
        ratios = self._padded(clipped_log_probs(own, torch.full_like(own, float(np.log(width))), done))
        generator = torch.Generator().manual_seed(self._settings.seed)
        lasts = store.starts + store.lengths - 1
        tails = self._worth(fitted, lasts + 1, generator).mean(0) * (1.0 - store.is_terminated[lasts])
        rewards = self._padded(store.rewards[rows])
        rewards[np.arange(len(lasts)), store.lengths.numpy() - 1] += self._settings.gamma * tails.double().numpy()
        opinions = (fitted.values(rows, done), self._worth(fitted, rows, generator))
        taken_values, values = (np.stack([self._padded(each) for each in opinion]) for opinion in opinions)
        return PaddedEpisodes(ratios - self._densities, rewards, taken_values, values)

    def _worth(self, fitted: FittedQ, rows: Tensor, generator: torch.Generator) -> Tensor:
        """Of the policy's Gaussian at the observations of some rows, by each network, shape (members, rows)."""
        drawn = (fitted.drawn(rows, generator) for _ in range(_OWN_ACTIONS))
        return torch.stack([fitted.values(rows, actions) for actions in drawn]).mean(0)

    def _padded(self, column: Tensor) -> Floats:
        """A value of each decision as (episodes, decisions)."""
        lengths = self._store.lengths.numpy()
        padded = np.zeros((len(lengths), int(lengths.max())))
        padded[np.arange(padded.shape[1]) < lengths[:, None]] = column.double().numpy()
        return padded
