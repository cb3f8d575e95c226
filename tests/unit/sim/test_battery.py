import itertools

import pytest

from common.airframe import load_airframe
from sim.battery import battery_current, battery_model, open_circuit_voltage


@pytest.fixture
def pack():
    return battery_model(load_airframe("x500"))


def test_full_and_empty_packs_have_the_voltages_of_the_file(pack):
    assert open_circuit_voltage(pack, pack.capacity_c) == pytest.approx(4 * 4.2, abs=0.01)
    assert open_circuit_voltage(pack, 0.0) == pytest.approx(4 * 3.0, abs=0.01)


def test_voltage_only_falls_as_charge_leaves(pack):
    voltages = [open_circuit_voltage(pack, fraction / 100 * pack.capacity_c) for fraction in range(100, -6, -1)]
    assert all(after < before for before, after in itertools.pairwise(voltages))


def test_an_overdrawn_pack_collapses(pack):
    assert open_circuit_voltage(pack, -0.05 * pack.capacity_c) == 0.0
    assert battery_current(pack, 0.0, 0.0) == 0.0


@pytest.mark.parametrize("power_w", [0.0, 8.0, 200.0, 900.0])
def test_current_delivers_the_power_at_the_sagged_voltage(pack, power_w):
    current = battery_current(pack, 16.0, power_w)
    assert current * (16.0 - pack.resistance_ohm * current) == pytest.approx(power_w, rel=1e-6)


def test_a_pack_gives_no_more_than_its_greatest_power(pack):
    current = battery_current(pack, 16.0, 1e6)
    assert current == pytest.approx(16.0 / (2 * pack.resistance_ohm))
