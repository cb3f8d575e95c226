"""An optical flow sensor at 25 Hz, with the distance to the ground known: white noise only."""

from typing import Any

import warp as wp

from autopilot.ports import FlowSample
from common.kernels import tick_end_us
from common.rng import draw_tick, normal3
from sim.faults import FAULT_STUCK, SensorFault, fault_bias, is_due, noise_gain, sampling_period
from sim.rng_streams import FLOW_WHITE
from sim.truth import Truth

wp.set_module_options({"enable_backward": False})


@wp.struct
class FlowModel:
    period_ticks: int
    std: float  # [m/s]


def flow_model(noise_scale: float = 1.0) -> Any:
    """The default sensor with its noise multiplied by `noise_scale`."""
    model = FlowModel()
    model.period_ticks = 10
    model.std = 0.05 * noise_scale
    return model


@wp.func
def sense_flow(
    model: FlowModel, held: FlowSample, fault: SensorFault, truth: Truth, seed: int, i: int, tick: wp.int64
) -> FlowSample:
    """The sample after a tick: a new one if one is due."""
    if not is_due(sampling_period(model.period_ticks, fault), draw_tick(tick)):
        return held
    sample = held
    sample.time_us = tick_end_us(tick)
    if fault.mode != FAULT_STUCK:
        vel_frd = wp.quat_rotate_inv(truth.q_ned_from_frd, truth.vel_ned)
        noise = normal3(seed, i, draw_tick(tick), FLOW_WHITE) * model.std * noise_gain(fault)
        bias = fault_bias(fault)
        sample.vel_frd = wp.vec2(vel_frd[0] + noise[0] + bias, vel_frd[1] + noise[1] + bias)
    return sample
