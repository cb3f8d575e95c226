"""What many runs say: success with its confidence, and what it depends on.

In: records. Out: figures. The methods: Wilson's interval for a fraction (Wilson 1927); Spearman's rank correlation of
each varied value with the least margin, and the correlation ratio of the ranks over bins of the value, which also sees
what first rises and then falls (Kruskal and Wallis 1952).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
import numpy.typing as npt

from common.intervals import Z_95, wilson_interval
from mission.campaign.campaign import SEED_KEY, Campaign
from mission.campaign.runs import Record

BINS_MAX, BIN_RUNS = 8, 10  # bins of a value, with at least so many runs in each
Rows = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Fraction:
    """A fraction with its 95 % confidence interval."""

    count: int
    total: int
    low: float
    high: float

    @property
    def value(self) -> float:
        return self.count / self.total if self.total else 0.0


@dataclass(frozen=True, slots=True)
class Bin:
    """Runs whose value lies near each other."""

    label: str
    low: float
    high: float
    success: Fraction


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """What a varied value does to the least margin."""

    key: str
    rank_correlation: float | None
    """Spearman's, in [-1, 1]; None: the values have no order, or all runs are equal."""
    explained: float
    """Fraction of the variance of the margins' ranks that is between the bins, less what chance gives."""
    is_clear: bool
    """Whether either is beyond what chance gives once in twenty."""
    bins: tuple[Bin, ...]


def wilson(count: int, total: int) -> Fraction:
    """Wilson's 95 % interval of a fraction."""
    return Fraction(count, total, *wilson_interval(count, total))


def success_of(records: Sequence[Record]) -> Fraction:
    """Of all that were flown, those that passed."""
    return wilson(sum(record.passed for record in records), len(records))


def worst_first(records: Sequence[Record]) -> list[Record]:
    """By least margin; those that failed without one are before all."""
    return sorted(records, key=lambda record: (record.passed, record.score, record.phase, record.number))


def ranks(values: Sequence[float] | Rows) -> Rows:
    """From 0; equals have the mean of theirs."""
    _, inverse, counts = np.unique(np.asarray(values, float), return_inverse=True, return_counts=True)
    ends = np.cumsum(counts)
    mean: Rows = ends - (counts + 1) / 2.0
    return mean[inverse]


def rank_correlation(x: Sequence[float] | Rows, y: Sequence[float] | Rows) -> float | None:
    """Spearman's; None where one of them does not vary."""
    a, b = ranks(x), ranks(y)
    a, b = a - a.mean(), b - b.mean()
    scale = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / scale if scale > 0.0 else None


def sensitivities(campaign: Campaign, records: Sequence[Record]) -> list[Sensitivity]:
    """Of each varied key but the seed, those that matter most first."""
    if len(records) < 3:
        return []
    found = [_sensitivity(campaign, key, records) for key in campaign.vary if key != SEED_KEY]
    return sorted(found, key=lambda each: -max(abs(each.rank_correlation or 0.0) ** 2, each.explained))


def _sensitivity(campaign: Campaign, key: str, records: Sequence[Record]) -> Sensitivity:
    scores = np.array([record.score for record in records])
    groups = _groups(campaign, key, records)
    rho = None
    if campaign.vary[key].is_ordered:
        rho = rank_correlation([float(record.values[key]) for record in records], scores)
    score_ranks = ranks(scores)
    total = float(((score_ranks - score_ranks.mean()) ** 2).sum())
    between = sum(len(m) * float(score_ranks[m].mean() - score_ranks.mean()) ** 2 for _, _, _, m in groups)
    n, k = len(records), len(groups)
    ratio = between / total if total > 0.0 else 0.0
    by_chance = (k - 1) / (n - 1)  # its mean where there is no dependence
    spread = sqrt(2.0 * (k - 1)) / (n - 1)
    is_clear = (rho is not None and abs(rho) > Z_95 / sqrt(n - 1)) or ratio > by_chance + Z_95 * spread
    bins = tuple(
        Bin(label, low, high, success_of([records[i] for i in members])) for label, low, high, members in groups
    )
    return Sensitivity(key, rho, max(0.0, ratio - by_chance), is_clear, bins)


def _groups(
    campaign: Campaign, key: str, records: Sequence[Record]
) -> list[tuple[str, float, float, npt.NDArray[np.intp]]]:
    """The choices, or bins with as many runs each: label, bounds, which runs."""
    values = [record.values[key] for record in records]
    distribution = campaign.vary[key]
    if distribution.choice is not None:
        found = [
            (value, np.flatnonzero([each == value for each in values])) for value in dict.fromkeys(distribution.choice)
        ]
        return [(str(value), float(i), float(i), members) for i, (value, members) in enumerate(found) if len(members)]
    numbers = np.array(values, float)
    count = max(1, min(BINS_MAX, len(records) // BIN_RUNS))
    order = np.argsort(numbers, kind="stable")
    return [
        (
            f"{numbers[members[0]]:.4g} to {numbers[members[-1]]:.4g}",
            float(numbers[members[0]]),
            float(numbers[members[-1]]),
            members,
        )
        for members in np.array_split(order, count)
        if len(members)
    ]
