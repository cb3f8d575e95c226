"""From a course to a yaw rate, and to a speed at which the course can be taken, 50 Hz."""

import warp as wp

from autopilot.vehicles.rover.control_airframe import RoverControlAirframe
from autopilot.vehicles.rover.motion import Asked, Measured
from autopilot.vehicles.rover.params import RoverParams
from common.rotation import wrap_pi

wp.set_module_options({"enable_backward": False})

_CRAWL_M_S = wp.constant(0.6)  # to which a car slows for its course, at least
_ALIGNED = wp.constant(0.005)  # [rad] course error at which a turn on the spot ends, where that is all
_ASTRAY = wp.constant(0.0175)  # [rad] at which it begins again: 1 deg
_TURN_M_S = wp.constant(0.3)  # speed below which a turn on the spot begins


@wp.func
def turning_rate(params: RoverParams, error: float) -> float:
    """The yaw rate [rad/s] for a course error [rad], which can be ended in time with the deceleration allowed."""
    rate = params.yaw_p * wp.abs(error)
    if params.yaw_decel_limit > 0.0:
        rate = wp.min(rate, wp.sqrt(2.0 * 0.7 * params.yaw_decel_limit * wp.abs(error)))
    return wp.sign(error) * rate


@wp.func
def is_turn_on_spot(params: RoverParams, was_turning: int, error: float, speed: float) -> int:
    """Whether a skid-steer rover turns on the spot for a course error [rad], asked to drive at a speed [m/s]."""
    begin = params.turn_from
    end = params.turn_until
    if speed == 0.0:
        begin = _ASTRAY
        end = _ALIGNED
    if was_turning == 1:
        return wp.where(wp.abs(error) > end, 1, 0)
    return wp.where(wp.abs(error) > begin, 1, 0)


@wp.func
def take_course(
    params: RoverParams, airframe: RoverControlAirframe, asked: Asked, here: Measured, was_turning: int
) -> tuple[Asked, int]:
    """Yaw rate and speed for the course asked for, and whether the vehicle turns on the spot for it."""
    now = asked
    error = wrap_pi(asked.course - here.yaw)
    now.yaw_rate = asked.yaw_rate + turning_rate(params, error) + asked.course_rate
    if airframe.is_skid == 1:
        is_turning = is_turn_on_spot(params, was_turning, error, asked.speed)
        if is_turning == 1:
            now.speed = 0.0
            now.yaw_rate = turning_rate(params, error) * wp.where(wp.abs(here.speed) < _TURN_M_S, 1.0, 0.3)
        elif asked.speed == 0.0:
            now.is_stop = 1
        return now, is_turning
    if asked.speed == 0.0:
        now.is_stop = 1
    if params.speed_reduction > 0.0:
        slowed = params.throttle_speed * (1.0 - params.speed_reduction * wp.abs(error) / wp.pi)
        most = wp.max(slowed, _CRAWL_M_S)
        now.speed = wp.clamp(asked.speed, -most, most)
    return now, 0
