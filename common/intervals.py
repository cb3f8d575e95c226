"""95 % confidence intervals: of rates (Wilson), and of anything computed from episodes (bootstrap). NumPy only."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Z_95 = 1.959963984540054  # two-sided 95 % of a normal distribution
_RESAMPLES = 2000  # Efron and Tibshirani 1993, ch. 13: 1,000 or more for percentile intervals


@dataclass(frozen=True, slots=True)
class Interval:
    """A figure and the bounds of its 95 % interval; NaN bounds: too little to tell."""

    value: float
    low: float
    high: float


def wilson_interval(successes: int, count: int) -> tuple[float, float]:
    """The 95 % confidence interval of a rate (Wilson 1927, eq. 1: it holds near 0 and 1 too)."""
    if count == 0:
        return 0.0, 1.0
    rate = successes / count
    shrink = 1.0 + Z_95**2 / count
    middle = (rate + Z_95**2 / (2.0 * count)) / shrink
    half = Z_95 / shrink * math.sqrt(rate * (1.0 - rate) / count + Z_95**2 / (4.0 * count**2))
    low = 0.0 if successes == 0 else max(0.0, middle - half)
    return low, 1.0 if successes == count else min(1.0, middle + half)


def rate(is_success: NDArray[np.bool_]) -> Interval:
    """The fraction of true values with Wilson's interval; NaN of none."""
    return rate_of(int(is_success.sum()), len(is_success))


def rate_of(successes: int, count: int) -> Interval:
    """The same of counts."""
    if not count:
        return Interval(math.nan, math.nan, math.nan)
    return Interval(successes / count, *wilson_interval(successes, count))


def bootstrap(count: int, figure: Callable[[NDArray[np.int64]], float]) -> Interval:
    """A figure of some episodes with its percentile interval (Efron 1979); the same episodes give the same bounds.

    Args:
        count: how many episodes there are; one alone has no interval.
        figure: of the episodes with these indices, some of them several times; NaN where they do not tell.
    """
    value = figure(np.arange(count))
    if count < 2 or math.isnan(value):
        return Interval(value, math.nan, math.nan)
    generator = np.random.default_rng(count)
    drawn = np.array([figure(generator.integers(0, count, count)) for _ in range(_RESAMPLES)])
    low, high = np.nanpercentile(drawn, (2.5, 97.5))
    return Interval(value, float(low), float(high))
