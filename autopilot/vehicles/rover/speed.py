"""From a speed to throttle and brake: a setpoint with limited acceleration and jerk, feed-forward, PI, 50 Hz.

The feed-forward knows the motor's lag, the slope and what rolling costs; it is what drives. The integral meets slip,
a battery that is not as measured, and wind. What the driven tyres could not brake by the motor alone the brake does.
"""

import warp as wp

from autopilot.vehicles.rover.control_airframe import RoverControlAirframe
from autopilot.vehicles.rover.motion import Measured
from autopilot.vehicles.rover.params import RoverParams
from common.geodesy import GRAVITY_M_S2

wp.set_module_options({"enable_backward": False})

_GRAVITY = wp.constant(GRAVITY_M_S2)
_NO_LIMIT = wp.constant(100.0)
_LEAD_M_S = wp.constant(1.0)  # by which the setpoint may be ahead of a vehicle that cannot follow it
_LEAST_TOP_M_S = wp.constant(0.1)
_INTEGRAL_MAX = wp.constant(0.5)  # of the greatest speed


@wp.struct
class SpeedState:
    speed_sp: float  # [m/s] along the nose, as it is followed
    accel_sp: float  # [m/s²]
    integral: float  # [m/s]
    throttle: float  # [-1..1]
    brake: float  # [0..1]
    is_parked: int  # stands, braked


@wp.func
def limit_or_none(limit: float) -> float:
    """A limit that may be a parameter's -1, none."""
    return wp.where(limit > 0.0, limit, _NO_LIMIT)


@wp.func
def parked() -> SpeedState:
    """The motor off and the brake on."""
    state = SpeedState()
    state.brake = 1.0
    state.is_parked = 1
    return state


@wp.func
def open_throttle(params: RoverParams, throttle: float, speed: float, may_park: bool) -> SpeedState:
    """A throttle as it is; parked, if it may be, where it is zero and the vehicle stands."""
    state = SpeedState()
    state.speed_sp = speed
    state.throttle = wp.clamp(throttle, -1.0, 1.0)
    if not (wp.abs(throttle) > 0.0):  # NaN, too
        state.throttle = 0.0
        if may_park and wp.abs(speed) < params.stop_speed:
            return parked()
    return state


@wp.func
def approach(params: RoverParams, state: SpeedState, goal: float, speed: float, dt_s: float) -> SpeedState:
    """The setpoint one step nearer to its goal, within the limits of acceleration, deceleration and jerk."""
    now = state
    held = wp.clamp(state.speed_sp, speed - _LEAD_M_S, speed + _LEAD_M_S)
    missing = goal - held
    limit = limit_or_none(params.accel_limit)
    if held * missing < 0.0:
        limit = limit_or_none(params.decel_limit)
    jerk = limit_or_none(params.jerk_limit)
    # The acceleration from which it can still be brought to zero before the goal
    ending = wp.sqrt(2.0 * jerk * wp.abs(missing))
    wanted = wp.sign(missing) * wp.min(limit, ending)
    now.accel_sp = state.accel_sp + wp.clamp(wanted - state.accel_sp, -jerk * dt_s, jerk * dt_s)
    step = now.accel_sp * dt_s
    now.speed_sp = held + step
    if wp.abs(missing) <= wp.abs(step) and step * missing >= 0.0:
        now.speed_sp = goal
        now.accel_sp = 0.0
    return now


@wp.func
def follow_speed(
    params: RoverParams,
    airframe: RoverControlAirframe,
    state: SpeedState,
    here: Measured,
    goal: float,
    voltage_fraction: float,
    may_park: bool,
    dt_s: float,
) -> SpeedState:
    """Throttle and brake one step later.

    Args:
        params: limits and gains.
        airframe: motor and brake.
        state: one step before.
        here: how the vehicle moves.
        goal: [m/s] along the nose, asked for.
        voltage_fraction: of the battery, over the full one.
        may_park: brake where the vehicle stands; one that turns on the spot may not.
        dt_s: [s] since then.
    """
    bounded = wp.clamp(goal, -wp.max(params.speed_limit, 0.0), wp.max(params.speed_limit, 0.0))
    now = approach(params, state, bounded, here.speed, dt_s)
    is_slow = wp.abs(here.speed) < params.stop_speed and wp.abs(now.speed_sp) < params.stop_speed
    if may_park and bounded == 0.0 and (is_slow or state.is_parked == 1):
        return parked()
    now.is_parked = 0
    top = wp.max(params.throttle_speed, _LEAST_TOP_M_S)
    way = wp.sign(now.speed_sp)
    pushed = now.accel_sp - _GRAVITY * here.nose_ned[2]  # [m/s²] that motor and brake shall give, rolling apart
    slowing = wp.max(-way * pushed - airframe.motor_decel, 0.0)
    pushed = pushed + way * (slowing + airframe.rolling_accel)
    now.brake = wp.clamp(slowing / airframe.brake_decel, 0.0, 1.0)
    error = now.speed_sp - here.speed
    asked = now.speed_sp + airframe.motor_time_s * pushed + params.speed_p * error
    grown = state.integral + params.speed_i * error * dt_s
    reach = top * voltage_fraction
    if wp.abs(asked + grown) < reach or (asked + grown) * error < 0.0:
        now.integral = wp.clamp(grown, -_INTEGRAL_MAX * top, _INTEGRAL_MAX * top)
    now.throttle = wp.clamp((asked + now.integral) / reach, -1.0, 1.0)
    return now
