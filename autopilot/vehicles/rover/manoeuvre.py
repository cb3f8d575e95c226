"""To a place within a few metres, by whichever end of the vehicle points there, 50 Hz.

The way is the arc through the place (pure pursuit of the place itself). One that the front wheels cannot steer is got
by driving the other way first, the end that leads towards the place turning to it.
"""

import warp as wp

from autopilot.vehicles.planned_limits import GRIP_M_S2
from autopilot.vehicles.rover.control_airframe import RoverControlAirframe
from autopilot.vehicles.rover.motion import Asked, Measured, right_of
from autopilot.vehicles.rover.params import RoverParams
from autopilot.vehicles.rover.steering import tightest

wp.set_module_options({"enable_backward": False})

ARRIVED_M = wp.constant(0.04)  # way left at which a place counts as reached
_GRIP_M_S2 = wp.constant(GRIP_M_S2)
_NEAR_M = wp.constant(2.0)
_LEAST_CURVATURE = wp.constant(0.1)  # [1/m] bounds a division
_NEAR_TURNS = wp.constant(3.0)  # of the tightest radius
_PER_S = wp.constant(1.6)  # speed over the way left, close to a place
_REACTION_S = wp.constant(0.1)  # way that goes by before the brake answers
_CREEP_M_S = wp.constant(0.15)  # least speed before a place is reached
_MANOEUVRE_M_S = wp.constant(1.0)  # greatest
_BACKING_M_S = wp.constant(0.6)
_REACHED = wp.constant(0.9)  # of the tightest curvature that leads to a place
_BACKED = wp.constant(0.6)  # of it, from which on a place is not backed away from any more
_PER_ATTEMPT_M = wp.constant(0.1)  # by which each change of direction makes the place larger


@wp.struct
class PathState:
    """What is remembered of the way to a place."""

    pos_ned: wp.vec2  # [m] the place driven to or held: the one asked for, moved along with the estimate's wander
    asked_ned: wp.vec2  # [m] the place asked for; a change of it is a new way
    here_ned: wp.vec2  # [m] the vehicle a step before
    wander_m: float  # of the estimate while the vehicle stands, at most
    start_ned: wp.vec2  # [m] where the line to it begins
    has_place: int
    phase: int  # autopilot.vehicles.rover.path
    asked_direction: float  # 1 forward, -1 backwards
    direction: float  # in which it drives now
    is_backing: int  # away from the place, to get it ahead
    attempts: int  # changes of direction
    crab: float  # [rad] from the nose to where the rear axle goes
    is_turning: int  # a skid-steer rover turns on the spot


@wp.func
def near_m(params: RoverParams, airframe: RoverControlAirframe) -> float:
    """How far a place is at most that is driven to by either end."""
    if airframe.is_skid == 1:
        return _NEAR_M
    return wp.max(_NEAR_M, _NEAR_TURNS / wp.max(tightest(params), _LEAST_CURVATURE))


@wp.func
def speed_to_stop(params: RoverParams, way_m: float, end_speed: float) -> float:
    """[m/s] from which the speed at the end of the way can be reached."""
    decel = 0.8 * wp.where(params.decel_limit > 0.0, params.decel_limit, _GRIP_M_S2)
    reaction = decel * _REACTION_S
    left = wp.max(way_m, 0.0)
    braking = wp.sqrt(reaction * reaction + end_speed * end_speed + 2.0 * decel * left) - reaction
    return wp.max(wp.max(wp.min(braking, end_speed + _PER_S * left), end_speed), _CREEP_M_S)


@wp.func
def manoeuvre(
    params: RoverParams, airframe: RoverControlAirframe, state: PathState, here: Measured
) -> tuple[PathState, Asked]:
    """One step towards the place; it ends by asking to stop."""
    now = state
    asked = Asked()
    offset = state.pos_ned - here.pos_ned
    distance = wp.length(offset)
    ahead_m = wp.dot(offset, here.ahead_ned)
    right_m = right_of(here.ahead_ned, offset)
    enough = wp.min(ARRIVED_M + _PER_ATTEMPT_M * float(state.attempts), 0.6 * params.hold_radius)
    is_passed = state.direction * ahead_m < ARRIVED_M
    asked.course = here.yaw
    if distance < enough or (is_passed and state.is_backing == 0 and distance < 0.6 * params.hold_radius):
        asked.is_stop = 1
        return now, asked
    if airframe.is_skid == 1:
        asked.course = wp.atan2(state.direction * offset[1], state.direction * offset[0])
        asked.speed = state.direction * wp.min(speed_to_stop(params, distance, 0.0), _MANOEUVRE_M_S)
        return now, asked
    most = tightest(params)
    curvature = 2.0 * right_m / wp.max(distance * distance, 0.01)
    if state.is_backing == 1:
        if wp.abs(curvature) < _BACKED * most and wp.abs(ahead_m) > wp.abs(right_m):
            now.is_backing = 0
            now.direction = -state.direction
            now.attempts = state.attempts + 1
    elif wp.abs(curvature) > _REACHED * most or is_passed:
        now.is_backing = 1
        now.direction = -wp.where(ahead_m < 0.0, -1.0, 1.0)
        now.attempts = state.attempts + 1
    asked.is_rate = 1
    if now.is_backing == 1:
        curvature = -wp.sign(right_m) * most
        asked.speed = now.direction * _BACKING_M_S
    else:
        curvature = wp.clamp(curvature, -most, most)
        asked.speed = now.direction * wp.min(speed_to_stop(params, distance, 0.0), _MANOEUVRE_M_S)
    speed = now.direction * wp.max(wp.abs(here.speed), 0.5)
    asked.yaw_rate = speed * curvature
    return now, asked
