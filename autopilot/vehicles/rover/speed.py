"""From a speed to throttle and brake: a setpoint with limited acceleration and jerk, feed-forward, PI."""

import warp as wp

from autopilot.vehicles.rover.control_airframe import RoverControlAirframe
from autopilot.vehicles.rover.params import RoverParams

wp.set_module_options({"enable_backward": False})

_MOTOR_DECEL = wp.constant(2.0)  # [m/s²] that the motor brakes by itself without sliding its wheels
_VOLTAGE_FRACTION_MIN = wp.constant(0.6)


@wp.struct
class SpeedState:
    speed_sp: float  # [m/s] along the nose, as it is followed
    accel_sp: float  # [m/s²]
    integral: float  # [m/s]
    throttle: float  # [-1..1]
    brake: float  # [0..1]


@wp.func
def approach(params: RoverParams, state: SpeedState, goal: float, dt_s: float) -> SpeedState:
    """The setpoint one step nearer to its goal, within the limits of acceleration, deceleration and jerk."""
    now = state
    missing = goal - state.speed_sp
    is_slowing = state.speed_sp * missing < 0.0
    limit = params.accel_limit
    if is_slowing:
        limit = params.decel_limit
    # The acceleration from which it can still be brought to zero before the goal
    ending = wp.sqrt(2.0 * params.jerk_limit * wp.abs(missing))
    wanted = wp.sign(missing) * wp.min(wp.min(limit, ending), wp.abs(missing) / dt_s)
    change = params.jerk_limit * dt_s
    now.accel_sp = state.accel_sp + wp.clamp(wanted - state.accel_sp, -change, change)
    step = now.accel_sp * dt_s
    if wp.abs(missing) < wp.abs(step) + 1.0e-4 and step * missing >= 0.0:
        now.speed_sp = goal
        now.accel_sp = 0.0
    else:
        now.speed_sp = state.speed_sp + step
    return now


@wp.func
def follow_speed(
    params: RoverParams,
    airframe: RoverControlAirframe,
    state: SpeedState,
    goal: float,
    speed: float,
    voltage_fraction: float,
    dt_s: float,
) -> SpeedState:
    """Throttle and brake one tick later.

    Args:
        params: limits and gains.
        airframe: motor and brake.
        state: one tick before.
        goal: [m/s] asked for.
        speed: [m/s] estimated.
        voltage_fraction: of the battery, over the full one.
        dt_s: [s] since then.
    """
    now = approach(params, state, wp.clamp(goal, -params.speed_limit, params.speed_limit), dt_s)
    error = now.speed_sp - speed
    top = params.throttle_speed * wp.max(voltage_fraction, _VOLTAGE_FRACTION_MIN)
    asked = now.speed_sp + airframe.motor_time_s * now.accel_sp + params.speed_p * error
    grown = state.integral + params.speed_i * error * dt_s
    if wp.abs(asked + grown) < top or error * state.integral < 0.0:
        now.integral = wp.clamp(grown, -0.5 * top, 0.5 * top)
    now.throttle = wp.clamp((asked + now.integral) / wp.max(top, 0.1), -1.0, 1.0)
    slowing = -now.accel_sp * wp.sign(now.speed_sp)
    now.brake = wp.clamp((slowing - _MOTOR_DECEL) / airframe.brake_decel, 0.0, 1.0)
    return now


@wp.func
def stopped(
    params: RoverParams, airframe: RoverControlAirframe, state: SpeedState, speed: float, dt_s: float
) -> SpeedState:
    """The motor off: the brake slows down as hard as the limit says, and is fully on once the vehicle stands."""
    now = SpeedState()
    gentle = wp.min(params.decel_limit / airframe.brake_decel, 1.0)
    now.speed_sp = 0.0
    now.brake = 1.0
    if wp.abs(speed) > params.stop_speed:
        now.brake = wp.min(state.brake + dt_s / 0.1, gentle)
    return now
