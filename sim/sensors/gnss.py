"""Satellite navigation receiver: position and velocity, 5 Hz, 120 ms late.

Errors per axis: white noise plus a first-order Gauss-Markov error (ionosphere, multipath, ephemeris) in position,
vertical 1.5 times the horizontal; white noise in velocity. Samples wait in a queue of four for their delivery, so a
delay of several periods works too. Noise that a fault multiplies is that of a jammed receiver: it knows that it is
worse, and sees fewer satellites. Left out: multipath near trees and walls, satellite geometry, clock jumps.
"""

from typing import Any

import warp as wp

from autopilot.ports import GnssSample
from common.kernels import TICK_S, tick_end_us
from common.rng import draw_tick, normal3
from sim.faults import FAULT_OFF, FAULT_STUCK, SensorFault, fault_bias3, is_due, noise_gain, sampling_period
from sim.rng_streams import GNSS_CORRELATED, GNSS_CORRELATED_START, GNSS_POSITION, GNSS_VELOCITY
from sim.truth import Truth

wp.set_module_options({"enable_backward": False})

QUEUE_LENGTH = wp.constant(4)  # rows of the matrices below

GNSS_PERIOD_TICKS = 50  # 5 Hz
GNSS_DELAY_TICKS = 30  # 120 ms
FIRST_FIX_S = 1.5  # u-blox M10 data sheet: hot start 1 s; half a second for its boot (guess)
# Guess, and so is the delay: a good single-frequency receiver under open sky.
POSITION_STD_M = 0.3  # horizontal axis, white
CORRELATED_STD_M = 0.6  # horizontal axis
CORRELATION_TIME_S = 60.0
VERTICAL_FACTOR = 1.5  # vertical errors over horizontal ones
VELOCITY_STD_M_S = 0.1  # each axis, white
SATELLITES = wp.constant(14)  # guess: open sky, two constellations
JAMMED_SATELLITES = wp.constant(5)  # as few as still give a height; guess
# What the receiver says about itself, whatever the noise scale: a receiver does not know that it is simulated.
REPORTED_H_STD_M = 0.95  # √(0.3² + 0.6²) √2: both axes together, as u-blox hAcc
REPORTED_V_STD_M = 1.0  # 1.5 √(0.3² + 0.6²)
REPORTED_VEL_STD_M_S = 0.17  # 0.1 √3: all axes together, as u-blox sAcc


@wp.struct
class GnssModel:
    period_ticks: int
    delay_ticks: int  # from validity to delivery, less than QUEUE_LENGTH periods
    first_fix_ticks: int  # from power-on to the first sample taken
    pos_std_ned: wp.vec3  # [m] white
    correlated_std_ned: wp.vec3  # [m]
    correlation_ticks: float  # time constant
    vel_std: float  # [m/s] white, each axis
    pos_h_std: float  # [m] reported
    pos_v_std: float  # [m] reported
    reported_vel_std: float  # [m/s] reported
    fix_type: int  # GPS_FIX_TYPE of its solutions


@wp.struct
class GnssState:
    boot_tick: wp.int64
    correlated_ned: wp.vec3  # [m] Gauss-Markov position error
    last_tick: wp.int64  # of the last sample taken
    queue_head: int  # slot of the oldest waiting sample
    queue_count: int
    queue_tick: wp.vec4l  # tick at whose end the sample was taken
    queue_pos_ned: wp.mat44  # [m] a row per sample: north, east, down, nothing
    queue_vel_ned: wp.mat44  # [m/s]


def gnss_model(noise_scale: float = 1.0) -> Any:
    """The default receiver with its errors multiplied by `noise_scale`; rates and delay stay."""
    model = GnssModel()
    model.period_ticks = GNSS_PERIOD_TICKS
    model.delay_ticks = GNSS_DELAY_TICKS
    model.first_fix_ticks = round(FIRST_FIX_S / TICK_S)
    model.pos_std_ned = wp.vec3(1.0, 1.0, VERTICAL_FACTOR) * (noise_scale * POSITION_STD_M)
    model.correlated_std_ned = wp.vec3(1.0, 1.0, VERTICAL_FACTOR) * (noise_scale * CORRELATED_STD_M)
    model.correlation_ticks = CORRELATION_TIME_S / TICK_S
    model.vel_std = noise_scale * VELOCITY_STD_M_S
    model.pos_h_std = REPORTED_H_STD_M
    model.pos_v_std = REPORTED_V_STD_M
    model.reported_vel_std = REPORTED_VEL_STD_M_S
    model.fix_type = 3
    return model


@wp.func
def gnss_boot(model: GnssModel, seed: int, i: int, tick: wp.int64) -> GnssState:
    """The state at power-on: the correlated error has its stationary distribution."""
    state = GnssState()
    state.boot_tick = tick
    state.last_tick = tick
    state.correlated_ned = wp.cw_mul(model.correlated_std_ned, normal3(seed, i, draw_tick(tick), GNSS_CORRELATED_START))
    return state


@wp.func
def gnss_is_taken(period_ticks: int, first_tick: wp.int64, fault: SensorFault, tick: wp.int64) -> bool:
    """True at the ticks at whose end the receiver takes a sample: none before its first fix at `first_tick`."""
    if tick < first_tick:
        return False
    return is_due(sampling_period(period_ticks, fault), draw_tick(tick))


@wp.func
def gnss_take(
    model: GnssModel,
    state: GnssState,
    pos_ned: wp.vec3,
    vel_ned: wp.vec3,
    fault: SensorFault,
    seed: int,
    i: int,
    tick: wp.int64,
) -> GnssState:
    """Puts a sample of the true position and velocity, with errors, into the queue; drops it if the queue is full."""
    out = state
    keep = wp.exp(-float(tick - state.last_tick) / model.correlation_ticks)
    kick = wp.sqrt(1.0 - keep * keep)
    out.correlated_ned = keep * state.correlated_ned + kick * wp.cw_mul(
        model.correlated_std_ned, normal3(seed, i, draw_tick(tick), GNSS_CORRELATED)
    )
    out.last_tick = tick
    if state.queue_count < QUEUE_LENGTH:
        gain = noise_gain(fault)
        pos_noise = gain * wp.cw_mul(model.pos_std_ned, normal3(seed, i, draw_tick(tick), GNSS_POSITION))
        vel_noise = gain * model.vel_std * normal3(seed, i, draw_tick(tick), GNSS_VELOCITY)
        slot = (state.queue_head + state.queue_count) % QUEUE_LENGTH
        ticks = state.queue_tick
        positions = state.queue_pos_ned
        velocities = state.queue_vel_ned
        ticks[slot] = tick
        pos = pos_ned + out.correlated_ned + pos_noise + fault_bias3(fault)
        vel = vel_ned + vel_noise
        positions[slot] = wp.vec4(pos[0], pos[1], pos[2], 0.0)
        velocities[slot] = wp.vec4(vel[0], vel[1], vel[2], 0.0)
        out.queue_tick = ticks
        out.queue_pos_ned = positions
        out.queue_vel_ned = velocities
        out.queue_count = state.queue_count + 1
    return out


@wp.func
def gnss_is_delivered(delay_ticks: int, queue_count: int, oldest_tick: wp.int64, tick: wp.int64) -> bool:
    """True at the tick at whose end the oldest waiting sample reaches the flight controller."""
    return queue_count > 0 and tick - oldest_tick >= wp.int64(delay_ticks)


@wp.func
def gnss_delivered(model: GnssModel, state: GnssState, held: GnssSample, fault: SensorFault) -> GnssSample:
    """The oldest waiting sample as the driver delivers it; nothing comes out of a receiver that is off."""
    sample = held
    if fault.mode != FAULT_OFF:
        gain = noise_gain(fault)
        sample.time_us = tick_end_us(state.queue_tick[state.queue_head])
        sample.fix_type = model.fix_type
        sample.satellites = wp.max(int(float(SATELLITES) / wp.sqrt(gain)), JAMMED_SATELLITES)
        sample.pos_h_std = gain * model.pos_h_std
        sample.pos_v_std = gain * model.pos_v_std
        sample.vel_std = gain * model.reported_vel_std
        if fault.mode != FAULT_STUCK or held.fix_type < 3:
            pos = state.queue_pos_ned[state.queue_head]
            vel = state.queue_vel_ned[state.queue_head]
            sample.pos_ned = wp.vec3(pos[0], pos[1], pos[2])
            sample.vel_ned = wp.vec3(vel[0], vel[1], vel[2])
    return sample


@wp.func
def gnss_drop_oldest(state: GnssState) -> GnssState:
    """The queue without its oldest sample."""
    out = state
    out.queue_head = (state.queue_head + 1) % QUEUE_LENGTH
    out.queue_count = state.queue_count - 1
    return out


@wp.func
def gnss_lost(held: GnssSample) -> GnssSample:
    """The sample while the receiver is off: the last solution with its old time, marked as no fix."""
    sample = held
    sample.fix_type = 0
    sample.satellites = 0
    return sample


@wp.func
def sense_gnss(
    model: GnssModel,
    state: GnssState,
    held: GnssSample,
    fault: SensorFault,
    truth: Truth,
    seed: int,
    i: int,
    tick: wp.int64,
) -> tuple[GnssState, GnssSample]:
    """The receiver after a tick, and what it has delivered by then."""
    out = state
    sample = held
    first_fix = state.boot_tick + wp.int64(model.first_fix_ticks)
    if gnss_is_taken(model.period_ticks, first_fix, fault, tick):
        out = gnss_take(model, out, truth.pos_ned, truth.vel_ned, fault, seed, i, tick)
    if gnss_is_delivered(model.delay_ticks, out.queue_count, out.queue_tick[out.queue_head], tick):
        sample = gnss_delivered(model, out, sample, fault)
        out = gnss_drop_oldest(out)
    if fault.mode == FAULT_OFF:
        sample = gnss_lost(sample)
    return out, sample
