"""The charge estimator: starts from the voltage, counts the current, is corrected by the voltage. Limits of voltage."""

import pytest

from autopilot.ardupilot_only_params import ARDUPILOT_PARAMETERS
from autopilot.commander.battery import BatteryEstimator, VoltageLimits
from autopilot.interface.vehicle_state import BatteryLevel
from autopilot.params import parameter_table
from common.airframe import load_airframe

BATTERY = load_airframe("x500").battery


def test_full_and_empty_rest_voltage_are_full_and_empty():
    full, empty = BatteryEstimator(BATTERY), BatteryEstimator(BATTERY)
    full.update(1, BATTERY.cells * BATTERY.full_cell_v, 0.0)
    empty.update(1, BATTERY.cells * BATTERY.empty_cell_v, 0.0)
    assert full.remaining == 1.0
    assert empty.remaining == 0.0


def test_sag_under_load_does_not_count_as_discharge():
    loaded = BatteryEstimator(BATTERY)
    loaded.update(1, BATTERY.cells * BATTERY.full_cell_v - 20.0 * BATTERY.internal_resistance_ohm, 20.0)
    assert loaded.remaining == pytest.approx(1.0)


def test_current_is_counted():
    battery = BatteryEstimator(BATTERY)
    voltage = 15.6
    battery.update(1_000_000, voltage, 0.0)
    start = battery.remaining
    for i in range(1, 361):
        battery.update(1_000_000 + i * 100_000, voltage - 10.0 * BATTERY.internal_resistance_ohm, 10.0)
    assert battery.used_mah == pytest.approx(100.0, rel=1e-6)
    assert start - 100.0 / BATTERY.capacity_mah <= battery.remaining < start


def test_no_voltage_is_no_sample():
    battery = BatteryEstimator(BATTERY)
    battery.update(1, 0.0, 0.0)
    assert battery.remaining != battery.remaining


@pytest.mark.parametrize("is_frozen", [False, True])
def test_silent_or_frozen_sensor_is_counted_on_with_its_last_current(is_frozen):
    battery = BatteryEstimator(BATTERY)
    battery.update(1_000_000, 16.0, 0.0)
    battery.update(2_000_000, 15.8, 36.0)
    start = battery.remaining
    for i in range(1, 101):
        now_us = 2_000_000 + i * 1_000_000
        if is_frozen:
            battery.update(now_us, 15.8, 36.0)
        battery.count_on(now_us)
        assert battery.is_silent == (i > 5)
    assert battery.used_mah == pytest.approx(1010.0)  # from the first sample on
    assert battery.remaining == pytest.approx(start - 1000.0 / BATTERY.capacity_mah, abs=0.02)


def test_sensor_that_speaks_again_is_believed_again():
    battery = BatteryEstimator(BATTERY)
    battery.update(1_000_000, 16.0, 10.0)
    battery.count_on(9_000_000)
    battery.update(9_000_000, 15.9, 10.0)
    battery.count_on(9_000_000)
    assert not battery.is_silent
    assert battery.used_mah == pytest.approx(10.0 * 8.0 / 3.6)


def test_voltage_that_falls_far_below_the_count_is_believed_after_five_seconds():
    battery = BatteryEstimator(BATTERY)
    battery.update(1_000_000, BATTERY.cells * BATTERY.full_cell_v, 0.0)
    low_v = BATTERY.cells * (BATTERY.empty_cell_v + 0.1)
    for i in range(1, 80):
        battery.update(1_000_000 + i * 100_000, low_v + 0.001 * (i % 2), 0.0)
        assert (battery.remaining > 0.8) == (i <= 50), i
    assert battery.remaining < 0.1


def test_short_dip_of_the_voltage_is_not_believed():
    battery = BatteryEstimator(BATTERY)
    full_v = BATTERY.cells * BATTERY.full_cell_v
    for i in range(100):
        is_dip = 20 <= i < 60
        battery.update(1_000_000 + i * 100_000, 12.5 + 0.001 * (i % 2) if is_dip else full_v, 0.0)
    assert battery.remaining > 0.95


def limits(**values):
    params = parameter_table(None, ARDUPILOT_PARAMETERS)
    for name, value in {"BATT_LOW_VOLT": 14.0, "BATT_CRT_VOLT": 13.0, "BATT_LOW_TIMER": 2.0, **values}.items():
        params.set_exactly(name, value)
    return VoltageLimits(params)


@pytest.mark.parametrize(
    ("voltage_v", "level"),
    [(14.0, BatteryLevel.UNDEFINED), (13.9, BatteryLevel.LOW), (12.9, BatteryLevel.CRITICAL)],
)
def test_voltage_counts_once_it_has_been_low_for_the_time(voltage_v, level):
    watched = limits()
    assert watched.level(0, voltage_v) is BatteryLevel.UNDEFINED
    assert watched.level(1_990_000, voltage_v) is BatteryLevel.UNDEFINED
    assert watched.level(2_000_000, voltage_v) is level


def test_voltage_that_recovers_begins_its_time_anew():
    watched = limits()
    watched.level(0, 13.5)
    watched.level(1_000_000, 15.0)
    assert watched.level(2_500_000, 13.5) is BatteryLevel.UNDEFINED
    assert watched.level(4_500_000, 13.5) is BatteryLevel.LOW


@pytest.mark.parametrize(
    ("name", "level"),
    [
        ("BATT_LOW_VOLT", BatteryLevel.CRITICAL),
        ("BATT_CRT_VOLT", BatteryLevel.LOW),
        ("BATT_LOW_TIMER", BatteryLevel.UNDEFINED),
    ],
)
def test_zero_takes_a_voltage_limit_away(name, level):
    watched = limits(**{name: 0.0})
    watched.level(0, 12.0)
    assert watched.level(60_000_000, 12.0) is level


def test_a_battery_without_a_voltage_has_no_level():
    watched = limits()
    watched.level(0, 0.0)
    assert watched.level(60_000_000, 0.0) is BatteryLevel.UNDEFINED
