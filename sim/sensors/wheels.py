"""Wheel encoders: one on either side's rear wheel, counted at 50 Hz. A vehicle without wheels has none.

Defaults are a magnet ring of 96 steps on the motor behind a gear of 10, on a wheel of 0.09 m. Errors: whole steps; a
scale by which the rolling radius differs from what the driver believes (load, wear, pressure), drawn at power-on; white
noise of the latch. Slip is inherent: what is counted is the wheel, not the ground. Left out: missed steps.
"""

from typing import Any

import warp as wp

from autopilot.ports import WheelSample
from common.kernels import TICK_S, TICK_US, tick_end_us
from common.rng import draw_tick, normal
from sim.faults import FAULT_STUCK, SensorFault, fault_bias, is_due, noise_gain, sampling_period
from sim.rng_streams import WHEEL_LEFT_WHITE, WHEEL_RIGHT_WHITE, WHEEL_SCALE_LEFT, WHEEL_SCALE_RIGHT
from sim.truth import Truth

wp.set_module_options({"enable_backward": False})

WHEEL_PERIOD_TICKS = 5  # 50 Hz
STEP_M = 0.0006  # 0.09 m x 2 pi over 960 steps
SCALE_STD = 0.01  # guess
WHITE_STD_M_S = 0.01  # guess: jitter of the latch over a period
_TICK_S = wp.constant(TICK_S)


@wp.struct
class WheelModel:
    period_ticks: int
    step_m: float  # of tread per count
    scale_std: float
    white_std_m_s: float


@wp.struct
class WheelState:
    scale_left: float  # counted over rolled
    scale_right: float
    rolled_left_m: float  # not counted yet
    rolled_right_m: float
    since_ticks: int  # since the last sample


def wheel_model(noise_scale: float = 1.0) -> Any:
    """The default encoders with their errors multiplied by `noise_scale`."""
    model = WheelModel()
    model.period_ticks = WHEEL_PERIOD_TICKS
    model.step_m = noise_scale * STEP_M
    model.scale_std = noise_scale * SCALE_STD
    model.white_std_m_s = noise_scale * WHITE_STD_M_S
    return model


@wp.func
def wheels_boot(model: WheelModel, seed: int, i: int, tick: int) -> WheelState:
    """The errors drawn at power-on."""
    state = WheelState()
    state.scale_left = 1.0 + model.scale_std * normal(seed, i, tick, WHEEL_SCALE_LEFT)
    state.scale_right = 1.0 + model.scale_std * normal(seed, i, tick, WHEEL_SCALE_RIGHT)
    return state


@wp.func
def counted(model: WheelModel, rolled_m: float) -> float:
    """Whole steps of a way [m]."""
    if model.step_m <= 0.0:
        return rolled_m
    return model.step_m * wp.floor(rolled_m / model.step_m)


@wp.func
def sense_wheels(
    model: WheelModel,
    state: WheelState,
    held: WheelSample,
    fault: SensorFault,
    truth: Truth,
    seed: int,
    i: int,
    tick: wp.int64,
) -> tuple[WheelState, WheelSample]:
    """The encoders after a tick, and their sample: a new one if one is due, timed at the middle of what it counts."""
    out = state
    sample = held
    if truth.has_wheels == 1:
        out.rolled_left_m += state.scale_left * truth.wheel_speed_m_s[0] * _TICK_S
        out.rolled_right_m += state.scale_right * truth.wheel_speed_m_s[1] * _TICK_S
        out.since_ticks += 1
        count = draw_tick(tick)
        if is_due(sampling_period(model.period_ticks, fault), count):
            left_m = counted(model, out.rolled_left_m)
            right_m = counted(model, out.rolled_right_m)
            sample.time_us = tick_end_us(tick) - wp.int64(out.since_ticks * (TICK_US // 2))
            if fault.mode != FAULT_STUCK or held.time_us == wp.int64(0):
                per_s = 1.0 / (float(out.since_ticks) * _TICK_S)
                std = noise_gain(fault) * model.white_std_m_s
                bias = fault_bias(fault)
                sample.left_m_s = left_m * per_s + bias
                sample.right_m_s = right_m * per_s + bias
                if left_m != 0.0:  # a wheel that stands has no jitter
                    sample.left_m_s += std * normal(seed, i, count, WHEEL_LEFT_WHITE)
                if right_m != 0.0:
                    sample.right_m_s += std * normal(seed, i, count, WHEEL_RIGHT_WHITE)
            out.rolled_left_m -= left_m
            out.rolled_right_m -= right_m
            out.since_ticks = 0
    return out, sample
