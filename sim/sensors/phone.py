"""The owner's phone: their position and velocity twice a second, as FOLLOW_TARGET brings it to the vehicle.

In: the true owner. Out: the newest report, late by the way through phone, application and radio. Errors per axis: a
first-order Gauss-Markov error (ionosphere, multipath), white noise, and a height that is worse; now and then no report
comes for some seconds. Step every PERSON_TICKS ticks, with the person of that tick.
"""

from typing import Any

import warp as wp

from common.kernels import TICK_S, TICK_US
from common.rng import normal3, uniform
from sim.rng_streams import (
    PHONE_CORRELATED,
    PHONE_CORRELATED_START,
    PHONE_DROPOUT,
    PHONE_POSITION,
    PHONE_VELOCITY,
)
from sim.world.people import Person, chest_ned

wp.set_module_options({"enable_backward": False})

WAITING = wp.constant(4)  # reports that can be on their way at once: rows of the matrices below

PERIOD_S = 0.5  # FOLLOW_TARGET of ground stations and applications: 1 to 2 Hz
LAG_S = 0.3  # guess: a solution of the phone is that old when it reaches the vehicle
# Guess, for a phone of two frequencies in the open: between 0.45 m, standing still with L5 (doi 10.1515/jag-2023-0039),
# and the 4.9 m of one frequency (van Diggelen and Enge 2015, cited by gps.gov).
CORRELATED_STD_M = 1.5  # horizontal axis
POSITION_STD_M = 0.3  # horizontal axis, white
CORRELATION_TIME_S = 60.0  # guess, as the vehicle's receiver
VERTICAL_FACTOR = 2.0  # vertical errors over horizontal ones; guess
VELOCITY_STD_M_S = 0.2  # each axis, white; guess
DROPOUTS_PER_S = 1.0 / 60.0  # guess
DROPOUT_MIN_S, DROPOUT_MAX_S = 2.0, 6.0  # guess


@wp.struct
class PhoneModel:
    """How good a phone is."""

    period_ticks: int
    lag_ticks: int  # from validity to arrival, less than WAITING periods
    pos_std_ned: wp.vec3  # [m] white
    correlated_std_ned: wp.vec3  # [m]
    correlation_ticks: float  # time constant
    vel_std: float  # [m/s] white, each axis
    dropouts_per_tick: float
    dropout_min_ticks: float
    dropout_max_ticks: float


@wp.struct
class OwnerFix:
    """What the phone says of its owner's chest."""

    time_us: wp.int64  # of validity
    pos_ned: wp.vec3  # [m]
    vel_ned: wp.vec3  # [m/s]
    is_new: int  # it came with this step
    is_known: int  # one has ever come


@wp.struct
class PhoneState:
    """The phone's errors, the reports on their way, and the newest one that came."""

    first_tick: int  # of the first sample: phones are not in step with each other
    correlated_ned: wp.vec3  # [m] Gauss-Markov error
    last_tick: int  # of the last sample
    silent_until_tick: int  # end of the dropout
    head: int  # slot of the oldest report on its way
    count: int
    sent_tick: wp.vec4i  # tick of validity
    sent_pos_ned: wp.mat44  # [m] a row per report: north, east, down, nothing
    sent_vel_ned: wp.mat44  # [m/s]
    fix: OwnerFix


def phone_model(error_scale: float = 1.0, lag_s: float = LAG_S) -> Any:
    """The default phone, its errors multiplied by `error_scale`, its reports `lag_s` late."""
    model = PhoneModel()
    model.period_ticks = round(PERIOD_S / TICK_S)
    model.lag_ticks = round(lag_s / TICK_S)
    model.pos_std_ned = wp.vec3(1.0, 1.0, VERTICAL_FACTOR) * (error_scale * POSITION_STD_M)
    model.correlated_std_ned = wp.vec3(1.0, 1.0, VERTICAL_FACTOR) * (error_scale * CORRELATED_STD_M)
    model.correlation_ticks = CORRELATION_TIME_S / TICK_S
    model.vel_std = error_scale * VELOCITY_STD_M_S
    model.dropouts_per_tick = DROPOUTS_PER_S * TICK_S
    model.dropout_min_ticks = DROPOUT_MIN_S / TICK_S
    model.dropout_max_ticks = DROPOUT_MAX_S / TICK_S
    return model


@wp.func
def phone_start(model: PhoneModel, seed: int, i: int, tick: int) -> PhoneState:
    """A phone that has had a fix for long; the first report comes within a period and the lag."""
    state = PhoneState()
    state.first_tick = tick + int(uniform(seed, i, tick, PHONE_DROPOUT) * float(model.period_ticks))
    state.last_tick = tick
    state.silent_until_tick = tick
    state.correlated_ned = wp.cw_mul(model.correlated_std_ned, normal3(seed, i, tick, PHONE_CORRELATED_START))
    return state


@wp.func
def phone_step(model: PhoneModel, state: PhoneState, person: Person, seed: int, i: int, tick: int) -> PhoneState:
    """The phone at a tick: takes a sample when one is due, delivers one that has arrived; `fix` is what is known.

    Args:
        model: how good it is.
        state: before, at an earlier tick.
        person: its owner now.
        seed: of the random draws.
        i: row of the batch.
        tick: now; samples are taken at the first step at or after they are due.
    """
    out = state
    out.fix.is_new = 0
    is_due = (tick - state.first_tick) / model.period_ticks > (state.last_tick - state.first_tick) / model.period_ticks
    if tick >= state.first_tick and (is_due or state.last_tick < state.first_tick):
        out = phone_sample(model, out, person, seed, i, tick)
    if out.count > 0 and tick - out.sent_tick[out.head] >= model.lag_ticks:
        pos = out.sent_pos_ned[out.head]
        vel = out.sent_vel_ned[out.head]
        out.fix.time_us = wp.int64(out.sent_tick[out.head]) * wp.int64(TICK_US)
        out.fix.pos_ned = wp.vec3(pos[0], pos[1], pos[2])
        out.fix.vel_ned = wp.vec3(vel[0], vel[1], vel[2])
        out.fix.is_new = 1
        out.fix.is_known = 1
        out.head = (out.head + 1) % WAITING
        out.count = out.count - 1
    return out


@wp.func
def phone_sample(model: PhoneModel, state: PhoneState, person: Person, seed: int, i: int, tick: int) -> PhoneState:
    """The phone after it sent where it thinks its owner is, unless it is silent."""
    out = state
    elapsed = float(tick - state.last_tick)
    out.last_tick = tick
    keep = wp.exp(-elapsed / model.correlation_ticks)
    kick = wp.sqrt(1.0 - keep * keep)
    out.correlated_ned = keep * state.correlated_ned + kick * wp.cw_mul(
        model.correlated_std_ned, normal3(seed, i, tick, PHONE_CORRELATED)
    )
    draw = uniform(seed, i, tick, PHONE_DROPOUT)
    chance = wp.min(model.dropouts_per_tick * elapsed, 1.0)
    if tick >= state.silent_until_tick and draw < chance:
        # the draw that decided is uniform in [0, chance): it also says for how long
        span = model.dropout_max_ticks - model.dropout_min_ticks
        out.silent_until_tick = tick + int(model.dropout_min_ticks + span * draw / chance)
    if tick >= out.silent_until_tick and state.count < WAITING:
        slot = (state.head + state.count) % WAITING
        ticks = state.sent_tick
        positions = state.sent_pos_ned
        velocities = state.sent_vel_ned
        pos = (
            chest_ned(person)
            + out.correlated_ned
            + wp.cw_mul(model.pos_std_ned, normal3(seed, i, tick, PHONE_POSITION))
        )
        vel = person.vel_ned + model.vel_std * normal3(seed, i, tick, PHONE_VELOCITY)
        ticks[slot] = tick
        positions[slot] = wp.vec4(pos[0], pos[1], pos[2], 0.0)
        velocities[slot] = wp.vec4(vel[0], vel[1], vel[2], 0.0)
        out.sent_tick = ticks
        out.sent_pos_ned = positions
        out.sent_vel_ned = velocities
        out.count = state.count + 1
    return out
