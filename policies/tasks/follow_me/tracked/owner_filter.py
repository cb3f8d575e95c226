"""The owner's level place and velocity from sights alone: one source for training and for flight.

In: where each picture shows the owner, how well, and how old that is. Out: place and velocity of now with variances,
and the newest innovation, which says that they turn before the velocity does. A Kalman filter of nearly constant
velocity; the state stays at the time of the newest sight and is carried on when it is asked.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

ACCEL_NSD2 = wp.constant(0.8)  # [m²/s³] of the owner's velocity; least error on people of the simulation
START_SPEED_STD = wp.constant(1.5)  # [m/s] of somebody new
FORGOTTEN_S = wp.constant(3.0)  # after so long without a sight they are somebody new
SLOWS_S = wp.constant(1.5)  # unseen, their velocity is believed less, with this time
DOWN_GAIN = wp.constant(0.3)  # of each sight's height
CALM_S = wp.constant(0.7)  # with this time a calm velocity follows
ODD_STDS = wp.constant(3.0)  # an innovation of more counts as so much: it may be no sight of the owner
ALONG_STD_M = wp.constant(0.03)  # of a sight with depth, and more with each metre; measured
ALONG_STD_FRACTION = wp.constant(0.015)
COLOUR_STD_FRACTION = wp.constant(0.15)  # of a range by colours alone; measured
ACROSS_STD_M = wp.constant(0.02)
ACROSS_STD_RAD = wp.constant(0.015)


@wp.struct
class OwnerFilter:
    """One row."""

    pos_ned: wp.vec3  # [m] of the chest, at the newest sight
    vel_ned: wp.vec2  # [m/s] level
    calm_vel_ned: wp.vec2  # [m/s] the same, smooth and late
    pos_var: wp.mat22  # [m²]
    cross_var: wp.mat22  # [m²/s] of place and velocity
    vel_var: wp.mat22  # [m²/s²]
    innov_ned: wp.vec2  # [m] of the newest sight
    age_s: float  # since that sight was taken
    is_known: int


@wp.func
def waited(f: OwnerFilter, dt_s: float) -> OwnerFilter:
    """Time passes."""
    f.age_s = f.age_s + dt_s
    return f


@wp.func
def predicted(f: OwnerFilter, dt_s: float) -> OwnerFilter:
    """The state carried on by so long."""
    unit = wp.identity(n=2, dtype=float)
    step = dt_s * f.vel_ned
    f.pos_ned = f.pos_ned + wp.vec3(step[0], step[1], 0.0)
    f.pos_var = f.pos_var + dt_s * (f.cross_var + wp.transpose(f.cross_var)) + dt_s * dt_s * f.vel_var
    f.pos_var = f.pos_var + ACCEL_NSD2 * dt_s * dt_s * dt_s / 3.0 * unit
    f.cross_var = f.cross_var + dt_s * f.vel_var + ACCEL_NSD2 * dt_s * dt_s / 2.0 * unit
    f.vel_var = f.vel_var + ACCEL_NSD2 * dt_s * unit
    return f


@wp.func
def even(m: wp.mat22) -> wp.mat22:
    """The symmetric part: rounding errors of the other would grow."""
    return 0.5 * (m + wp.transpose(m))


@wp.func
def begun(pos_ned: wp.vec3, obs_var: wp.mat22, age_s: float) -> OwnerFilter:
    """Of somebody new."""
    f = OwnerFilter()
    f.pos_ned = pos_ned
    f.pos_var = obs_var
    f.vel_var = START_SPEED_STD * START_SPEED_STD * wp.identity(n=2, dtype=float)
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
    f = predicted(f, wp.max(dt_s, 0.0))
    innov = wp.vec2(pos_ned[0] - f.pos_ned[0], pos_ned[1] - f.pos_ned[1])
    innov_inv = wp.inverse(f.pos_var + obs_var)
    stds = wp.sqrt(wp.max(wp.dot(innov, innov_inv * innov), 0.0))
    innov = innov * wp.min(1.0, ODD_STDS / wp.max(stds, 1.0e-6))
    pos_gain = f.pos_var * innov_inv
    vel_gain = wp.transpose(f.cross_var) * innov_inv
    pos_step = pos_gain * innov
    down = DOWN_GAIN * (pos_ned[2] - f.pos_ned[2])
    f.pos_ned = f.pos_ned + wp.vec3(pos_step[0], pos_step[1], down)
    f.vel_ned = f.vel_ned + vel_gain * innov
    f.calm_vel_ned = f.calm_vel_ned + wp.min(dt_s / CALM_S, 1.0) * (f.vel_ned - f.calm_vel_ned)
    f.vel_var = even(f.vel_var - vel_gain * f.cross_var)
    f.cross_var = f.cross_var - pos_gain * f.cross_var
    f.pos_var = even(f.pos_var - pos_gain * f.pos_var)
    f.innov_ned = innov
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
    step = way_s * f.vel_ned
    return f.pos_ned + wp.vec3(step[0], step[1], 0.0)


@wp.func
def velocity_now(f: OwnerFilter) -> wp.vec2:
    """How fast they are by now [m/s]."""
    return slowing(f.age_s) * f.vel_ned


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
