"""Range finder looking along body down from the centre of gravity, 25 Hz, without delay.

Defaults are a Benewake TF02-Pro: 0.1 to 40 m, ±6 cm to 6 m, ±1 % beyond (from memory of its data sheet). Errors: white
noise. Left out: beam width, reflectivity and sunlight.
"""

from typing import Any

import warp as wp

from autopilot.ports import RangeSample
from common.kernels import tick_end_us
from common.rng import draw_tick, normal
from sim.faults import FAULT_STUCK, SensorFault, fault_bias, is_due, noise_gain, sampling_period
from sim.rng_streams import RANGE_WHITE
from sim.truth import Truth
from sim.world.world import World, ray_hit

wp.set_module_options({"enable_backward": False})

RANGE_PERIOD_TICKS = 10  # 25 Hz
MIN_DISTANCE_M = 0.1  # TF02-Pro
MAX_DISTANCE_M = 40.0  # TF02-Pro, 90 % reflectivity
NEAR_STD_M = 0.02  # TF02-Pro: ±6 cm, read as three standard deviations
FAR_STD_FRACTION = 0.01 / 3.0  # TF02-Pro: ±1 % of the distance, read as three standard deviations


@wp.struct
class RangeModel:
    period_ticks: int
    min_distance: float  # [m]
    max_distance: float  # [m]
    near_std: float  # [m]
    far_std_fraction: float  # standard deviation over distance


def range_model(noise_scale: float = 1.0) -> Any:
    """The default range finder with its noise multiplied by `noise_scale`."""
    model = RangeModel()
    model.period_ticks = RANGE_PERIOD_TICKS
    model.min_distance = MIN_DISTANCE_M
    model.max_distance = MAX_DISTANCE_M
    model.near_std = noise_scale * NEAR_STD_M
    model.far_std_fraction = noise_scale * FAR_STD_FRACTION
    return model


@wp.func
def range_sample(
    model: RangeModel,
    held: RangeSample,
    distance_m: float,
    fault: SensorFault,
    seed: int,
    i: int,
    tick: wp.int64,
) -> RangeSample:
    """What the driver reads when the ray along body down meets something after `distance_m` [m].

    Out of range it reports the nearer limit and `is_valid` 0.
    """
    sample = held
    sample.time_us = tick_end_us(tick)
    if fault.mode != FAULT_STUCK or held.time_us == wp.int64(0):
        std = noise_gain(fault) * wp.max(model.near_std, model.far_std_fraction * distance_m)
        distance = distance_m + std * normal(seed, i, draw_tick(tick), RANGE_WHITE) + fault_bias(fault)
        sample.is_valid = 0
        if distance >= model.min_distance and distance_m < model.max_distance:
            sample.is_valid = 1
        sample.distance_m = wp.clamp(distance, model.min_distance, model.max_distance)
    return sample


@wp.func
def sense_range(
    model: RangeModel,
    held: RangeSample,
    fault: SensorFault,
    truth: Truth,
    world: World,
    seed: int,
    i: int,
    tick: wp.int64,
) -> RangeSample:
    """The sample after a tick: a new one if one is due."""
    if not is_due(sampling_period(model.period_ticks, fault), draw_tick(tick)):
        return held
    down_ned = wp.quat_rotate(truth.q_ned_from_frd, wp.vec3(0.0, 0.0, 1.0))
    distance_m = ray_hit(world, truth.pos_ned, down_ned, model.max_distance)
    return range_sample(model, held, distance_m, fault, seed, i, tick)
