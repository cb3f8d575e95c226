"""Records of runs: whose margin counts, where a check has several bounds or there are several vehicles."""

import pytest

from mission.campaign.runs import Order, record_of
from mission.scenario.result import CheckResult, ScenarioResult

ORDER = Order("sample", 0, 1, {})


def check(name, **margin):
    return CheckResult(name, passed=True, asked="", happened="", **margin)


@pytest.mark.parametrize(
    ("names", "counts"),
    [
        (["place", "hold"], "place"),
        (["place: armed", "place: landed", "place: place", "hold"], "place: place"),
        (["vehicle 1: place: armed", "vehicle 1: place: place", "vehicle 2: hold"], "vehicle 1: place: place"),
        (["vehicle 12: place", "vehicle 1: hold"], "vehicle 12: place"),
        (["places", "placed: place", "hold: place: place"], ""),
    ],
)
def test_the_margin_is_of_all_results_of_the_check_that_is_named(names, counts):
    checks = [check(name) if "armed" in name else check(name, margin=2.0, unit="m") for name in names]
    wider = [check(each.name, margin=5.0, unit="m") for each in checks if each.name == counts]
    narrower = check("another", margin=0.5, unit="m")
    record = record_of(ORDER, ScenarioResult("s", "", 1, (*wider, *checks, narrower)), "place")
    assert (record.check, record.margin) == (counts, 2.0 if counts else None)


def test_without_a_name_the_least_of_all_counts():
    checks = (check("a: x", margin=2.0), check("b", margin=-1.0, unit="m"))
    record = record_of(ORDER, ScenarioResult("s", "", 1, checks), "")
    assert (record.check, record.margin, record.unit) == ("b", -1.0, "m")
