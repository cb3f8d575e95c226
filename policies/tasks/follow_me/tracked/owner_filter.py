"""The owner's level place and velocity from sights alone: one source for training and for flight.

In: where each picture shows the owner, how well, and how old that is. Out: place and velocity of now with variances,
and the newest innovation, which says that they turn before the velocity does. Two models of how they move, who goes on
and who turns or stops, and how probable the second is: an interacting multiple model (Blom and Bar-Shalom 1988). The
state stays at the time of the newest sight and is carried on when it is asked.
"""

import warp as wp

from policies.tasks.follow_me.tracked.motion_filter import (
    Motion,
    bounded_innov,
    corrected,
    likelihood,
    mixed,
    moved,
)

wp.set_module_options({"enable_backward": False})

STEADY_NSD2 = wp.constant(0.1)  # [m²/s³] of the velocity of who goes on,
TURNING_NSD2 = wp.constant(2.0)  # and of who turns, stops or sets off
TURNS_EVERY_S = wp.constant(3.0)
TURNS_FOR_S = wp.constant(0.7)
START_SPEED_STD = wp.constant(1.5)  # [m/s] of somebody new
FORGOTTEN_S = wp.constant(3.0)  # after so long without a sight they are somebody new
SLOWS_S = wp.constant(1.5)  # unseen, their velocity is believed less, with this time
DOWN_GAIN = wp.constant(0.3)  # of each sight's height
ODD_STDS = wp.constant(3.0)  # an innovation of more counts as so much: it may be no sight of the owner
ALONG_STD_M = wp.constant(0.03)  # of a sight with depth, and more with each metre; measured
ALONG_STD_FRACTION = wp.constant(0.015)
COLOUR_STD_FRACTION = wp.constant(0.15)  # of a range by colours alone; measured
ACROSS_STD_M = wp.constant(0.02)
ACROSS_STD_RAD = wp.constant(0.015)


@wp.struct
class OwnerFilter:
    """One row."""

    steady: Motion  # by each model, at the newest sight
    turning: Motion
    turns: float  # [1] how probable the second is
    both: Motion  # together
    down: float  # [m] of the chest
    innov_ned: wp.vec2  # [m] of the newest sight
    age_s: float  # since that sight was taken
    is_known: int


@wp.func
def waited(f: OwnerFilter, dt_s: float) -> OwnerFilter:
    """Time passes."""
    f.age_s = f.age_s + dt_s
    return f


@wp.func
def begun(pos_ned: wp.vec3, obs_var: wp.mat22, age_s: float) -> OwnerFilter:
    """Of somebody new."""
    m = Motion()
    m.pos = wp.vec2(pos_ned[0], pos_ned[1])
    m.pos_var = obs_var
    m.vel_var = START_SPEED_STD * START_SPEED_STD * wp.identity(n=2, dtype=float)
    f = OwnerFilter()
    f.steady = m
    f.turning = m
    f.both = m
    f.turns = 0.5
    f.down = pos_ned[2]
    f.age_s = age_s
    f.is_known = 1
    return f


@wp.func
def sight_var(way: wp.vec2, has_depth: int) -> wp.mat22:
    """Variance of a sight, level [m²], at the end of a way from the lens."""
    far_m = wp.max(wp.length(way), 0.1)
    u = way / far_m
    along = ALONG_STD_M + ALONG_STD_FRACTION * far_m
    if has_depth == 0:
        along = COLOUR_STD_FRACTION * far_m
    across = ACROSS_STD_M + ACROSS_STD_RAD * far_m
    return along * along * wp.outer(u, u) + across * across * (wp.identity(n=2, dtype=float) - wp.outer(u, u))


@wp.func
def seen(f: OwnerFilter, pos_ned: wp.vec3, eye_ned: wp.vec3, has_depth: int, age_s: float) -> OwnerFilter:
    """A picture that was taken so long ago shows the chest at a place."""
    way = wp.vec2(pos_ned[0] - eye_ned[0], pos_ned[1] - eye_ned[1])
    obs_var = sight_var(way, has_depth)
    dt_s = f.age_s - age_s
    if f.is_known == 0 or dt_s > FORGOTTEN_S:
        return begun(pos_ned, obs_var, age_s)
    dt_s = wp.max(dt_s, 0.0)
    setting_off, calming = 1.0 - wp.exp(-dt_s / TURNS_EVERY_S), 1.0 - wp.exp(-dt_s / TURNS_FOR_S)
    turned = (1.0 - f.turns) * setting_off
    still_turning = f.turns * (1.0 - calming)
    turns = turned + still_turning
    steady = mixed(f.steady, f.turning, f.turns * calming / wp.max(1.0 - turns, 1.0e-6))
    turning = mixed(f.steady, f.turning, still_turning / wp.max(turns, 1.0e-6))
    steady = moved(steady, dt_s, STEADY_NSD2)
    turning = moved(turning, dt_s, TURNING_NSD2)
    place = wp.vec2(pos_ned[0], pos_ned[1])
    steady_var, turning_var = steady.pos_var + obs_var, turning.pos_var + obs_var
    steady_innov = bounded_innov(place - steady.pos, turning_var, ODD_STDS)
    turning_innov = bounded_innov(place - turning.pos, turning_var, ODD_STDS)
    as_steady = (1.0 - turns) * likelihood(steady_innov, steady_var)
    as_turning = turns * likelihood(turning_innov, turning_var)
    f.turns = wp.clamp(as_turning / wp.max(as_steady + as_turning, 1.0e-20), 0.01, 0.99)
    f.steady = corrected(steady, bounded_innov(steady_innov, steady_var, ODD_STDS), steady_var)
    f.turning = corrected(turning, turning_innov, turning_var)
    f.both = mixed(f.steady, f.turning, f.turns)
    f.down = f.down + DOWN_GAIN * (pos_ned[2] - f.down)
    f.innov_ned = steady_innov
    f.age_s = age_s
    return f


@wp.func
def slowing(age_s: float) -> float:
    """What is left of a velocity that was seen so long ago."""
    return wp.exp(-wp.max(age_s - 0.5, 0.0) / SLOWS_S)


@wp.func
def place_now(f: OwnerFilter) -> wp.vec3:
    """[m] of the chest."""
    fresh_s = wp.min(f.age_s, 0.5)
    way_s = fresh_s + SLOWS_S * (1.0 - slowing(f.age_s))
    place = f.both.pos + way_s * f.both.vel
    return wp.vec3(place[0], place[1], f.down)


@wp.func
def velocity_now(f: OwnerFilter) -> wp.vec2:
    """How fast they are by now [m/s]."""
    return slowing(f.age_s) * f.both.vel


@wp.func
def std_along(var: wp.mat22, way: wp.vec2) -> float:
    """One standard deviation along a way, of a covariance."""
    return wp.sqrt(wp.max(wp.dot(way, var * way) / wp.max(wp.dot(way, way), 1.0e-6), 0.0))


@wp.kernel(enable_backward=False)
def see_rows(
    filters: wp.array(dtype=OwnerFilter),
    pos_ned: wp.array(dtype=wp.vec3),
    eye_ned: wp.array(dtype=wp.vec3),
    has_depth: wp.array(dtype=int),
    age_s: wp.array(dtype=float),
) -> None:
    """A sight of every row: for flights, which have one."""
    i = wp.tid()
    filters[i] = seen(filters[i], pos_ned[i], eye_ned[i], has_depth[i], age_s[i])


@wp.kernel(enable_backward=False)
def now_rows(
    filters: wp.array(dtype=OwnerFilter), places: wp.array(dtype=wp.vec3), velocities: wp.array(dtype=wp.vec2)
) -> None:
    """Where the owners of all rows are by now, and how they move."""
    i = wp.tid()
    places[i] = place_now(filters[i])
    velocities[i] = velocity_now(filters[i])
