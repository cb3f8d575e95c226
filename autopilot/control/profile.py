"""One axis of jerk-limited motion: how to change a velocity, and how to reach a position, in least time.

The way to a position is: ramp to a cruise velocity, keep it, ramp to the exit velocity. The cruise velocity is the
one whose two ramps end exactly at the goal. It is solved afresh at each call, so goals and limits may change at any
time; on an unchanged goal the same plan is found again.
"""

import warp as wp

from autopilot.control.pid import finite_or

wp.set_module_options({"enable_backward": False})

_SOLVER_STEPS = wp.constant(24)  # regula falsi converges in about 8
_ARRIVED_M = wp.constant(5.0e-4)
_ARRIVED_M_S = wp.constant(1.0e-2)


@wp.struct
class AxisLimits:
    """All positive; `positive` and `negative` are directions of motion along the axis."""

    speed_positive: float  # [m/s]
    speed_negative: float
    accel_positive: float  # [m/s²]
    accel_negative: float
    jerk: float  # [m/s³]


@wp.struct
class Motion:
    """A point moving along an axis; `time_left_s` counts down while segments are played."""

    moved: float  # [m] since the start
    vel: float
    accel: float
    time_left_s: float


@wp.struct
class Ramp:
    """A change of velocity that ends without acceleration: jerk, constant acceleration, jerk."""

    jerk_in: float
    time_in_s: float
    time_hold_s: float
    jerk_out: float
    time_out_s: float


@wp.func
def flipped(limits: AxisLimits) -> AxisLimits:
    """The limits for the axis turned round."""
    turned = AxisLimits()
    turned.speed_positive = limits.speed_negative
    turned.speed_negative = limits.speed_positive
    turned.accel_positive = limits.accel_negative
    turned.accel_negative = limits.accel_positive
    turned.jerk = limits.jerk
    return turned


@wp.func
def play(motion: Motion, jerk: float, duration_s: float) -> Motion:
    """The motion after `duration_s` of constant jerk, or after its time left if that is shorter."""
    dt_s = wp.min(duration_s, motion.time_left_s)
    after = Motion()
    after.moved = motion.moved + dt_s * (motion.vel + dt_s * (0.5 * motion.accel + dt_s * jerk / 6.0))
    after.vel = motion.vel + dt_s * (motion.accel + 0.5 * dt_s * jerk)
    after.accel = motion.accel + dt_s * jerk
    after.time_left_s = motion.time_left_s - dt_s
    return after


@wp.func
def released_speed(vel: float, accel: float, jerk: float) -> float:
    """The velocity reached by bringing the acceleration to zero."""
    return vel + 0.5 * accel * wp.abs(accel) / jerk


@wp.func
def ramp_to(vel: float, accel: float, vel_goal: float, limits: AxisLimits) -> Ramp:
    """The fastest change from (vel, accel) to (vel_goal, 0)."""
    sign = float(1.0)
    limit = limits.accel_positive
    if vel_goal < released_speed(vel, accel, limits.jerk):
        sign = -1.0
        limit = limits.accel_negative
    change = sign * (vel_goal - vel)
    start = sign * accel
    peak = wp.min(wp.sqrt(wp.max(limits.jerk * change + 0.5 * start * start, 0.0)), limit)
    ramp = Ramp()
    ramp.time_in_s = wp.abs(peak - start) / limits.jerk
    ramp.time_out_s = peak / limits.jerk
    ramp.jerk_in = sign * limits.jerk
    if peak < start:  # the limit was lowered
        ramp.jerk_in = -sign * limits.jerk
    ramp.jerk_out = -sign * limits.jerk
    remaining = change - 0.5 * (peak + start) * ramp.time_in_s - 0.5 * peak * ramp.time_out_s
    if peak > 1.0e-4:
        ramp.time_hold_s = wp.max(remaining / peak, 0.0)
    return ramp


@wp.func
def play_ramp(motion: Motion, ramp: Ramp) -> Motion:
    """The motion after the ramp, or after its time left."""
    after = play(motion, ramp.jerk_in, ramp.time_in_s)
    after = play(after, 0.0, ramp.time_hold_s)
    return play(after, ramp.jerk_out, ramp.time_out_s)


@wp.func
def ramp_distance(vel: float, accel: float, vel_goal: float, limits: AxisLimits) -> float:
    """Distance [m] covered while ramping to `vel_goal`."""
    motion = Motion()
    motion.vel = vel
    motion.accel = accel
    motion.time_left_s = 1.0e6
    after = play_ramp(motion, ramp_to(vel, accel, vel_goal, limits))
    return after.moved


@wp.func
def level_ramp_distance(vel: float, vel_goal: float, limits: AxisLimits) -> float:
    """`ramp_distance` downwards from no acceleration: the mean speed times the duration."""
    drop = wp.max(vel - vel_goal, 0.0)
    accel = limits.accel_negative
    duration = drop / accel + accel / limits.jerk
    if drop * limits.jerk < accel * accel:
        duration = 2.0 * wp.sqrt(drop / limits.jerk)
    return 0.5 * (vel + vel_goal) * duration


@wp.func
def distance_via(vel_cruise: float, vel: float, accel: float, vel_exit: float, limits: AxisLimits) -> float:
    """Distance [m] of ramping to `vel_cruise` and at once on to the exit velocity."""
    return ramp_distance(vel, accel, vel_cruise, limits) + level_ramp_distance(
        vel_cruise, wp.min(vel_cruise, vel_exit), limits
    )


@wp.struct
class Bracket:
    """Of a root: what falls short of a distance, what goes too far, and by how much [m]."""

    low: float
    f_low: float
    high: float
    f_high: float
    side: int  # on which the last try lay: -1, 1; 0 before


@wp.func
def narrowed(bracket: Bracket, tried: float, error: float) -> Bracket:
    """The bracket with a try for one of its ends; the weight of an end that stays is halved (Illinois)."""
    now = bracket
    if error < 0.0:
        now.low = tried
        now.f_low = error
        if bracket.side < 0:
            now.f_high = 0.5 * bracket.f_high
        now.side = -1
    else:
        now.high = tried
        now.f_high = error
        if bracket.side > 0:
            now.f_low = 0.5 * bracket.f_low
        now.side = 1
    return now


@wp.func
def solve_cruise(
    low: float, high: float, distance: float, vel: float, accel: float, vel_exit: float, limits: AxisLimits
) -> float:
    """The cruise velocity between `low` (falls short) and `high` (goes too far) that covers `distance`."""
    ends = Bracket()
    ends.low = low
    ends.high = high
    ends.f_low = distance_via(low, vel, accel, vel_exit, limits) - distance
    ends.f_high = distance_via(high, vel, accel, vel_exit, limits) - distance
    tolerance = 1.0e-5 + 1.0e-6 * wp.abs(distance)
    best = float(low)
    for _step in range(_SOLVER_STEPS):
        if ends.f_high - ends.f_low > 1.0e-9:
            best = ends.low - ends.f_low * (ends.high - ends.low) / (ends.f_high - ends.f_low)
        else:
            best = 0.5 * (ends.low + ends.high)
        error = distance_via(best, vel, accel, vel_exit, limits) - distance
        if wp.abs(error) < tolerance:
            break
        ends = narrowed(ends, best, error)
    return best


@wp.func
def braked_at(decel: float, limits: AxisLimits) -> AxisLimits:
    """The limits with another deceleration [m/s²]."""
    gentler = AxisLimits()
    gentler.speed_positive = limits.speed_positive
    gentler.speed_negative = limits.speed_negative
    gentler.accel_positive = limits.accel_positive
    gentler.accel_negative = decel
    gentler.jerk = limits.jerk
    return gentler


@wp.func
def solve_decel(distance: float, vel: float, accel: float, vel_exit: float, limits: AxisLimits) -> float:
    """The deceleration [m/s²], at most the limit, at which ramping to the exit velocity covers `distance`.

    Given that the limit falls short of it. Above the peak that is reached the distance does not depend on it, below it
    is nearly linear in its inverse. What is not found in time falls short, and is found a frame later.
    """
    ends = Bracket()
    ends.low = 1.0 / limits.accel_negative
    ends.f_low = ramp_distance(vel, accel, vel_exit, limits) - distance
    ends.high = ends.low
    ends.f_high = ends.f_low
    for _step in range(_SOLVER_STEPS):
        if ends.f_high >= 0.0:
            break
        ends.low = ends.high
        ends.f_low = ends.f_high
        ends.high = 2.0 * ends.high
        ends.f_high = ramp_distance(vel, accel, vel_exit, braked_at(1.0 / ends.high, limits)) - distance
    tolerance = 1.0e-5 + 1.0e-6 * wp.abs(distance)
    for _step in range(_SOLVER_STEPS):
        if ends.f_high - ends.f_low < 1.0e-9:
            break
        best = ends.low - ends.f_low * (ends.high - ends.low) / (ends.f_high - ends.f_low)
        error = ramp_distance(vel, accel, vel_exit, braked_at(1.0 / best, limits)) - distance
        if wp.abs(error) < tolerance:
            return 1.0 / best
        ends = narrowed(ends, best, error)
    return 1.0 / ends.low


@wp.func
def approach(
    distance: float, vel: float, accel: float, slowest: float, vel_exit: float, limits: AxisLimits, dt_s: float
) -> Motion:
    """One step of the way forward to `distance`, given that ramping to `slowest` at once would not pass it.

    Where it brakes already, and could not let go of the brake for a while, it brakes more gently to the end. To brake
    hard and creep what is left would be a jolt, and as great a one for a rounding as for a millimetre.
    """
    top = limits.speed_positive
    released = released_speed(vel, accel, limits.jerk)
    base = wp.clamp(released, slowest, top)
    cruise = float(top)
    keep_s = float(0.0)
    braking = limits
    if distance_via(base, vel, accel, vel_exit, limits) > distance:
        if released > top:  # first to a speed that is allowed
            cruise = solve_cruise(slowest, base, distance, vel, accel, vel_exit, limits)
        else:
            cruise = slowest
            braking = braked_at(solve_decel(distance, vel, accel, slowest, limits), limits)
    else:
        beyond = distance - distance_via(top, vel, accel, vel_exit, limits)
        if beyond >= 0.0:
            keep_s = beyond / top
        else:
            cruise = solve_cruise(base, top, distance, vel, accel, vel_exit, limits)
    motion = Motion()
    motion.vel = vel
    motion.accel = accel
    motion.time_left_s = dt_s
    motion = play_ramp(motion, ramp_to(vel, accel, cruise, braking))
    motion = play(motion, 0.0, keep_s)
    motion = play_ramp(motion, ramp_to(cruise, 0.0, wp.min(cruise, vel_exit), limits))
    if motion.time_left_s > 0.0:  # arrived within the step: exactly
        motion.vel = wp.min(cruise, vel_exit)
        motion.accel = 0.0
        motion.moved = distance + motion.vel * motion.time_left_s
    return motion


@wp.func
def step_to_velocity(vel: float, accel: float, vel_goal: float, limits: AxisLimits, dt_s: float) -> Motion:
    """One step towards a velocity."""
    goal = wp.clamp(vel_goal, -limits.speed_negative, limits.speed_positive)
    motion = Motion()
    motion.vel = vel
    motion.accel = accel
    motion.time_left_s = dt_s
    motion = play_ramp(motion, ramp_to(vel, accel, goal, limits))
    if motion.time_left_s > 0.0:  # exactly, so that a stop is a stop
        motion.vel = goal
        motion.accel = 0.0
        motion.moved = motion.moved + goal * motion.time_left_s
    return motion


@wp.func
def step_to_position(
    distance: float, vel: float, accel: float, vel_exit: float, limits: AxisLimits, dt_s: float
) -> Motion:
    """One step towards the point `distance` ahead, passed at `vel_exit` at most.

    What cannot be stopped in time passes the point and comes back; with an exit velocity it just slows as it can.
    """
    at_goal = Motion()
    at_goal.moved = distance
    if wp.abs(distance) < _ARRIVED_M and wp.abs(vel) < _ARRIVED_M_S and wp.abs(accel) < limits.jerk * dt_s:
        return at_goal
    pass_speed = float(0.0)
    if distance > 0.0:
        pass_speed = wp.min(vel_exit, limits.speed_positive)
    slowest = wp.clamp(released_speed(vel, accel, limits.jerk), 0.0, pass_speed)
    if ramp_distance(vel, accel, slowest, limits) <= distance:
        return approach(distance, vel, accel, slowest, pass_speed, limits, dt_s)
    if slowest > 0.0:
        return step_to_velocity(vel, accel, slowest, limits, dt_s)
    back = approach(-distance, -vel, -accel, 0.0, 0.0, flipped(limits), dt_s)
    turned = Motion()
    turned.moved = -back.moved
    turned.vel = -back.vel
    turned.accel = -back.accel
    return turned


@wp.func
def step_to_acceleration(vel: float, accel: float, accel_goal: float, limits: AxisLimits, dt_s: float) -> Motion:
    """One step towards an acceleration."""
    goal = wp.clamp(finite_or(accel_goal, 0.0), -limits.accel_negative, limits.accel_positive)
    motion = Motion()
    motion.accel = accel + wp.clamp(goal - accel, -limits.jerk * dt_s, limits.jerk * dt_s)
    motion.vel = vel + 0.5 * (accel + motion.accel) * dt_s
    motion.moved = 0.5 * (vel + motion.vel) * dt_s
    return motion
