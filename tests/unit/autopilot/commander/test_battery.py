"""The charge estimator: starts from the voltage, counts the current, is corrected by the voltage."""

import pytest

from autopilot.commander.battery import BatteryEstimator
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
