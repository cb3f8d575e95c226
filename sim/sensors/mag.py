"""Magnetometer: the world field at home seen in the body frame, 25 Hz, without delay.

Defaults are a PNI RM3100 (data sheet 1017252, 200 cycle counts). Errors: hard iron (offset) and soft iron (symmetric
matrix) that a calibration leaves, drawn per vehicle; white noise. Left out: the field of motor currents, the change
of the world field over a flight (2e-4 gauss per kilometre of height, less along the ground), temperature.
"""

from typing import Any

import numpy as np
import warp as wp

from autopilot.ports import MagSample
from common.kernels import tick_end_us
from common.rng import draw_tick, normal3
from sim.faults import (
    FAULT_STUCK,
    FAULT_TURNED,
    SensorFault,
    fault_bias3,
    fault_turn,
    is_due,
    noise_gain,
    sampling_period,
)
from sim.rng_streams import MAG_HARD_IRON, MAG_SOFT_IRON_CROSS, MAG_SOFT_IRON_DIAGONAL, MAG_WHITE

wp.set_module_options({"enable_backward": False})

MAG_PERIOD_TICKS = 10  # 25 Hz
WHITE_STD_GAUSS = 1.5e-4  # RM3100: 15 nT at 200 cycle counts
# Left after calibration, guess. Against 0.2 gauss horizontal the hard iron turns heading by 0.8 deg, and the soft
# iron, which tips 0.43 gauss of vertical field, by 0.35 deg: a hovering vehicle cannot tell them from a turned field.
HARD_IRON_STD_GAUSS = 3.0e-3
SOFT_IRON_STD = 3.0e-3  # each element of the matrix


@wp.struct
class MagModel:
    period_ticks: int
    field_ned_gauss: wp.vec3  # world field at home
    white_std: float  # [gauss] each axis
    hard_iron_std: float  # [gauss] each axis
    soft_iron_std: float  # each element


@wp.struct
class MagState:
    hard_iron_frd: wp.vec3  # [gauss]
    soft_iron: wp.mat33


def mag_model(field_ned_gauss: np.ndarray, noise_scale: float = 1.0) -> Any:
    """The default magnetometer in a world field [gauss] of shape (3,), its errors multiplied by `noise_scale`."""
    model = MagModel()
    model.period_ticks = MAG_PERIOD_TICKS
    model.field_ned_gauss = wp.vec3(*(float(component) for component in field_ned_gauss))
    model.white_std = noise_scale * WHITE_STD_GAUSS
    model.hard_iron_std = noise_scale * HARD_IRON_STD_GAUSS
    model.soft_iron_std = noise_scale * SOFT_IRON_STD
    return model


@wp.func
def mag_boot(model: MagModel, seed: int, i: int, tick: int) -> MagState:
    """The iron of this vehicle."""
    diagonal = model.soft_iron_std * normal3(seed, i, tick, MAG_SOFT_IRON_DIAGONAL)
    cross = model.soft_iron_std * normal3(seed, i, tick, MAG_SOFT_IRON_CROSS)
    state = MagState()
    state.hard_iron_frd = model.hard_iron_std * normal3(seed, i, tick, MAG_HARD_IRON)
    state.soft_iron = wp.mat33(
        1.0 + diagonal[0], cross[0], cross[1],
        cross[0], 1.0 + diagonal[1], cross[2],
        cross[1], cross[2], 1.0 + diagonal[2],
    )  # fmt: skip
    return state


@wp.func
def mag_sample(
    model: MagModel,
    state: MagState,
    held: MagSample,
    q_ned_from_frd: wp.quat,
    fault: SensorFault,
    seed: int,
    i: int,
    tick: wp.int64,
) -> MagSample:
    """What the driver reads: soft iron times the field in frd, plus hard iron and noise."""
    sample = held
    sample.time_us = tick_end_us(tick)
    if fault.mode != FAULT_STUCK or held.time_us == wp.int64(0):
        field_frd = wp.quat_rotate_inv(q_ned_from_frd, model.field_ned_gauss)
        if fault.mode == FAULT_TURNED:
            field_frd = wp.quat_rotate(fault_turn(fault), field_frd)
        noise = noise_gain(fault) * model.white_std * normal3(seed, i, draw_tick(tick), MAG_WHITE)
        sample.field_frd_gauss = state.soft_iron * field_frd + state.hard_iron_frd + noise + fault_bias3(fault)
    return sample


@wp.func
def sense_mag(
    model: MagModel,
    state: MagState,
    held: MagSample,
    fault: SensorFault,
    q_ned_from_frd: wp.quat,
    seed: int,
    i: int,
    tick: wp.int64,
) -> MagSample:
    """The sample after a tick: a new one if one is due."""
    if not is_due(sampling_period(model.period_ticks, fault), draw_tick(tick)):
        return held
    return mag_sample(model, state, held, q_ned_from_frd, fault, seed, i, tick)
