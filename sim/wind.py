"""Wind at a vehicle: steady wind, discrete gusts, Dryden turbulence; once a tick.

In: the vehicle's height over ground and its velocity. Out: `WindState.wind_ned`, the velocity of the air there.
Turbulence is frozen air flown through at the true airspeed, as MIL-F-8785C has it. Left out: growth of the
mean with height, gradients over the vehicle, shelter by terrain and trees, thermals.
"""

import math

import warp as wp

from common.kernels import TICK_S
from common.rng import draw_key, normal3

wp.set_module_options({"enable_backward": False})

_FEET_PER_M = wp.constant(1.0 / 0.3048)
_LOWEST_FT = wp.constant(10.0)  # MIL-F-8785C, 3.7.3.1: the low-altitude model covers 10 to 1,000 ft
_HIGHEST_FT = wp.constant(1000.0)
_SLOWEST_M_S = wp.constant(0.5)  # guess: turbulence changes at least as if flown through at this speed
_COARSEST_STEP = wp.constant(0.1)  # largest step over time constant; reached at 75 m/s near the ground
_GUST_WINDOW_S = 12.0  # guess: one gust in each such window
_GUST_WINDOW_TICKS = wp.constant(round(_GUST_WINDOW_S / TICK_S))
_GUST_SHORTEST_S = wp.constant(3.0)  # guess
_GUST_LONGEST_S = wp.constant(8.0)  # guess
_TICK_S = wp.constant(TICK_S)

_STREAM_TURBULENCE = wp.constant(101)
_STREAM_TURBULENCE_START = wp.constant(102)
_STREAM_GUST = wp.constant(104)


@wp.struct
class WindModel:
    """What the air does, the same over the whole world."""

    mean_ned: wp.vec3  # [m/s] at all heights
    along_ned: wp.vec3  # unit vector the wind blows towards
    gust_m_s: float  # largest gust on top of the mean
    turbulence_w_std: float  # [m/s] standard deviation of the vertical component: 0.1 W20 in MIL-F-8785C


@wp.struct
class WindState:
    """The air at one vehicle."""

    wind_ned: wp.vec3  # [m/s] velocity of the air over ground: mean, gust and turbulence
    gust_m_s: float
    gust_window: int  # one more than the number of the window whose gust is drawn; 0: none
    gust_start_s: float  # within the window
    gust_length_s: float
    gust_peak_m_s: float
    turbulence_wind: wp.vec3  # [m/s] along the mean wind, across it to the right, down
    first: wp.vec3  # first filter stage, unit variance
    second: wp.vec3  # second filter stage of the across and down components, variance 1/2
    is_started: int


@wp.func
def turbulence_scales(height_agl_m: float) -> wp.vec2:
    """Horizontal over vertical intensity, and horizontal over vertical scale length, low altitude.

    MIL-F-8785C, 3.7.3.1, with h in ft: sigma_u / sigma_w = (0.177 + 0.000823 h)^-0.4, L_u / L_w the same to the
    power 3; sigma_v = sigma_u, L_v = L_u, L_w = h.
    """
    height_ft = wp.clamp(height_agl_m * _FEET_PER_M, _LOWEST_FT, _HIGHEST_FT)
    ratio = wp.pow(0.177 + 0.000823 * height_ft, -0.4)
    return wp.vec2(ratio, ratio * ratio * ratio)


@wp.func
def turbulence_height_m(height_agl_m: float) -> float:
    """L_w: the height over ground within the model's range [m]."""
    return wp.clamp(height_agl_m * _FEET_PER_M, _LOWEST_FT, _HIGHEST_FT) / _FEET_PER_M


@wp.func
def first_stage(x: float, step: float, noise: float) -> float:
    """Exact step of 1 / (1 + T s) on white noise, kept at unit variance. step = dt / T; noise of unit variance."""
    decay = wp.exp(-step)
    return decay * x + wp.sqrt(1.0 - decay * decay) * noise


@wp.func
def second_stage(x: float, y: float, step: float, noise: float) -> float:
    """Exact step of 1 / (1 + T s) on the output x (before the step) of `first_stage`, driven by the same noise.

    The part of its noise independent of the first stage's has variance step³ / 6: below a thousandth, left out.
    The shared part is ∫ exp(-2 s) s ds = step² (1 - 4/3 step) over the first stage's deviation sqrt(2 step (1 - step)).
    """
    shared = step * wp.sqrt(0.5 * step) * (1.0 - 0.8333333 * step)
    return wp.exp(-step) * (y + step * x) + shared * noise


@wp.func
def dryden_output(std: float, first: float, second: float) -> float:
    """Output of (1 + sqrt(3) T s) / (1 + T s)² from its two stages, with the standard deviation `std`."""
    return 0.70710678 * std * (1.7320508 * first - 0.7320508 * second)


@wp.func
def start_turbulence(state: WindState, seed: int, i_vehicle: int) -> WindState:
    """Draws the filters' states from their stationary distribution."""
    state.is_started = 1
    state.first = normal3(seed, i_vehicle, 0, _STREAM_TURBULENCE_START)
    state.second = 0.5 * state.first + 0.5 * normal3(seed, i_vehicle, 0, _STREAM_TURBULENCE_START + 1)
    return state


@wp.func
def turbulence_noise(seed: int, i_vehicle: int, tick: int) -> wp.vec3:
    """Three independent draws of unit variance, uniform: the filters sum hundreds of them, which makes them normal."""
    key = draw_key(seed, i_vehicle, tick, _STREAM_TURBULENCE)
    x = wp.randf(key)
    y = wp.randf(key)
    z = wp.randf(key)
    return 3.4641016 * wp.vec3(x - 0.5, y - 0.5, z - 0.5)


@wp.func
def turbulence_step(
    model: WindModel,
    state: WindState,
    airspeed_m_s: float,
    height_agl_m: float,
    seed: int,
    i_vehicle: int,
    tick: int,
    dt: float,
) -> WindState:
    """Advances the three Dryden filters by dt [s] of flight at an airspeed."""
    if state.is_started == 0:
        state = start_turbulence(state, seed, i_vehicle)
    scales = turbulence_scales(height_agl_m)
    length_w = turbulence_height_m(height_agl_m)
    step_w = wp.min(wp.max(airspeed_m_s, _SLOWEST_M_S) * dt / length_w, _COARSEST_STEP)
    step_uv = step_w / scales[1]
    noise = turbulence_noise(seed, i_vehicle, tick)
    second_v = second_stage(state.first[1], state.second[1], step_uv, noise[1])
    second_w = second_stage(state.first[2], state.second[2], step_w, noise[2])
    state.second = wp.vec3(0.0, second_v, second_w)
    state.first = wp.vec3(
        first_stage(state.first[0], step_uv, noise[0]),
        first_stage(state.first[1], step_uv, noise[1]),
        first_stage(state.first[2], step_w, noise[2]),
    )
    std_w = model.turbulence_w_std
    std_uv = std_w * scales[0]
    state.turbulence_wind = wp.vec3(
        std_uv * state.first[0],
        dryden_output(std_uv, state.first[1], state.second[1]),
        dryden_output(std_w, state.first[2], state.second[2]),
    )
    return state


@wp.func
def draw_gust(model: WindModel, state: WindState, window: int, seed: int, i_vehicle: int) -> WindState:
    """Draws start, length and peak of the gust in a window of time."""
    key = draw_key(seed, i_vehicle, window, _STREAM_GUST)
    length_draw = wp.randf(key)
    start_draw = wp.randf(key)
    peak_draw = wp.randf(key)
    state.gust_window = window + 1
    state.gust_length_s = _GUST_SHORTEST_S + (_GUST_LONGEST_S - _GUST_SHORTEST_S) * length_draw
    state.gust_start_s = (float(_GUST_WINDOW_TICKS) * _TICK_S - state.gust_length_s) * start_draw
    state.gust_peak_m_s = model.gust_m_s * (0.5 + 0.5 * peak_draw)
    return state


@wp.func
def gust_step(model: WindModel, state: WindState, seed: int, i_vehicle: int, tick: int) -> WindState:
    """Gust at a tick: peak / 2 (1 - cos(2 pi t / length)), the shape of MIL-F-8785C 3.7.2.3 risen and fallen again."""
    window = tick / _GUST_WINDOW_TICKS
    if state.gust_window != window + 1:
        state = draw_gust(model, state, window, seed, i_vehicle)
    time_s = float(tick - window * _GUST_WINDOW_TICKS) * _TICK_S - state.gust_start_s
    state.gust_m_s = 0.0
    if time_s > 0.0 and time_s < state.gust_length_s:
        state.gust_m_s = 0.5 * state.gust_peak_m_s * (1.0 - wp.cos(2.0 * wp.pi * time_s / state.gust_length_s))
    return state


@wp.func
def wind_step(
    model: WindModel,
    state: WindState,
    vel_ned: wp.vec3,
    height_agl_m: float,
    seed: int,
    i_vehicle: int,
    tick: int,
    dt: float,
) -> WindState:
    """The air at a vehicle after one more tick of dt [s]."""
    mean_ned = model.mean_ned
    if model.gust_m_s > 0.0:
        state = gust_step(model, state, seed, i_vehicle, tick)
        mean_ned = mean_ned + state.gust_m_s * model.along_ned
    wind_ned = mean_ned
    if model.turbulence_w_std > 0.0:
        airspeed_m_s = wp.length(vel_ned - mean_ned)
        state = turbulence_step(model, state, airspeed_m_s, height_agl_m, seed, i_vehicle, tick, dt)
        north = model.along_ned[0]
        east = model.along_ned[1]
        u = state.turbulence_wind[0]
        v = state.turbulence_wind[1]
        wind_ned = mean_ned + wp.vec3(north * u - east * v, east * u + north * v, state.turbulence_wind[2])
    state.wind_ned = wind_ned
    return state


def wind_model(
    speed_m_s: float,
    direction_deg: float = 0.0,
    turbulence: float = 0.0,
    gust_m_s: float = 0.0,
) -> WindModel:
    """Wind for a flight.

    Args:
        speed_m_s: [m/s] mean at all heights; MIL-F-8785C's W20, the wind 20 ft over ground
        direction_deg: where it blows from, clockwise from north
        turbulence: intensity: vertical standard deviation over a tenth of the mean speed; 1 is MIL-F-8785C's
        gust_m_s: [m/s] largest gust on top of the mean; each is drawn between half of it and it
    """
    towards_rad = math.radians(direction_deg + 180.0)
    model = WindModel()
    model.along_ned = wp.vec3(math.cos(towards_rad), math.sin(towards_rad), 0.0)
    model.mean_ned = model.along_ned * speed_m_s
    model.gust_m_s = gust_m_s
    model.turbulence_w_std = 0.1 * speed_m_s * turbulence
    return model
