"""From a yaw rate to the angle of the front wheels, or to the difference of the sides: feed-forward and PI, 50 Hz.

Both go through the inverse of the vehicle's geometry, atan(yaw rate * wheel base / speed), so that the gains hold at
any speed. The sign of the speed turns the front wheels the other way backwards.
"""

import warp as wp

from autopilot.vehicles.rover.control_airframe import RoverControlAirframe
from autopilot.vehicles.rover.motion import Measured
from autopilot.vehicles.rover.params import RoverParams

wp.set_module_options({"enable_backward": False})

_LEAST_M_S = wp.constant(0.5)  # speed below which the front wheels are steered as at this one
_ROLLING_M_S = wp.constant(0.2)  # speed from which the yaw rate says something of the front wheels
_LEAST_ANGLE = wp.constant(0.01)  # [rad] bounds a division
_TRIM = wp.constant(0.3)  # greatest part of what the steering can do that the integral may ask for


@wp.struct
class SteeringState:
    yaw_rate_sp: float  # [rad/s] as it is followed
    integral: float  # of front wheels [1/m], the curvature of the way; of sides [rad/s]
    steering: float  # [-1..1] to the right; of a skid-steer rover the difference of its sides


@wp.func
def tightest(params: RoverParams) -> float:
    """The greatest curvature [1/m] that the front wheels can steer."""
    return wp.tan(params.steering_max) / wp.max(params.wheel_base, _LEAST_ANGLE)


@wp.func
def allowed_yaw_rate(params: RoverParams, airframe: RoverControlAirframe, asked: float, speed: float) -> float:
    """The yaw rate [rad/s] that limits, tyres and geometry allow at a speed."""
    size = wp.max(wp.abs(speed), _LEAST_M_S)
    most = wp.min(params.yaw_rate_limit, params.lateral_accel / size)
    if airframe.is_skid == 0:
        most = wp.min(most, size * tightest(params))
    return wp.clamp(asked, -most, most)


@wp.func
def slewed(params: RoverParams, state: SteeringState, target: float, dt_s: float) -> float:
    """The steering one step later, no faster than the servo."""
    if params.steering_rate <= 0.0 or params.steering_max <= 0.0:
        return target
    most = params.steering_rate * dt_s / params.steering_max
    return state.steering + wp.clamp(target - state.steering, -most, most)


@wp.func
def followed_rate(params: RoverParams, before: float, allowed: float, dt_s: float) -> float:
    """The yaw rate setpoint one step later, within the limits of its change; a limit of 0 or less is none."""
    limit = params.yaw_accel_limit
    if before * (allowed - before) < 0.0:
        limit = params.yaw_decel_limit
    if limit <= 0.0:
        return allowed
    return before + wp.clamp(allowed - before, -limit * dt_s, limit * dt_s)


@wp.func
def steer_sides(params: RoverParams, state: SteeringState, yaw_rate: float, dt_s: float) -> SteeringState:
    """The difference of the sides [-1..1] one step later; `yaw_rate` is measured [rad/s]."""
    now = state
    per_rate = 0.5 * params.wheel_track / wp.max(params.throttle_speed, _LEAST_ANGLE)
    error = state.yaw_rate_sp - yaw_rate
    asked = params.yaw_rate_correction * state.yaw_rate_sp + params.yaw_rate_p * error
    grown = state.integral + params.yaw_rate_i * error * dt_s
    if wp.abs((asked + grown) * per_rate) < 1.0 or (asked + grown) * error < 0.0:
        most = _TRIM / wp.max(per_rate, _LEAST_ANGLE)
        now.integral = wp.clamp(grown, -most, most)
    now.steering = wp.clamp((asked + now.integral) * per_rate, -1.0, 1.0)
    return now


@wp.func
def steer_wheels(
    params: RoverParams, state: SteeringState, here: Measured, speed_sp: float, dt_s: float
) -> SteeringState:
    """The steering [-1..1] of the front wheels one step later.

    Args:
        params: gains and geometry.
        state: one step before, with the yaw rate asked for.
        here: how the vehicle moves.
        speed_sp: [m/s] asked for; its sign says which way the vehicle is about to go where it stands.
        dt_s: [s] since then.
    """
    now = state
    way = wp.where(wp.abs(here.speed) > _ROLLING_M_S, here.speed, speed_sp)
    speed = wp.where(way < 0.0, -1.0, 1.0) * wp.max(wp.abs(here.speed), _LEAST_M_S)
    most = tightest(params)
    error = float(0.0)
    if wp.abs(here.speed) > _ROLLING_M_S:
        error = (state.yaw_rate_sp - here.yaw_rate) / speed
    asked = params.yaw_rate_correction * state.yaw_rate_sp / speed + params.yaw_rate_p * error
    grown = state.integral + params.yaw_rate_i * error * dt_s
    if wp.abs(asked + grown) < most or (asked + grown) * error < 0.0:
        now.integral = wp.clamp(grown, -_TRIM * most, _TRIM * most)
    angle = wp.atan((asked + now.integral) * params.wheel_base)
    now.steering = slewed(params, state, wp.clamp(angle / wp.max(params.steering_max, _LEAST_ANGLE), -1.0, 1.0), dt_s)
    return now


@wp.func
def follow_yaw_rate(
    params: RoverParams,
    airframe: RoverControlAirframe,
    state: SteeringState,
    here: Measured,
    asked: float,
    speed_sp: float,
    dt_s: float,
) -> SteeringState:
    """The steering one step later, for a yaw rate [rad/s] asked for and a speed [m/s] that is asked for, too."""
    now = state
    allowed = allowed_yaw_rate(params, airframe, asked, wp.max(wp.abs(here.speed), wp.abs(speed_sp)))
    now.yaw_rate_sp = followed_rate(params, state.yaw_rate_sp, allowed, dt_s)
    if airframe.is_skid == 1:
        return steer_sides(params, now, here.yaw_rate, dt_s)
    return steer_wheels(params, now, here, speed_sp, dt_s)
