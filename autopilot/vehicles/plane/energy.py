"""Airspeed and height together: throttle by the rate of all energy, pitch by how it is shared, 50 Hz.

A. A. Lambregts, "Vertical flight path and speed control autopilot design using total energy principles", AIAA
83-2239, with the parameters of PX4's TECS (FW_T_*). Energies are per mass [m²/s²].
"""

import warp as wp

from autopilot.control.pid import low_pass_fraction
from autopilot.vehicles.plane.motion import Measured
from autopilot.vehicles.plane.params import PlaneParams
from common.geodesy import GRAVITY_M_S2

wp.set_module_options({"enable_backward": False})

_GRAVITY = wp.constant(GRAVITY_M_S2)
_ACCEL_CUTOFF_HZ = wp.constant(0.5)
_OBSERVER_RAD_S = wp.constant(0.7)  # guess: gusts pass, turns do not
_ENERGY_CUTOFF_HZ = wp.constant(0.5)
_PITCH_I_MOST = wp.constant(0.35)  # [rad] guess
_SLOWEST_M_S = wp.constant(3.0)
_SLOW_PART = wp.constant(0.1)  # below the least airspeed, by which the airspeed alone counts


@wp.struct
class EnergyState:
    is_started: int
    climb_sp: float  # [m/s] slewed
    speed: float  # [m/s] airspeed, filtered
    accel: float  # [m/s²] its change
    accel_bias: float  # [m/s²] by which it differs from that along the nose
    energy_rate: float  # [m²/s³] of all energy, filtered
    throttle_i: float
    pitch_i: float  # [rad]
    throttle: float
    pitch: float  # [rad]


@wp.struct
class EnergyGoal:
    height: float  # [m] NaN: by climb rate alone
    climb: float  # [m/s] besides what the height error asks for
    airspeed: float  # [m/s]
    throttle: float  # NaN: by energy
    bank: float  # [rad] asked for
    pitch_min: float  # [rad]
    pitch_max: float


@wp.func
def climb_to(params: PlaneParams, here: Measured, goal: EnergyGoal) -> float:
    """[m/s] The climb rate asked for."""
    if not wp.isfinite(goal.height):
        return wp.clamp(goal.climb, -params.sink_max, params.climb_max)
    by_error = wp.clamp((goal.height - here.height) / params.height_time, -params.sink_rate, params.climb_rate)
    return wp.clamp(by_error + goal.climb, -params.sink_max, params.climb_max)


@wp.func
def slowness(params: PlaneParams, here: Measured) -> float:
    """[0..1] How far below the least airspeed it flies."""
    if here.has_airspeed == 0:
        return 0.0
    short = params.airspeed_min - here.airspeed
    return wp.clamp(short / (_SLOW_PART * params.airspeed_min), 0.0, 1.0)


@wp.func
def level_pitch(params: PlaneParams, goal: EnergyGoal, speed: float) -> float:
    """[rad] Of level flight: lift is that of the trim times load factor, over the square of the airspeed.

    Below the least airspeed the nose is not raised any more for that, but in a flare.
    """
    slowest = wp.where(wp.isfinite(goal.throttle), params.airspeed_stall, params.airspeed_min)
    ratio = params.airspeed_trim / wp.clamp(speed, slowest, params.airspeed_max)
    load = 1.0 / wp.max(wp.cos(goal.bank), 0.5)
    return params.pitch_offset + params.pitch_lift * (load * ratio * ratio - 1.0)


@wp.func
def observe_speed(state: EnergyState, here: Measured, dt: float) -> EnergyState:
    """Airspeed and its change, by the accelerometer along the nose and the pitot tube: a second-order observer.

    In a turn some of the lift is along the nose; the observer takes that off.
    """
    now = state
    error = here.airspeed - state.speed
    now.accel_bias += _OBSERVER_RAD_S * _OBSERVER_RAD_S * error * dt
    change = here.accel + now.accel_bias + 2.0 * _OBSERVER_RAD_S * error
    now.speed += change * dt
    now.accel += low_pass_fraction(_ACCEL_CUTOFF_HZ, dt) * (here.accel + now.accel_bias - now.accel)
    return now


@wp.func
def energy_step(params: PlaneParams, state: EnergyState, here: Measured, goal: EnergyGoal, dt: float) -> EnergyState:
    """The state with throttle and pitch a frame later."""
    now = state
    if state.is_started == 0:
        now = EnergyState()
        now.is_started = 1
        now.climb_sp = here.climb
        now.pitch = here.pitch
        path = here.climb / wp.max(here.airspeed, _SLOWEST_M_S)
        level = level_pitch(params, goal, here.airspeed)
        now.pitch_i = wp.clamp(here.pitch - level - path, -_PITCH_I_MOST, _PITCH_I_MOST)
        now.speed = here.airspeed
    now = observe_speed(now, here, dt)
    speed = wp.max(now.speed, _SLOWEST_M_S)
    step = params.vertical_accel * dt
    now.climb_sp += wp.clamp(climb_to(params, here, goal) - now.climb_sp, -step, step)
    most, least = params.climb_max * _GRAVITY, -params.sink_min * _GRAVITY
    rise_sp = _GRAVITY * now.climb_sp
    accel_sp = float(0.0)
    if here.has_airspeed == 1:
        accel_sp = wp.clamp((goal.airspeed - speed) / params.airspeed_time, 0.5 * least / speed, 0.5 * most / speed)
    rate = _GRAVITY * here.climb + speed * now.accel
    now.energy_rate += low_pass_fraction(_ENERGY_CUTOFF_HZ, dt) * (rate - now.energy_rate)
    slow = slowness(params, here)
    now = throttle_step(params, now, goal, rise_sp + speed * accel_sp, slow, dt)
    # How much of both a difference of pitch has to serve.
    weight = wp.clamp(params.speed_weight + slow * (2.0 - params.speed_weight), 0.0, 2.0)
    if here.has_airspeed == 0 or wp.isfinite(goal.throttle):
        weight = 0.0
    on_height, on_speed = wp.min(2.0 - weight, 1.0), wp.min(weight, 1.0)
    balance_sp = on_height * rise_sp - on_speed * speed * accel_sp
    balance = on_height * _GRAVITY * here.climb - on_speed * speed * now.accel
    error = (balance_sp - balance) / (speed * _GRAVITY)  # [rad] of a flight path
    asked = (
        level_pitch(params, goal, speed) + balance_sp / (speed * _GRAVITY) + params.pitch_damping * error + now.pitch_i
    )
    pitch = wp.clamp(asked, goal.pitch_min, goal.pitch_max)
    if (asked - pitch) * error <= 0.0:
        grown = now.pitch_i + params.pitch_integral * error * dt
        now.pitch_i = wp.clamp(grown, -_PITCH_I_MOST, _PITCH_I_MOST)
    now.pitch = pitch
    return now


@wp.func
def throttle_step(
    params: PlaneParams, state: EnergyState, goal: EnergyGoal, rate_sp: float, slow: float, dt: float
) -> EnergyState:
    """Throttle for a rate of all energy [m²/s³]."""
    now = state
    if wp.isfinite(goal.throttle):
        now.throttle = wp.clamp(goal.throttle, 0.0, params.throttle_max)
        return now
    cosine = wp.max(wp.cos(goal.bank), 0.3)
    most, least = params.climb_max * _GRAVITY, -params.sink_min * _GRAVITY
    asked = wp.clamp(rate_sp + params.roll_throttle * (1.0 / (cosine * cosine) - 1.0), least, most)
    base = params.throttle_trim
    if asked > 0.0:
        base += (params.throttle_max - params.throttle_trim) * asked / most
    else:
        base -= (params.throttle_trim - params.throttle_min) * asked / least
    per_energy = 1.0 / (most - least)
    error = (asked - state.energy_rate) * per_energy
    wanted = base + params.throttle_damping * error + now.throttle_i
    wanted = wanted + slow * (params.throttle_max - wanted)
    throttle = wp.clamp(wanted, params.throttle_min, params.throttle_max)
    if (wanted - throttle) * error <= 0.0:
        now.throttle_i = wp.clamp(now.throttle_i + params.throttle_integral * error * dt, -0.5, 0.5)
    if params.throttle_slew > 0.0:
        step = params.throttle_slew * dt
        throttle = wp.clamp(throttle, state.throttle - step, state.throttle + step)
    now.throttle = throttle
    return now
