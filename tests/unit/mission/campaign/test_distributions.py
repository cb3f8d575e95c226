"""Distributions by their quantiles, against SciPy; draws that do not depend on who draws them."""

import numpy as np
import pytest
from scipy import stats

from mission.campaign.campaign import Campaign
from mission.campaign.distributions import Distribution
from mission.campaign.sampling import sample_orders

FRACTIONS = np.linspace(0.001, 0.999, 41)


@pytest.mark.parametrize(
    ("given", "peer"),
    [
        ({"uniform": [2, 5]}, stats.uniform(2, 3)),
        ({"loguniform": [0.5, 8]}, stats.loguniform(0.5, 8)),
        ({"normal": {"mean": 3, "std": 2, "min": 0, "max": 4}}, stats.truncnorm(-1.5, 0.5, 3, 2)),
        ({"normal": {"mean": 3, "std": 2}}, stats.truncnorm(-4, 4, 3, 2)),
        ({"integers": [3, 9]}, stats.randint(3, 10)),
    ],
)
def test_quantiles_are_scipys(given, peer):
    distribution = Distribution.model_validate(given)
    assert np.allclose([distribution.quantile(f) for f in FRACTIONS], peer.ppf(FRACTIONS), rtol=1e-6)


def test_no_value_is_beyond_the_bounds():
    for given in (
        {"uniform": [0.1, 0.3]},
        {"loguniform": [0.1, 0.3]},
        {"normal": {"mean": 9, "std": 5, "min": 0.1, "max": 0.3}},
    ):
        distribution = Distribution.model_validate(given)
        assert all(0.1 <= distribution.quantile(f) <= 0.3 for f in (-1.0, 0.0, 1e-12, 0.5, 1.0, 2.0))


def test_choices_are_as_likely_each():
    distribution = Distribution.model_validate({"choice": ["a", "b", 3]})
    assert [distribution.quantile(f) for f in (0.0, 0.32, 0.34, 0.65, 0.67, 1.0)] == ["a", "a", "b", "b", 3, 3]


def campaign(**given):
    return Campaign.model_validate({"scenario": {}, "vary": {"noise": {"uniform": [0, 2]}}, **given})


def test_a_run_is_the_same_in_every_campaign_of_its_seed():
    few, many = sample_orders(campaign(), 3), sample_orders(campaign(runs=7), 30)
    assert few == many[:3]
    assert sample_orders(campaign(seed=2), 3) != few
    assert len({order.seed for order in many}) == 30


def test_a_varied_seed_is_the_flights():
    vary = {"seed": {"integers": [5, 9]}}
    orders = sample_orders(campaign(vary=vary), 50)
    assert {order.seed for order in orders} == {5, 6, 7, 8, 9}
