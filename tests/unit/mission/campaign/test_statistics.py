"""Figures of a campaign, against SciPy and closed forms."""

import numpy as np
import pytest
from scipy import stats

from mission.campaign.campaign import Campaign
from mission.campaign.runs import Record
from mission.campaign.statistics import rank_correlation, ranks, sensitivities, wilson, worst_first


@pytest.mark.parametrize(("count", "total"), [(0, 10), (3, 10), (95, 100), (100, 100)])
def test_the_interval_is_scipys_wilson(count, total):
    found = wilson(count, total)
    peer = stats.binomtest(count, total).proportion_ci(0.95, method="wilson")
    assert found.low == pytest.approx(peer.low, abs=1e-9)
    assert found.high == pytest.approx(peer.high, abs=1e-9)


def test_rank_correlation_is_scipys_with_ties():
    random = np.random.default_rng(1)
    x, y = random.integers(0, 9, 60).astype(float), random.standard_normal(60)
    assert rank_correlation(x, y) == pytest.approx(stats.spearmanr(x, y).statistic)
    assert rank_correlation(np.ones(4), np.arange(4.0)) is None
    assert np.array_equal(ranks([3.0, 1.0, 3.0]), [1.5, 0.0, 1.5])


def record(number, values, margin, *, passed=None, error=""):
    is_passed = (margin is not None and margin >= 0.0) if passed is None else passed
    return Record("sample", number, 1, values, 1.0, is_passed, margin, error=error)


def made(function, vary, count=400):
    random = np.random.default_rng(2)
    records = []
    for number in range(count):
        values = {key: float(random.uniform()) for key in vary}
        records.append(record(number, values, function(values) + 0.05 * random.standard_normal()))
    given = {"scenario": {}, "vary": {key: {"uniform": [0, 1]} for key in vary}}
    return Campaign.model_validate(given), records


def test_what_matters_is_clear_and_first_and_the_rest_is_chance():
    campaign, records = made(lambda v: 0.5 - v["b"], ["a", "b"])
    first, second = sensitivities(campaign, records)
    assert (first.key, second.key) == ("b", "a")
    assert first.rank_correlation < -0.9
    assert first.is_clear
    assert not second.is_clear
    assert first.bins[0].success.value == 1.0
    assert first.bins[-1].success.value == 0.0


def test_what_rises_and_falls_is_seen_by_the_bins():
    campaign, records = made(lambda v: abs(v["a"] - 0.5), ["a"])
    (found,) = sensitivities(campaign, records)
    assert abs(found.rank_correlation) < 0.15
    assert found.explained > 0.5
    assert found.is_clear


def test_the_worst_are_first_and_those_without_a_margin_before_all():
    records = [
        record(0, {}, 2.0),
        record(1, {}, -1.0),
        record(2, {}, None, error="hung"),
        record(3, {}, 3.0, passed=False),
    ]
    assert [each.number for each in worst_first(records)] == [2, 1, 3, 0]
