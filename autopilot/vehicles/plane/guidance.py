"""Where to go over ground: the lateral acceleration that leads to a line, a circle or a course, 50 Hz.

S. Park, J. Deyst, J. How, "A new nonlinear guidance logic for trajectory tracking", AIAA 2004-4900, with the period and
damping of PX4's L1 controller (ECL_L1_Pos_Controller); by the velocity over ground, so that wind leaves no error.
"""

import warp as wp

from autopilot.vehicles.plane.motion import Measured
from autopilot.vehicles.plane.params import PlaneParams

wp.set_module_options({"enable_backward": False})

_SLOWEST_M_S = wp.constant(1.0)
_STEEPEST_SINE = wp.constant(0.7071)  # a far line is met at 45 deg


@wp.func
def left_of(along: wp.vec2, offset: wp.vec2) -> float:
    """How far an offset leads to the left of a direction of length 1."""
    return offset[0] * along[1] - offset[1] * along[0]


@wp.func
def lookahead_m(params: PlaneParams, speed: float) -> float:
    return params.guidance_period * params.guidance_damping * speed / wp.pi


@wp.func
def towards(params: PlaneParams, here: Measured, eta: float) -> float:
    """[m/s²] To the right, for an angle [rad] from the velocity over ground to where to look."""
    speed = wp.max(wp.length(here.vel_ned), _SLOWEST_M_S)
    gain = 4.0 * params.guidance_damping * params.guidance_damping / lookahead_m(params, speed)
    return gain * speed * speed * wp.sin(wp.clamp(eta, -0.5 * wp.pi, 0.5 * wp.pi))


@wp.func
def to_line(params: PlaneParams, here: Measured, start: wp.vec2, along: wp.vec2) -> float:
    """[m/s²] Lateral acceleration to a line through `start` in the direction `along` of length 1, without end."""
    speed = wp.max(wp.length(here.vel_ned), _SLOWEST_M_S)
    left_m = left_of(along, here.pos_ned - start)
    sine = wp.clamp(left_m / lookahead_m(params, speed), -_STEEPEST_SINE, _STEEPEST_SINE)
    drift = wp.atan2(left_of(along, here.vel_ned), wp.dot(along, here.vel_ned))
    return towards(params, here, wp.asin(sine) + drift)


@wp.func
def to_circle(params: PlaneParams, here: Measured, centre: wp.vec2, radius: float) -> float:
    """[m/s²] Lateral acceleration to a circle; a positive radius [m] is flown clockwise."""
    side = wp.sign(radius)
    size = wp.max(wp.abs(radius), 1.0)
    offset = here.pos_ned - centre
    distance = wp.length(offset)
    outward = wp.vec2(1.0, 0.0)
    if distance > 1.0:
        outward = offset / distance
    inward_eta = wp.atan2(-left_of(-outward, here.vel_ned), wp.dot(-outward, here.vel_ned))
    capture = towards(params, here, -inward_eta)
    omega = 2.0 * wp.pi / params.guidance_period
    error_m = distance - size
    pull = omega * omega * error_m + 2.0 * params.guidance_damping * omega * wp.dot(outward, here.vel_ned)
    # Along the circle the way that it is flown.
    tangent = side * left_of(here.vel_ned, outward)
    if tangent < 0.0:
        pull = wp.max(pull, 0.0)
    needed = tangent * tangent / wp.max(0.5 * size, size + error_m)
    circling = side * (pull + needed)
    if error_m > 0.0 and side * capture < side * circling:
        return capture
    return circling


@wp.func
def to_course(params: PlaneParams, here: Measured, along: wp.vec2) -> float:
    """[m/s²] Lateral acceleration to a course over ground, of length 1."""
    speed = wp.max(wp.length(here.vel_ned), _SLOWEST_M_S)
    drift = wp.atan2(left_of(along, here.vel_ned), wp.dot(along, here.vel_ned))
    turn = wp.sin(wp.clamp(drift, -0.5 * wp.pi, 0.5 * wp.pi))
    return 2.0 * speed * turn * 2.0 * wp.pi / params.guidance_period * params.guidance_damping
