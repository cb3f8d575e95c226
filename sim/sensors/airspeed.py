"""Pitot tube: dynamic pressure along the nose at 50 Hz, without delay. A vehicle that has none has no sample.

Defaults are Beard and McLain's ("Small Unmanned Aircraft", Princeton 2012, section 7.4 and appendix H): white noise of
2 Pa; of the offset what is left once it was zeroed on the ground. Left out: position error, angle of attack, icing.
"""

from typing import Any

import warp as wp

from autopilot.ports import AirspeedSample
from common.kernels import tick_end_us
from common.rng import draw_tick, normal
from sim.faults import FAULT_STUCK, SensorFault, fault_bias, is_due, noise_gain, sampling_period
from sim.rng_streams import PITOT_OFFSET, PITOT_WHITE
from sim.truth import Truth

wp.set_module_options({"enable_backward": False})

PITOT_PERIOD_TICKS = 5  # 50 Hz
WHITE_STD_PA = 2.0  # Beard and McLain, appendix H
OFFSET_STD_PA = 1.0  # guess: a zero by the mean of some seconds, and what temperature adds


@wp.struct
class PitotModel:
    period_ticks: int
    white_std: float  # [Pa]
    offset_std: float  # [Pa]


@wp.struct
class PitotState:
    offset_pa: float


def pitot_model(noise_scale: float = 1.0) -> Any:
    """The default tube with its errors multiplied by `noise_scale`."""
    model = PitotModel()
    model.period_ticks = PITOT_PERIOD_TICKS
    model.white_std = noise_scale * WHITE_STD_PA
    model.offset_std = noise_scale * OFFSET_STD_PA
    return model


@wp.func
def pitot_boot(model: PitotModel, seed: int, i: int, tick: int) -> PitotState:
    """The error drawn at power-on."""
    state = PitotState()
    state.offset_pa = model.offset_std * normal(seed, i, tick, PITOT_OFFSET)
    return state


@wp.func
def sense_pitot(
    model: PitotModel,
    state: PitotState,
    held: AirspeedSample,
    fault: SensorFault,
    truth: Truth,
    seed: int,
    i: int,
    tick: wp.int64,
) -> AirspeedSample:
    """The sample after a tick: a new one if one is due."""
    sample = held
    count = draw_tick(tick)
    if truth.has_pitot == 1 and is_due(sampling_period(model.period_ticks, fault), count):
        sample.time_us = tick_end_us(tick)
        if fault.mode != FAULT_STUCK or held.time_us == wp.int64(0):
            noise = noise_gain(fault) * model.white_std * normal(seed, i, count, PITOT_WHITE)
            sample.pressure_pa = truth.pitot_pa + state.offset_pa + noise + fault_bias(fault)
    return sample
