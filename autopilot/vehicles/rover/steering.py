"""From a yaw rate to the angle of the front wheels, or to the difference of the sides: feed-forward and PI."""

import warp as wp

from autopilot.vehicles.rover.control_airframe import RoverControlAirframe
from autopilot.vehicles.rover.params import RoverParams

wp.set_module_options({"enable_backward": False})

_LEAST_M_S = wp.constant(0.5)  # speed below which the steering is as at this one


@wp.struct
class SteeringState:
    yaw_rate_sp: float  # [rad/s] as it is followed
    integral: float  # [rad/s]
    steering: float  # [-1..1] to the right; of a skid-steer rover the difference of its sides


@wp.func
def allowed_yaw_rate(params: RoverParams, airframe: RoverControlAirframe, asked: float, speed: float) -> float:
    """The yaw rate [rad/s] that limits, tyres and geometry allow at a speed."""
    size = wp.max(wp.abs(speed), _LEAST_M_S)
    most = wp.min(params.yaw_rate_limit, params.lateral_accel / size)
    if airframe.is_skid == 0:
        most = wp.min(most, size * wp.tan(params.steering_max) / wp.max(params.wheel_base, 0.01))
    return wp.clamp(asked, -most, most)


@wp.func
def slewed(params: RoverParams, state: SteeringState, target: float, dt_s: float) -> float:
    """The steering one tick later, no faster than the servo."""
    if params.steering_rate <= 0.0 or params.steering_max <= 0.0:
        return target
    most = params.steering_rate * dt_s / params.steering_max
    return state.steering + wp.clamp(target - state.steering, -most, most)


@wp.func
def follow_yaw_rate(
    params: RoverParams,
    airframe: RoverControlAirframe,
    state: SteeringState,
    asked: float,
    yaw_rate: float,
    speed: float,
    speed_sp: float,
    dt_s: float,
) -> SteeringState:
    """The steering one tick later.

    Args:
        params: limits and gains.
        airframe: which kind of steering.
        state: one tick before.
        asked: [rad/s] yaw rate, to the right.
        yaw_rate: [rad/s] estimated.
        speed: [m/s] along the nose, estimated.
        speed_sp: [m/s] asked for; its sign says which way the vehicle is about to go where it stands.
        dt_s: [s] since then.
    """
    now = state
    change = params.yaw_accel_limit * dt_s
    allowed = allowed_yaw_rate(params, airframe, asked, wp.max(wp.abs(speed), wp.abs(speed_sp)))
    now.yaw_rate_sp = state.yaw_rate_sp + wp.clamp(allowed - state.yaw_rate_sp, -change, change)
    error = now.yaw_rate_sp - yaw_rate
    is_turning = airframe.is_skid == 1 or wp.abs(speed) > 0.5 * _LEAST_M_S
    if is_turning:
        most = 0.5 * wp.max(wp.abs(now.yaw_rate_sp), 0.5)
        now.integral = wp.clamp(state.integral + params.yaw_rate_i * error * dt_s, -most, most)
    else:
        now.integral = 0.0
        error = 0.0
    wanted = params.yaw_rate_correction * now.yaw_rate_sp + params.yaw_rate_p * error + now.integral
    if airframe.is_skid == 1:
        now.steering = wp.clamp(0.5 * params.wheel_track * wanted / wp.max(params.throttle_speed, 0.1), -1.0, 1.0)
        return now
    way = wp.where(wp.abs(speed) > params.stop_speed, speed, speed_sp)
    size = wp.max(wp.abs(speed), _LEAST_M_S)
    angle = wp.atan(wanted * params.wheel_base / size) * wp.where(way < 0.0, -1.0, 1.0)
    target = wp.clamp(angle / wp.max(params.steering_max, 0.01), -1.0, 1.0)
    now.steering = slewed(params, state, target, dt_s)
    return now
