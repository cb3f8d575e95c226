"""Battery: open-circuit voltage from the charge left, sag from internal resistance.

In: electrical power asked for, each tick. Out: terminal voltage, current, charge left. The voltage scales the speed
the motors can reach. Left out: temperature, ageing, relaxation after a load, cell imbalance.
"""

import warp as wp

from common.airframe import Airframe

wp.set_module_options({"enable_backward": False})

# M. Chen, G. A. Rincon-Mora, "Accurate electrical battery model capable of predicting runtime and I-V performance",
# IEEE Trans. Energy Conversion 21(2), 2006, equation 2:
# V(s) = -1.031 exp(-35 s) + 3.685 + 0.2156 s - 0.1178 s² + 0.3201 s³
_CELL_EMPTY_V = wp.constant(2.654)  # V(0)
_CELL_SPAN_V = wp.constant(1.4489)  # V(1) - V(0)
_DEEPEST_CHARGE = wp.constant(-0.05)  # fraction of capacity below "empty" at which the voltage has collapsed


@wp.struct
class BatteryModel:
    """Pack data."""

    capacity_c: float  # [C]
    resistance_ohm: float
    full_v: float  # [V] open circuit, whole pack
    empty_v: float  # [V] open circuit, whole pack
    motor_efficiency: float  # shaft power over electrical power
    avionics_w: float


@wp.func
def open_circuit_voltage(model: BatteryModel, charge_c: float) -> float:
    """Voltage without load [V]: Chen and Rincon-Mora's curve stretched to the pack's full and empty voltages.

    Below empty the curve's exponential makes the voltage collapse within 5 % of the capacity.
    """
    s = wp.clamp(charge_c / model.capacity_c, _DEEPEST_CHARGE, 1.0)
    cell_v = -1.031 * wp.exp(-35.0 * s) + 3.685 + s * (0.2156 + s * (-0.1178 + s * 0.3201))
    fraction = (cell_v - _CELL_EMPTY_V) / _CELL_SPAN_V
    return wp.max(model.empty_v + (model.full_v - model.empty_v) * fraction, 0.0)


@wp.func
def battery_current(model: BatteryModel, open_circuit_v: float, power_w: float) -> float:
    """Current [A] that delivers power_w at the terminals: the smaller root of R I² - V I + P = 0.

    Where the pack cannot deliver the power the current is that of its maximum power.
    """
    power = wp.min(power_w, open_circuit_v * open_circuit_v / (4.0 * wp.max(model.resistance_ohm, 1.0e-4)))
    root = wp.sqrt(wp.max(open_circuit_v * open_circuit_v - 4.0 * model.resistance_ohm * power, 0.0))
    return 2.0 * power / wp.max(open_circuit_v + root, 0.01)  # 0 for a pack without voltage


@wp.struct
class Discharge:
    """A pack after a while of a load."""

    charge_c: float  # [C] left
    rounding_c: float  # [C] what rounding has added to it, to be taken off (Kahan's sum)
    voltage_v: float
    current_a: float


@wp.func
def discharged(model: BatteryModel, charge_c: float, rounding_c: float, power_w: float, dt: float) -> Discharge:
    """The pack after dt [s] of a load [W].

    A tick takes 0.05 C from 18,000 C, where float32 is 0.002 C apart: without compensation 2 % would be lost.
    """
    after = Discharge()
    open_v = open_circuit_voltage(model, charge_c)
    after.current_a = battery_current(model, open_v, power_w)
    after.voltage_v = open_v - model.resistance_ohm * after.current_a
    taken_c = after.current_a * dt + rounding_c
    after.charge_c = charge_c - taken_c
    after.rounding_c = (after.charge_c - charge_c) + taken_c
    return after


def battery_model(airframe: Airframe) -> BatteryModel:
    """Battery constants of an airframe."""
    data = airframe.battery
    model = BatteryModel()
    model.capacity_c = data.capacity_mah * 3.6
    model.resistance_ohm = data.internal_resistance_ohm
    model.full_v = data.cells * data.full_cell_v
    model.empty_v = data.cells * data.empty_cell_v
    model.motor_efficiency = data.motor_efficiency
    model.avionics_w = data.avionics_w
    return model


_HALVINGS = 40


def charge_at(model: BatteryModel, rest_v: float) -> float:
    """The charge [C] at which the pack rests at a voltage [V]; the curve rises, so halving the interval finds it."""
    empty_c, full_c = 0.0, float(model.capacity_c)
    for _ in range(_HALVINGS):
        middle_c = 0.5 * (empty_c + full_c)
        if float(open_circuit_voltage(model, middle_c)) < rest_v:
            empty_c = middle_c
        else:
            full_c = middle_c
    return 0.5 * (empty_c + full_c)
