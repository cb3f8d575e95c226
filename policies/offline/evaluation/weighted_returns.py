"""Returns of one policy from episodes of another: importance weights and the doubly robust correction, by episode.

In: probability ratios, rewards and values of recorded episodes, padded to one length. Out: figures with bootstrap
intervals over episodes. Weights are per decision and normalised over the episodes (Precup, Sutton and Singh 2000;
weighted doubly robust: Thomas and Brunskill 2016, eq. 11). An episode that has ended keeps its last weight. NumPy only.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from common.intervals import Interval

_LEAST = -60.0  # log of a weight: where all episodes are unlikely, sums stay above zero
DRAWS = 1000  # of the bootstrap (Efron and Tibshirani 1993, ch. 13)
Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PaddedEpisodes:
    """Recorded episodes side by side, all of shape (episodes, decisions); behind an episode's end are zeros."""

    log_ratios: Floats  # log of how much likelier the judged policy takes the recorded action
    rewards: Floats
    taken_values: Floats  # what the recorded action is said to be worth; or (opinions, episodes, decisions)
    values: Floats  # what the judged policy's own action is said to be worth; likewise

    def weights(self, clip: float) -> Floats:
        """The products of the ratios up to each decision, none above `clip`."""
        return np.exp(np.clip(np.cumsum(self.log_ratios, axis=1), _LEAST, np.log(clip)))


def importance_weighted(episodes: PaddedEpisodes, gamma: float, clip: float, seed: int = 0) -> Interval:
    """The discounted return by weighted per-decision importance sampling."""
    weights = episodes.weights(clip)
    discounts = gamma ** np.arange(weights.shape[1])

    def figure(counts: Floats) -> Floats:
        return (counts @ (weights * episodes.rewards) / (counts @ weights)) @ discounts

    return _with_bootstrap([figure], len(weights), seed)


def doubly_robust(episodes: PaddedEpisodes, gamma: float, clip: float, seed: int = 0) -> Interval:
    """The discounted return by values, corrected where the weighted episodes went otherwise; mean of all opinions."""
    weights = episodes.weights(clip)
    before = np.concatenate((np.ones((len(weights), 1)), weights[:, :-1]), axis=1)
    discounts = gamma ** np.arange(weights.shape[1])
    taken, own = (each.reshape(-1, *weights.shape) for each in (episodes.taken_values, episodes.values))

    def figure(counts: Floats, taken_values: Floats, values: Floats) -> Floats:
        corrections = counts @ (weights * (episodes.rewards - taken_values)) / (counts @ weights)
        return (corrections + counts @ (before * values) / (counts @ before)) @ discounts

    opinions = [partial(figure, taken_values=a, values=b) for a, b in zip(taken, own, strict=True)]
    return _with_bootstrap(opinions, len(weights), seed)


def effective_sample_size(episodes: PaddedEpisodes) -> float:
    """Episodes that the weighted ones are worth: squared sum over sum of squares (Kish 1965).

    Of the weights as they are: clipped ones are alike where all episodes are long, and would count as good evidence.
    """
    logs = episodes.log_ratios.sum(axis=1)
    last = np.exp(logs - logs.max())
    return float(last.sum() ** 2 / np.square(last).sum())


def _with_bootstrap(figures: Sequence[Callable[[Floats], Floats]], count: int, seed: int) -> Interval:
    """The mean figure of all episodes, and the percentile interval over episodes and figures drawn anew."""
    value = float(np.mean([figure(np.ones((1, count))) for figure in figures]))
    drawn = np.random.default_rng(seed).multinomial(count, np.full(count, 1.0 / count), DRAWS).astype(np.float64)
    parts = np.array_split(drawn, len(figures))
    found = np.concatenate([figure(part) for figure, part in zip(figures, parts, strict=True)])
    low, high = np.percentile(found, (2.5, 97.5))
    return Interval(value, float(low), float(high))
