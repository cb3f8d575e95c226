"""Searches find what is known, with runs that a formula judges instead of a flight."""

from statistics import NormalDist

import pytest

from mission.campaign.campaign import Campaign
from mission.campaign.flying import Flights
from mission.campaign.run_store import RunStore
from mission.campaign.runs import Record
from mission.campaign.search.whole import search_of


class Formula:
    """Workers to whom a run's margin is a formula of its values."""

    def __init__(self, margin):
        self._margin = margin
        self.count = 0

    def fly(self, orders):
        for order in reversed(list(orders)):
            self.count += 1
            margin = self._margin(order.values, order.seed)
            yield Record(*order.key, order.seed, order.values, order.weight, margin >= 0.0, margin, "x", "m")

    def close(self):
        pass


def searched(tmp_path, margin, search, vary):
    campaign = Campaign.model_validate({"scenario": {"seeds": [1]}, "vary": vary, "search": search})
    workers = Formula(margin)
    with RunStore(tmp_path / "c", {}) as store:
        flights = Flights(campaign, store, workers, lambda _: None)
        return search_of(flights, campaign.search[0], "p-0"), workers.count


AB = {"a": {"uniform": [0, 10]}, "b": {"uniform": [0, 10]}}


def test_bisection_finds_the_boundary_of_each_seed(tmp_path):
    search = {"bisect": {"key": "a", "within": 0.01, "seeds": 2}}
    found, count = searched(tmp_path, lambda v, seed: 3.0 + seed - v["a"], search, AB)
    assert [bracket.middle for bracket in found.brackets] == pytest.approx([4.0, 5.0], abs=0.01)
    assert found.sentence == "a: fails above 4.502 (3.994 to 5.01 by seed), each within 0.01"
    assert count < 2 * 12


def test_bisection_says_where_there_is_no_boundary(tmp_path):
    found, count = searched(tmp_path, lambda *_: 1.0, {"bisect": "a"}, AB)
    assert found.sentence == "a: no boundary from 0 to 10: it passes at both ends with each seed"
    assert count == 6


def test_the_search_for_the_worst_comes_near_it(tmp_path):
    def margin(v, _):
        return (v["a"] - 8.5) ** 2 + (v["b"] - 2.0) ** 2 - 0.5

    found, count = searched(tmp_path, margin, {"worst": {"keys": ["a", "b"], "runs": 120}}, AB)
    assert count == 120
    assert found.worst.values == pytest.approx({"a": 8.5, "b": 2.0}, abs=0.7)
    assert not found.worst.passed


def test_a_rare_probability_is_within_its_interval(tmp_path):
    vary = {"a": {"normal": {"mean": 0, "std": 1, "min": -8, "max": 8}}, "b": {"uniform": [0, 1]}}
    found, count = searched(tmp_path, lambda v, _: 3.5 - v["a"], {"rare": {"runs": 800}}, vary)
    truth = 1.0 - NormalDist().cdf(3.5)  # 2.3e-4: 800 plain runs see none, five times in six
    assert count == 800
    assert found.low < truth < found.high
    assert found.high < 3.0 * truth
    assert found.shift["a"] > 2.0
    assert max(record.weight for record in found.records) <= 5.0


def test_a_search_that_goes_on_flies_nothing_twice(tmp_path):
    search = {"worst": {"keys": ["a"], "runs": 40}}
    first, count = searched(tmp_path, lambda v, _: v["a"], search, AB)
    again, more = searched(tmp_path, lambda v, _: v["a"], search, AB)
    assert (count, more) == (40, 0)
    assert again == first
