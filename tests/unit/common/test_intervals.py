"""95 % intervals: Wilson's against SciPy, the bootstrap's against Student's of a mean."""

import math

import numpy as np
import pytest
from scipy.stats import binomtest, t

from common.intervals import bootstrap, rate, wilson_interval


@pytest.mark.parametrize(("successes", "count"), [(0, 10), (10, 10), (997, 1000), (1, 3)])
def test_interval_is_wilsons(successes, count):
    expected = binomtest(successes, count).proportion_ci(method="wilson")
    assert wilson_interval(successes, count) == pytest.approx((expected.low, expected.high), abs=1e-6)


def test_interval_of_nothing_is_everything():
    assert wilson_interval(0, 0) == (0.0, 1.0)


def test_rate_is_the_share_with_wilsons_interval():
    figure = rate(np.array([True, True, False, True]))
    assert (figure.value, (figure.low, figure.high)) == (0.75, wilson_interval(3, 4))


def test_bootstrap_of_a_mean_is_about_students():
    values = np.random.default_rng(1).normal(5.0, 2.0, 200)
    figure = bootstrap(len(values), lambda rows: float(values[rows].mean()))
    half = t.ppf(0.975, 199) * values.std(ddof=1) / math.sqrt(200)
    assert (figure.low, figure.high) == pytest.approx((values.mean() - half, values.mean() + half), abs=0.15 * half)


def test_bootstrap_is_the_same_each_time():
    values = np.random.default_rng(1).normal(size=30)
    first, second = (bootstrap(30, lambda rows: float(values[rows].max())) for _ in range(2))
    assert first == second


def test_one_episode_has_no_interval():
    figure = bootstrap(1, lambda rows: float(len(rows) + 2))
    assert figure.value == 3.0
    assert math.isnan(figure.low)
