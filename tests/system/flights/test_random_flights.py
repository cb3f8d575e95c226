"""Modes, commands, missions, fences, sticks and failures in random order: no crash, no surprise, and it comes home."""

import pytest

from tests.system.scenario import Scenario


@pytest.mark.parametrize("seed", range(2))
def test_a_random_flight_ends_on_the_ground(seed):
    Scenario(seed, seconds=40.0, fails=False).fly()


def test_a_random_flight_stops_at_a_fence():
    Scenario(2, seconds=60.0, fails=False).fly_at_fence()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20, 60))
def test_random_flights_stop_at_a_fence(seed):
    Scenario(seed, fails=False).fly_at_fence()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(60, 90))
def test_random_flights_with_an_empty_battery_end_on_the_ground(seed):
    Scenario(seed, seconds=40.0, fails=False).fly_out_of_charge()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 130))
def test_more_random_flights_end_on_the_ground(seed):
    Scenario(seed, fails=False).fly()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1000, 1030))
def test_random_flights_with_failing_sensors_end_on_the_ground(seed):
    Scenario(seed, fails=True).fly()
