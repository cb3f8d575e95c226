"""Where to and how fast: pure pursuit of a line, and the speed that its end, its bends and the tyres allow.

In: estimate, setpoint. Out: a signed speed and a yaw rate. A rover cannot go sideways: a place inside its turning
circle is reached by backing away from it first, and a place a little off is not corrected once the rover stands.
"""

import warp as wp

from autopilot.ports import Estimate, Setpoint
from autopilot.vehicles.rover.control_airframe import RoverControlAirframe
from autopilot.vehicles.rover.params import RoverParams
from common.rotation import wrap_pi, yaw_from_quat

wp.set_module_options({"enable_backward": False})

_ARRIVED_M = wp.constant(0.05)  # way left at which a place counts as reached
_NEAR_PER_S = wp.constant(1.6)  # speed over the way left, close to a place
_REACTION_S = wp.constant(0.15)  # way that goes by before the brake answers
_BACK_AT = wp.constant(1.15)  # of the turning circle: a place inside is not reached forward
_BACK_UNTIL = wp.constant(1.6)
_CRAWL_M_S = wp.constant(0.6)  # least speed on the way, also in a bend; greatest when backing away
_HALF_PI = wp.constant(1.5707963)


@wp.struct
class PathState:
    """What is remembered of the way to a place."""

    pos_ned: wp.vec3  # [m] the place; a change of it is a new way
    start_ned: wp.vec3  # [m] where the way began
    has_place: int
    has_arrived: int  # stands there
    direction: float  # 1 forward, -1 backwards
    is_backing: int  # goes away from a place that it could not reach otherwise
    is_turning: int  # a skid-steer rover turns on the spot


@wp.struct
class Motion:
    """What the inner loops follow."""

    speed: float  # [m/s] along the nose
    yaw_rate: float  # [rad/s]
    course: float  # [rad] of the nose
    is_stop: int  # stand still


@wp.func
def horizontal(vector_ned: wp.vec3) -> wp.vec2:
    return wp.vec2(vector_ned[0], vector_ned[1])


@wp.func
def turning_radius(params: RoverParams, airframe: RoverControlAirframe) -> float:
    """[m] the least; 0 for one that turns on the spot."""
    if airframe.is_skid == 1:
        return 0.0
    return params.wheel_base / wp.max(wp.tan(params.steering_max), 0.01)


@wp.func
def stopping_speed(params: RoverParams, way_m: float, end_speed: float) -> float:
    """[m/s] from which the speed at the end of the way can be reached."""
    decel = 0.8 * params.decel_limit
    reaction = decel * _REACTION_S
    left = wp.max(way_m, 0.0)
    braking = wp.sqrt(reaction * reaction + end_speed * end_speed + 2.0 * decel * left) - reaction
    return wp.max(wp.min(braking, end_speed + _NEAR_PER_S * left), end_speed)


@wp.func
def begin_way(params: RoverParams, state: PathState, est: Estimate, sp: Setpoint) -> PathState:
    """A new place: the line to it begins where the setpoint says, or here; by the tail if it is near and behind."""
    now = state
    was_at = state.pos_ned
    now.pos_ned = sp.pos_ned
    now.start_ned = est.pos_ned
    if wp.isfinite(sp.path_start_ned[0]):
        now.start_ned = sp.path_start_ned
    now.has_place = 1
    now.is_backing = 0
    now.is_turning = 0
    now.direction = 1.0
    if sp.cruise_speed < 0.0:
        now.direction = -1.0
    near = params.stop_speed * _REACTION_S + _ARRIVED_M
    is_same = state.has_place == 1 and wp.length(horizontal(sp.pos_ned - was_at)) < near
    if not (is_same and state.has_arrived == 1):
        now.has_arrived = 0
    return now


@wp.func
def drive_back(state: PathState, est: Estimate, offset: wp.vec2, yaw: float) -> PathState:
    """Pushed away from the place held: drives back, by the end that points there."""
    now = state
    now.has_arrived = 0
    now.start_ned = est.pos_ned
    now.is_backing = 0
    bearing = wrap_pi(wp.atan2(offset[1], offset[0]) - yaw)
    now.direction = wp.where(wp.abs(bearing) < _HALF_PI, 1.0, -1.0)
    return now


@wp.func
def is_inside_circle(offset: wp.vec2, heading: float, radius: float) -> bool:
    """Whether a place lies inside one of the two circles that touch the vehicle."""
    ahead = wp.vec2(wp.cos(heading), wp.sin(heading))
    along = wp.dot(offset, ahead)
    across = wp.abs(ahead[0] * offset[1] - ahead[1] * offset[0]) - radius
    return along * along + across * across < radius * radius


@wp.func
def follow_path(  # noqa: PLR0912, PLR0915
    params: RoverParams, airframe: RoverControlAirframe, state: PathState, est: Estimate, sp: Setpoint, speed: float
) -> tuple[PathState, Motion]:
    """One step on the way to the setpoint's place.

    Args:
        params: limits and look-ahead.
        airframe: which kind of steering.
        state: of the way so far.
        est: where the vehicle is.
        sp: a place, and the line to it.
        speed: [m/s] along the nose, as estimated.
    """
    now = state
    motion = Motion()
    yaw = yaw_from_quat(est.q_ned_from_frd)
    motion.course = yaw
    if state.has_place == 0 or wp.length_sq(horizontal(sp.pos_ned - state.pos_ned)) > 1.0e-6:
        now = begin_way(params, now, est, sp)
    offset = horizontal(sp.pos_ned - est.pos_ned)
    distance = wp.length(offset)
    if now.has_arrived == 1:
        if distance < params.hold_radius:
            motion.is_stop = 1
            return now, motion
        now = drive_back(now, est, offset, yaw)
    line = horizontal(sp.pos_ned - now.start_ned)
    length = wp.length(line)
    ahead = wp.vec2(wp.cos(yaw), wp.sin(yaw)) * now.direction
    if length > 0.1:
        ahead = line / length
    left = wp.dot(offset, ahead)  # along the line
    across = ahead[0] * offset[1] - ahead[1] * offset[0]  # the line lies so far to the right
    is_passed = left < _ARRIVED_M and (wp.abs(across) < 0.5 * params.hold_radius or sp.exit_speed > 0.0)
    if sp.exit_speed <= 0.0 and (is_passed or distance < _ARRIVED_M):
        now.has_arrived = 1
        motion.is_stop = 1
        return now, motion
    heading = yaw
    if now.direction < 0.0:
        heading = yaw + wp.pi
    reach = wp.clamp(params.lookahead_s * wp.abs(speed), params.lookahead_min, params.lookahead_max)
    aim = offset
    if left > reach or sp.exit_speed > 0.0:
        aim = wp.vec2(-ahead[1], ahead[0]) * across + ahead * reach
    elif left > 0.0:  # the end is near: the line goes on behind it, so that it is met straight on
        aim = wp.vec2(-ahead[1], ahead[0]) * across + ahead * wp.max(left, params.lookahead_min)
    bearing = wp.atan2(aim[1], aim[0])
    error = wrap_pi(bearing - heading)
    radius = turning_radius(params, airframe)
    cruise = params.speed_limit
    if wp.isfinite(sp.cruise_speed):
        cruise = wp.min(wp.abs(sp.cruise_speed), params.speed_limit)
    to_end = wp.max(left, distance * wp.where(wp.abs(error) > _HALF_PI, 1.0, 0.0))
    if sp.exit_speed > 0.0:
        to_end = wp.max(to_end - sp.pass_radius, 0.0)
    fastest = wp.min(cruise, stopping_speed(params, to_end, sp.exit_speed))
    if airframe.is_skid == 1:
        if wp.abs(error) > params.turn_from:
            now.is_turning = 1
        elif wp.abs(error) < params.turn_until:
            now.is_turning = 0
        if now.is_turning == 1:
            fastest = 0.0
        motion.yaw_rate = params.yaw_p * error
        motion.course = yaw + error
        motion.speed = now.direction * fastest
        return now, motion
    if is_inside_circle(offset, heading, radius * wp.where(now.is_backing == 1, _BACK_UNTIL, _BACK_AT)):
        if sp.exit_speed <= 0.0 and distance < 4.0 * radius:
            now.is_backing = 1
    else:
        now.is_backing = 0
    if now.is_backing == 1:
        # Straight back, turning the end that leads towards the place
        motion.speed = -now.direction * wp.min(_CRAWL_M_S, cruise)
        motion.yaw_rate = wp.sign(error) * wp.abs(motion.speed) / radius
        motion.course = yaw + error
        return now, motion
    curvature = 2.0 * wp.sin(error) / wp.max(wp.length(aim), 0.3)
    if wp.abs(error) > _HALF_PI:
        curvature = wp.sign(error) * 2.0 / wp.max(wp.length(aim), 0.3)
    tightest = 1.0 / wp.max(radius, 0.01)
    curvature = wp.clamp(curvature, -tightest, tightest)
    if wp.abs(curvature) > 1.0e-3:
        fastest = wp.min(fastest, wp.max(wp.sqrt(params.lateral_accel / wp.abs(curvature)), _CRAWL_M_S))
    if params.speed_reduction > 0.0:
        slowed = params.speed_limit * (1.0 - params.speed_reduction * wp.abs(error) / wp.pi)
        fastest = wp.min(fastest, wp.max(slowed, _CRAWL_M_S))
    motion.speed = now.direction * wp.min(fastest, cruise)
    motion.yaw_rate = curvature * wp.max(wp.abs(speed), _CRAWL_M_S)
    motion.course = yaw + error
    return now, motion
