"""Battery monitor: voltage and current, 10 Hz, without delay; white noise only.

The figures are those of a shunt and an INA226 in a power module, as read by its driver: guess.
"""

from typing import Any

import warp as wp

from autopilot.ports import BatterySample
from common.kernels import tick_end_us
from common.rng import draw_tick, normal
from sim.faults import FAULT_STUCK, SensorFault, fault_bias, is_due, noise_gain, sampling_period
from sim.rng_streams import BATTERY_CURRENT, BATTERY_VOLTAGE
from sim.truth import Truth

wp.set_module_options({"enable_backward": False})

BATTERY_PERIOD_TICKS = 25  # 10 Hz
VOLTAGE_STD_V = 0.01  # guess
CURRENT_STD_A = 0.1  # guess


@wp.struct
class BatteryMonitorModel:
    period_ticks: int
    voltage_std: float  # [V]
    current_std: float  # [A]


def battery_monitor_model(noise_scale: float = 1.0) -> Any:
    """The default battery monitor with its noise multiplied by `noise_scale`."""
    model = BatteryMonitorModel()
    model.period_ticks = BATTERY_PERIOD_TICKS
    model.voltage_std = noise_scale * VOLTAGE_STD_V
    model.current_std = noise_scale * CURRENT_STD_A
    return model


@wp.func
def battery_sample(
    model: BatteryMonitorModel,
    held: BatterySample,
    voltage_v: float,
    current_a: float,
    fault: SensorFault,
    seed: int,
    i: int,
    tick: wp.int64,
) -> BatterySample:
    """What the driver reads; a bias fault acts on the voltage."""
    sample = held
    sample.time_us = tick_end_us(tick)
    if fault.mode != FAULT_STUCK or held.time_us == wp.int64(0):
        gain = noise_gain(fault)
        voltage_noise = gain * model.voltage_std * normal(seed, i, draw_tick(tick), BATTERY_VOLTAGE)
        sample.voltage_v = voltage_v + voltage_noise + fault_bias(fault)
        sample.current_a = current_a + gain * model.current_std * normal(seed, i, draw_tick(tick), BATTERY_CURRENT)
    return sample


@wp.func
def sense_battery(
    model: BatteryMonitorModel,
    held: BatterySample,
    fault: SensorFault,
    truth: Truth,
    seed: int,
    i: int,
    tick: wp.int64,
) -> BatterySample:
    """The sample after a tick: a new one if one is due."""
    if not is_due(sampling_period(model.period_ticks, fault), draw_tick(tick)):
        return held
    return battery_sample(model, held, truth.battery_voltage_v, truth.battery_current_a, fault, seed, i, tick)
