"""The golden flights are what they were: a change that is meant is shown by `make golden`, in a commit that says so."""

import json

import pytest

from tests.golden.__main__ import GOLDEN
from tests.golden.flights import FLIGHTS
from tests.golden.record import differences, flown, machine


@pytest.fixture(scope="module")
def golden():
    return json.loads(GOLDEN.read_text())


@pytest.mark.parametrize("name", FLIGHTS)
def test_a_golden_flight_is_what_it_was(golden, name):
    is_same = golden["machine"] == machine()
    changes = differences(golden["flights"][name], flown(FLIGHTS[name]), is_same_machine=is_same)
    assert not changes, "\n".join([f"{name} has changed (make golden renews it):", *changes])


def test_every_golden_flight_is_flown(golden):
    assert set(golden["flights"]) == set(FLIGHTS)


def test_a_change_of_one_bit_is_told_and_rounding_is_told_apart():
    old = {"figures": {"landing": 1.0, "result": "landed"}, "topics": {"attitude 0": "a"}, "logs": {"flight.ulg": "b"}}
    new = {"figures": {"landing": 1.01, "result": "landed"}, "topics": {"attitude 0": "c"}, "logs": {"flight.ulg": "d"}}
    assert differences(old, old, is_same_machine=True) == []
    reported = ["landing: 1.0 -> 1.01 (rounding)", "attitude 0: has other bytes", "flight.ulg: has other bytes"]
    assert differences(old, new, is_same_machine=True) == reported
    assert differences(old, new, is_same_machine=False) == []
    new["figures"]["result"] = "crashed"
    assert differences(old, new, is_same_machine=False) == ["result: landed -> crashed"]
