"""What a dataset comes to: counts, returns, outcomes, and moments and ranges of each element, in one pass."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from policies.datasets.reader import DatasetReader

BINS = 40
SPAN = 3.0  # histograms reach from -SPAN to SPAN: floats are scaled to about 1


@dataclass(frozen=True, slots=True, eq=False)
class ElementStatistics:
    """Of each float of an observation or an action, arrays of shape (elements,) and (elements, BINS)."""

    names: tuple[str, ...]
    mean: NDArray[np.float64]
    std: NDArray[np.float64]
    least: NDArray[np.float64]
    most: NDArray[np.float64]
    histogram: NDArray[np.int64]  # what lies beyond the span counts at its ends


@dataclass(frozen=True, slots=True, eq=False)
class DatasetStatistics:
    """Of a whole dataset."""

    episodes: int
    steps: int
    outcomes: Counter[str]
    returns: NDArray[np.float64]  # (episodes,)
    lengths: NDArray[np.int64]  # (episodes,)
    observations: ElementStatistics
    actions: ElementStatistics


class _Moments:
    """Sums over rows that come in pieces."""

    def __init__(self, names: tuple[str, ...]) -> None:
        size = len(names)
        self._names, self._count = names, 0
        self._sum, self._square = np.zeros(size), np.zeros(size)
        self._least, self._most = np.full(size, np.inf), np.full(size, -np.inf)
        self._histogram = np.zeros((size, BINS), np.int64)

    def add(self, rows: NDArray[np.float64]) -> None:
        self._count += len(rows)
        self._sum += rows.sum(axis=0)
        self._square += (rows * rows).sum(axis=0)
        self._least = np.minimum(self._least, rows.min(axis=0))
        self._most = np.maximum(self._most, rows.max(axis=0))
        bins = np.clip((rows + SPAN) * (BINS / (2.0 * SPAN)), 0, BINS - 1).astype(np.int64)
        for k in range(rows.shape[1]):
            self._histogram[k] += np.bincount(bins[:, k], minlength=BINS)

    def result(self) -> ElementStatistics:
        mean = self._sum / max(self._count, 1)
        std = np.sqrt(np.maximum(self._square / max(self._count, 1) - mean * mean, 0.0))
        return ElementStatistics(self._names, mean, std, self._least, self._most, self._histogram)


def statistics_of(reader: DatasetReader) -> DatasetStatistics:
    """One pass over an open dataset.

    Raises:
        DatasetError: an episode cannot be read.
    """
    layout = reader.layout
    names = tuple(
        element.name + (f" ({layout.stack - 1 - k} back)" if k < layout.stack - 1 else "")
        for k in range(layout.stack)
        for element in layout.frame
    )
    acted = tuple(element.name for element in layout.continuous) or tuple(branch.name for branch in layout.branches)
    observations, actions = _Moments(names), _Moments(acted)
    outcomes: Counter[str] = Counter()
    returns, lengths = [], []
    for k in range(reader.count):
        episode = reader.episode(k, has_images=False)
        observations.add(episode.observations.astype(np.float64))
        actions.add(episode.actions.astype(np.float64).reshape(len(episode), -1))
        outcomes[episode.outcome] += 1
        returns.append(float(episode.rewards.sum()))
        lengths.append(len(episode))
    return DatasetStatistics(
        reader.count,
        sum(lengths),
        outcomes,
        np.array(returns),
        np.array(lengths, np.int64),
        observations.result(),
        actions.result(),
    )
