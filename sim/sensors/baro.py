"""Barometer: pressure of the International Standard Atmosphere, 50 Hz, without delay.

Defaults are a TE Connectivity MS5611-01BA03 (data sheet, "Technical data") at its highest oversampling. Errors:
offset at power-on, slow drift (weather and warm-up) as a Gauss-Markov process, white noise. Left out: the pressure
that wind and propeller wash make at the port, and humidity.
"""

from math import exp
from typing import Any

import warp as wp

from autopilot.ports import BaroSample
from common.kernels import TICK_S, tick_end_us
from common.rng import draw_tick, normal
from sim.faults import FAULT_STUCK, SensorFault, fault_bias, is_due, noise_gain, sampling_period
from sim.rng_streams import BARO_DRIFT, BARO_DRIFT_START, BARO_OFFSET, BARO_WHITE

wp.set_module_options({"enable_backward": False})

BARO_PERIOD_TICKS = 5  # 50 Hz: two conversions of 8.22 ms (pressure, temperature) at oversampling 4096
WHITE_STD_PA = 1.2  # MS5611: resolution 0.012 mbar RMS at oversampling 4096
OFFSET_STD_PA = 50.0  # MS5611: accuracy ±1.5 mbar at 25 deg C, read as three standard deviations
DRIFT_STD_PA = 4.0  # guess: a third of a metre
DRIFT_TIME_S = 300.0  # guess

# International Standard Atmosphere, ISO 2533:1975, troposphere
SEA_LEVEL_PRESSURE_PA = wp.constant(101325.0)
SEA_LEVEL_TEMPERATURE_K = wp.constant(288.15)
LAPSE_RATE_K_M = wp.constant(0.0065)
PRESSURE_EXPONENT = wp.constant(5.255880)  # g M / (R L)
_KELVIN = wp.constant(273.15)


@wp.struct
class BaroModel:
    period_ticks: int
    white_std: float  # [Pa]
    offset_std: float  # [Pa]
    drift_std: float  # [Pa]
    drift_keep: float  # fraction of the drift left after one period


@wp.struct
class BaroState:
    offset_pa: float
    drift_pa: float


def baro_model(noise_scale: float = 1.0) -> Any:
    """The default barometer with its errors multiplied by `noise_scale`."""
    model = BaroModel()
    model.period_ticks = BARO_PERIOD_TICKS
    model.white_std = noise_scale * WHITE_STD_PA
    model.offset_std = noise_scale * OFFSET_STD_PA
    model.drift_std = noise_scale * DRIFT_STD_PA
    model.drift_keep = exp(-BARO_PERIOD_TICKS * TICK_S / DRIFT_TIME_S)
    return model


@wp.func
def isa_temperature_k(alt_amsl_m: float) -> float:
    """Air temperature [K] of the standard atmosphere, troposphere."""
    return SEA_LEVEL_TEMPERATURE_K - LAPSE_RATE_K_M * alt_amsl_m


@wp.func
def isa_pressure_pa(alt_amsl_m: float) -> float:
    """Static pressure [Pa] of the standard atmosphere, troposphere."""
    return SEA_LEVEL_PRESSURE_PA * wp.pow(isa_temperature_k(alt_amsl_m) / SEA_LEVEL_TEMPERATURE_K, PRESSURE_EXPONENT)


@wp.func
def baro_boot(model: BaroModel, seed: int, i: int, tick: int) -> BaroState:
    """The state at power-on."""
    state = BaroState()
    state.offset_pa = model.offset_std * normal(seed, i, tick, BARO_OFFSET)
    state.drift_pa = model.drift_std * normal(seed, i, tick, BARO_DRIFT_START)
    return state


@wp.func
def baro_drift(model: BaroModel, state: BaroState, seed: int, i: int, tick: int) -> BaroState:
    """The drift one period later."""
    out = state
    keep = model.drift_keep
    kick = wp.sqrt(1.0 - keep * keep)
    out.drift_pa = keep * state.drift_pa + kick * model.drift_std * normal(seed, i, tick, BARO_DRIFT)
    return out


@wp.func
def baro_sample(
    model: BaroModel,
    state: BaroState,
    held: BaroSample,
    alt_amsl_m: float,
    fault: SensorFault,
    seed: int,
    i: int,
    tick: wp.int64,
) -> BaroSample:
    """What the driver reads at `alt_amsl_m` [m]."""
    sample = held
    sample.time_us = tick_end_us(tick)
    if fault.mode != FAULT_STUCK or held.time_us == wp.int64(0):
        noise = noise_gain(fault) * model.white_std * normal(seed, i, draw_tick(tick), BARO_WHITE)
        sample.pressure_pa = isa_pressure_pa(alt_amsl_m) + state.offset_pa + state.drift_pa + noise + fault_bias(fault)
        sample.temperature_c = isa_temperature_k(alt_amsl_m) - _KELVIN
    return sample


@wp.func
def sense_baro(
    model: BaroModel,
    state: BaroState,
    held: BaroSample,
    fault: SensorFault,
    alt_amsl_m: float,
    seed: int,
    i: int,
    tick: wp.int64,
) -> tuple[BaroState, BaroSample]:
    """Drift and sample after a tick: new ones if they are due."""
    count = draw_tick(tick)
    drifted = state
    sample = held
    if is_due(model.period_ticks, count):
        drifted = baro_drift(model, state, seed, i, count)
    if is_due(sampling_period(model.period_ticks, fault), count):
        sample = baro_sample(model, drifted, held, alt_amsl_m, fault, seed, i, tick)
    return drifted, sample
