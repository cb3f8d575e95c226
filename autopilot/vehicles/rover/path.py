"""Where to and how fast: the line to a place, and standing there, 50 Hz.

In: what is measured, the setpoint. Out: speed and course, or speed and yaw rate. The rear axle is what is kept on the
line: it goes where the nose points, forward as well as backwards. Its course closes in on the line by the look-ahead
(line of sight guidance, T. I. Fossen, "Handbook of Marine Craft Hydrodynamics and Motion Control", 2011, section 12.3),
with the turning of that course fed forward, and less what the vehicle crabs.

A vehicle that stands does not follow its position estimate, which wanders by metres while nothing moves: what the
estimate moves without speed moves the place held, too. What rolls or slides has a speed, and is driven back.

A rover cannot go sideways: a place beside it that the front wheels cannot reach is backed away from first
(autopilot.vehicles.rover.manoeuvre), and one a little off is left so once the rover stands.
"""

import warp as wp

from autopilot.ports import Setpoint
from autopilot.vehicles.rover.control_airframe import RoverControlAirframe
from autopilot.vehicles.rover.manoeuvre import ARRIVED_M, PathState, manoeuvre, near_m, speed_to_stop
from autopilot.vehicles.rover.motion import Asked, Measured, right_of
from autopilot.vehicles.rover.params import RoverParams
from autopilot.vehicles.rover.steering import tightest
from common.rotation import wrap_pi

wp.set_module_options({"enable_backward": False})

_DRIVING = wp.constant(0)  # PathState.phase, along the line
_HOLDING = wp.constant(1)  # stands at the place
_MANOEUVRING = wp.constant(2)  # to a place near by, by whichever end
_WANDER_SIGMA = wp.constant(5.0)  # guess: the estimate wanders by less; more is a creep below the standstill speed
_SAME_M = wp.constant(0.001)  # by which a place must differ to be another one
_LINE_M = wp.constant(0.1)  # least length of a line that has a direction
_RUN_OUT_M = wp.constant(2.0)  # behind a place to be passed, by which nobody has asked for another one
_CRAB_M_S = wp.constant(1.0)  # speed from which crabbing is measured
_CRAB_S = wp.constant(1.0)
_CRAB_MAX = wp.constant(0.15)  # [rad]
_STRAIGHT = wp.constant(0.9)  # cosine of the angle to the line from which no turn on to it is left
_ARC = wp.constant(1.3)  # of the tightest turn: the radius of a turn that begins on the line


@wp.func
def asked_direction(sp: Setpoint) -> float:
    """-1 where the way is to be driven backwards, else 1."""
    return wp.where(sp.cruise_speed < 0.0, -1.0, 1.0)


@wp.func
def begin_way(
    params: RoverParams, airframe: RoverControlAirframe, state: PathState, here: Measured, sp: Setpoint
) -> PathState:
    """A new place: the line to it begins where the setpoint says, or here."""
    now = PathState()
    now.pos_ned = wp.vec2(sp.pos_ned[0], sp.pos_ned[1])
    now.asked_ned = now.pos_ned
    now.here_ned = here.pos_ned
    now.has_place = 1
    now.crab = state.crab
    now.asked_direction = asked_direction(sp)
    now.direction = now.asked_direction
    now.start_ned = here.axle_ned
    distance = wp.length(now.pos_ned - here.pos_ned)
    if wp.isfinite(sp.path_start_ned[0]) and wp.isfinite(sp.path_start_ned[1]):
        now.start_ned = wp.vec2(sp.path_start_ned[0], sp.path_start_ned[1])
    elif sp.exit_speed <= 0.0 and not wp.isfinite(sp.vel_ned[0]) and distance < near_m(params, airframe):
        now.phase = _MANOEUVRING
    stands = state.phase == _HOLDING or (now.phase == _MANOEUVRING and here.ground_speed < params.stop_speed)
    if stands and distance < 0.5 * params.hold_radius:
        now.phase = _HOLDING
    return now


@wp.func
def place_held(params: RoverParams, state: PathState, here: Measured) -> PathState:
    """The state with the place of a vehicle that stands, a step later.

    It moves with the estimate as far as that may wander: by its deviation since the vehicle stands, at its largest. An
    estimate without any, the truth, moves nothing.
    """
    now = state
    now.here_ned = here.pos_ned
    if state.phase == _HOLDING and here.ground_speed < params.stop_speed:
        now.wander_m = wp.max(state.wander_m, _WANDER_SIGMA * here.pos_std)
        now.pos_ned = state.pos_ned + here.pos_ned - state.here_ned
        if not (wp.length(now.pos_ned - state.asked_ned) <= now.wander_m):  # NaN, too
            now.pos_ned = state.asked_ned
    return now


@wp.func
def crab_step(state: PathState, here: Measured, dt_s: float) -> float:
    """The angle [rad] from the nose to where the rear axle goes, to the right, slowly filtered."""
    if wp.abs(here.speed) < _CRAB_M_S:
        return state.crab
    angle = wp.clamp(here.side_speed / here.speed, -_CRAB_MAX, _CRAB_MAX)
    return state.crab + (angle - state.crab) * dt_s / _CRAB_S


@wp.func
def speed_onto_line(params: RoverParams, across: float, angle: float, speed: float) -> float:
    """The speed [m/s] at which the turn on to the line fits beside it.

    Args:
        params: the lateral acceleration allowed.
        across: [m] from the line, to the right.
        angle: [rad] of the way against the line, to the right.
        speed: [m/s] without that.
    """
    turned = wp.cos(angle)
    if turned > _STRAIGHT:
        return speed
    radius = _ARC / tightest(params)
    if across * angle < 0.0:  # closes in: the arc that ends on the line
        radius = wp.max(radius, wp.abs(across) / (1.0 - turned))
    return wp.min(speed, wp.sqrt(params.lateral_accel * radius))


@wp.func
def drive_line(
    params: RoverParams, airframe: RoverControlAirframe, state: PathState, here: Measured, sp: Setpoint, way_m: float
) -> Asked:
    """Speed and course along the line, `way_m` before its end."""
    line = state.pos_ned - state.start_ned
    ahead = here.ahead_ned * state.direction
    if wp.length(line) > _LINE_M:
        ahead = wp.normalize(line)
    across = right_of(ahead, here.axle_ned - state.start_ned)
    size = wp.abs(here.speed)
    reach = wp.clamp(params.lookahead_s * size, params.lookahead_min, params.lookahead_max)
    line_course = wp.atan2(ahead[1], ahead[0])
    heading = here.yaw + state.crab
    if state.direction < 0.0:
        heading = heading + wp.pi
    angle = wrap_pi(heading - line_course)
    asked = Asked()
    asked.course = line_course - wp.atan(across / reach) + (here.yaw - heading)
    asked.course_rate = -reach * size * wp.sin(angle) / (reach * reach + across * across)
    speed = params.speed_limit
    if wp.isfinite(sp.cruise_speed):
        speed = wp.min(wp.abs(sp.cruise_speed), speed)
    exit_speed = sp.exit_speed
    if wp.isfinite(sp.vel_ned[0]) and wp.isfinite(sp.vel_ned[1]):  # a place that moves
        exit_speed = wp.max(exit_speed, sp.vel_ned[0] * ahead[0] + sp.vel_ned[1] * ahead[1])
    if sp.exit_speed > 0.0:
        way_m = way_m - sp.pass_radius
    speed = wp.min(speed, speed_to_stop(params, way_m, exit_speed))
    if airframe.is_skid == 0:
        speed = speed_onto_line(params, across, angle, speed)
    asked.speed = state.direction * speed
    return asked


@wp.func
def way_left(state: PathState, here: Measured) -> float:
    """The way [m] to the end of the line, along it; negative behind its end."""
    line = state.pos_ned - state.start_ned
    if wp.length(line) > _LINE_M:
        return wp.dot(state.pos_ned - here.pos_ned, wp.normalize(line))
    return state.direction * wp.dot(state.pos_ned - here.pos_ned, here.ahead_ned)


@wp.func
def next_phase(
    params: RoverParams, airframe: RoverControlAirframe, state: PathState, here: Measured, sp: Setpoint, way_m: float
) -> PathState:
    """What is done now: the line, standing at the place, or back to it."""
    now = state
    distance = wp.length(state.pos_ned - here.pos_ned)
    is_moving = wp.isfinite(sp.vel_ned[0]) and wp.length_sq(wp.vec2(sp.vel_ned[0], sp.vel_ned[1])) > 0.0
    is_off = False
    if state.phase == _HOLDING:
        is_off = distance > params.hold_radius
    if state.phase == _DRIVING and sp.exit_speed <= 0.0 and not is_moving and way_m < ARRIVED_M:
        now.phase = _HOLDING
        is_off = distance > 0.6 * params.hold_radius
    if state.phase == _DRIVING and way_m < -_RUN_OUT_M:
        is_off = True
    if state.phase == _MANOEUVRING and distance > 1.5 * near_m(params, airframe):
        is_off = True
    if is_off:
        now.phase = _DRIVING
        now.start_ned = here.axle_ned
        now.attempts = 0
        now.is_backing = 0
        if distance < near_m(params, airframe) and sp.exit_speed <= 0.0 and not is_moving:
            now.phase = _MANOEUVRING
            now.direction = wp.where(wp.dot(state.pos_ned - here.pos_ned, here.ahead_ned) < 0.0, -1.0, 1.0)
    return now


@wp.func
def follow_path(
    params: RoverParams, airframe: RoverControlAirframe, state: PathState, here: Measured, sp: Setpoint, dt_s: float
) -> tuple[PathState, Asked]:
    """One step on the way to the setpoint's place.

    Args:
        params: limits and look-ahead.
        airframe: which kind of steering.
        state: of the way so far.
        here: where the vehicle is.
        sp: a place, and the line to it.
        dt_s: [s] since the last step.
    """
    now = state
    place = wp.vec2(sp.pos_ned[0], sp.pos_ned[1])
    is_same_way = state.has_place == 1 and state.asked_direction == asked_direction(sp)
    if not is_same_way or wp.length(place - state.asked_ned) > _SAME_M:
        now = begin_way(params, airframe, state, here, sp)
    now = place_held(params, now, here)
    now.crab = crab_step(now, here, dt_s)
    way_m = way_left(now, here)
    now = next_phase(params, airframe, now, here, sp, way_m)
    asked = Asked()
    asked.course = here.yaw
    if now.phase == _DRIVING:
        asked = drive_line(params, airframe, now, here, sp, way_m)
    elif now.phase == _MANOEUVRING:
        now, asked = manoeuvre(params, airframe, now, here)
        if asked.is_stop == 1:
            now.phase = _HOLDING
    else:
        asked.is_stop = 1
    return now, asked
