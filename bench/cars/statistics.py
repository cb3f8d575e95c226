"""Intervals of means over training seeds."""

from collections.abc import Sequence
from math import sqrt

import numpy as np

from common.intervals import Interval

# Student's t, two-sided 95 %, by degrees of freedom (any statistics table).
T_95 = {1: 12.706, 2: 4.303, 3: 3.182, 4: 2.776, 5: 2.571, 6: 2.447, 7: 2.365, 8: 2.306, 9: 2.262}


def over_seeds(values: Sequence[float]) -> Interval:
    """The mean over training seeds with Student's interval; a single seed has none."""
    mean = float(np.mean(values))
    if len(values) < 2:
        return Interval(mean, mean, mean)
    half = T_95[len(values) - 1] * float(np.std(values, ddof=1)) / sqrt(len(values))
    return Interval(mean, mean - half, mean + half)
