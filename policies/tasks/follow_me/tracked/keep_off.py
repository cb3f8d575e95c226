"""How fast a vehicle may come nearer to somebody: the guard's rule, and what policies are trained under.

Whatever they do from when they were seen on (stop, turn, set off at the vehicle), it can stand before it is too near:
the safe distance of responsibility-sensitive safety (Shalev-Shwartz et al. 2017, arXiv 1708.06374), with late pictures.
Whoever goes away gives room as far as that speed is sure; whoever comes is given way to. One source: a guard asks
`keep_off_all`, training its functions.
"""

from typing import Any

import warp as wp

from policies.tasks.follow_me.tracked.owner_filter import std_along

wp.set_module_options({"enable_backward": False})

OWNER_M = 1.15  # [m] to the middle of the person: it comes no nearer
OWNER_BRAKE_M_S2 = 3.7  # with which the vehicle brakes before them; measured by bench.follow.braking
REACTION_S = 0.3  # from a setpoint to the motion, besides the age of the picture; likewise, with a decision more
ESCAPE_CLIMB_M_S = 2.5  # nearer than allowed, until it is over their head
OVER_M = wp.constant(1.45)  # so far above their chest it is
_OVER_GAIN = wp.constant(2.0)  # [1/s]
_LATE_S = wp.constant(0.15)  # with older pictures than this, or without depth, ...
_HIGH_M = wp.constant(1.0)  # ... it stays so far above the chest of who is near, from where it is soon over their head
_HIGH_WITHIN_M = wp.constant(4.0)
_RISE_M_S = wp.constant(0.8)
_CLIMBS_S = wp.constant(0.35)  # who comes is climbed over by the way that they go in so long at the latest; guess
SLOW_S, STOP_S = 0.7, 2.0  # without a sight of them for so long it becomes slower, until it stands
IMAGE_SLOW_S, IMAGE_STOP_S = 0.55, 0.8  # and where the newest image is so old
_TURNS_M_S2 = wp.constant(2.5)  # how fast a person stops, turns and sets off; guess
_UNTOLD_S = wp.constant(1.0)  # who was not seen for longer may be anywhere: nothing is reckoned from farther back
_REPORTED_S = wp.constant(0.25)  # from the first picture of who sets off until their velocity tells it; measured,
_LEAVES_M_S = wp.constant(2.0)  # of who does not leave as fast as this: they would have to stop before
_SOON_S = wp.constant(0.8)  # they are given way to as if they had set off so long ago at most
_BACK_GAIN = wp.constant(5.0)  # [1/s]
_BACK_MAX_M_S = wp.constant(5.0)


@wp.struct
class KeepOff:
    """Its numbers."""

    owner_m: float
    brake: float
    reaction_s: float
    escape_climb: float


def keep_off(
    owner_m: float = OWNER_M,
    brake: float = OWNER_BRAKE_M_S2,
    reaction_s: float = REACTION_S,
    escape_climb: float = ESCAPE_CLIMB_M_S,
) -> Any:
    """The rule: how near [m], braking at [m/s²], after a reaction [s], climbing at [m/s]."""
    k = KeepOff()
    k.owner_m, k.brake, k.reaction_s, k.escape_climb = owner_m, brake, reaction_s, escape_climb
    return k


@wp.func
def unit_of(way: wp.vec2) -> wp.vec2:
    """The direction of a way [1]; none of a way that is none."""
    return way / wp.max(wp.length(way), 1.0e-3)


@wp.func
def come_m(since_s: float) -> float:
    """How much nearer somebody has come who set off so long ago [m]."""
    return 0.5 * _TURNS_M_S2 * since_s * since_s


@wp.func
def distance_then(way: wp.vec2, own_vel: wp.vec2, other_vel: wp.vec2, reaction_s: float, age_s: float) -> float:
    """How far away they are [m] when the vehicle answers, if both go on and they come at it besides."""
    far_m = wp.max(wp.length(way), 1.0e-3)
    closing = wp.max(wp.dot(own_vel - other_vel, way) / far_m, 0.0)
    return far_m - reaction_s * closing - come_m(reaction_s + wp.min(age_s, _UNTOLD_S))


@wp.func
def level_m(k: KeepOff, over_m: float) -> float:
    """How near it may come on the level [m], so far above their chest: an ellipsoid about them, free of it above."""
    fraction = wp.clamp(over_m / OVER_M, 0.0, 1.0)
    return k.owner_m * wp.sqrt(1.0 - fraction * fraction)


@wp.func
def braking_s(room_m: float, losing: float, both: float) -> float:
    """How long a vehicle may brake [s] that loses of its room [m] so much a second [m/s], and that faster and faster.

    The largest root of `both / 2 t² + losing t = room_m`, `both` being how fast the two can change their speeds [m/s²].
    """
    return wp.max(wp.sqrt(wp.max(losing * losing + 2.0 * both * wp.max(room_m, 0.0), 0.0)) - losing, 0.0) / both


@wp.func
def closing_max(
    k: KeepOff, way: wp.vec2, own_vel: wp.vec2, other_vel: wp.vec2, vel_std: float, age_s: float, over_m: float
) -> float:
    """How fast it may come nearer to somebody [m/s]; negative: it has to give way.

    `way` leads to where they would be by now [m]; `own_vel` it has until it answers; how uncertain their velocity is;
    `age_s` ago they were seen; so far above their chest.
    """
    far_m = wp.max(wp.length(way), 1.0e-3)
    leaving = wp.dot(other_vel, way) / far_m
    sure = wp.max(leaving - vel_std, wp.min(leaving, 0.0))
    untold_s = wp.min(age_s, _UNTOLD_S)
    since_s = untold_s + k.reaction_s + _REPORTED_S * (1.0 - wp.clamp(leaving / _LEAVES_M_S, 0.0, 1.0))
    room_m = far_m - level_m(k, over_m) - vel_std * untold_s + sure * k.reaction_s - come_m(since_s)
    left_m = room_m - k.reaction_s * wp.max(wp.dot(own_vel, way) / far_m, 0.0)
    beside = level_m(k, over_m) / k.owner_m  # [1] nobody over their head has to give way
    given = beside * wp.min(sure, 0.0)
    if left_m < 0.0:
        likely_m = left_m + vel_std * untold_s + come_m(since_s) - come_m(wp.min(since_s, _SOON_S))
        return wp.max(given + beside * _BACK_GAIN * wp.min(likely_m, 0.0), -_BACK_MAX_M_S)
    both = k.brake + _TURNS_M_S2
    losing = _TURNS_M_S2 * since_s - wp.max(sure, 0.0)
    steady_s = braking_s(room_m, losing + k.brake * k.reaction_s, both)  # at the speed that is asked for
    return given + k.brake * wp.min(steady_s, braking_s(left_m, losing, both))


@wp.func
def kept_off(velocity: wp.vec2, way: wp.vec2, most: float) -> wp.vec2:
    """A level velocity without what is faster towards somebody than it may be [m/s]."""
    unit = unit_of(way)
    return velocity - wp.max(wp.dot(velocity, unit) - most, 0.0) * unit


@wp.func
def sinking_max(
    k: KeepOff, over_m: float, then_m: float, closing: float, coming: float, age_s: float, has_depth: int
) -> float:
    """How fast it may sink [m/s]; negative: it has to climb, over who can be given way to no more.

    That is who is within the way by which they come nearer until it goes as fast as they do, braking as it is taken to;
    or, since trees may end its way back, within what they go in a third of a second.

    So far above their chest [m], and so near [m], both by when it answers; they come nearer to each other, and come at
    it [m/s]; seen so long ago [s], how far away by depth or by their looks.
    """
    nearing, coming = wp.max(closing, 0.0), wp.max(coming, 0.0)
    if then_m < k.owner_m + wp.max(0.5 * nearing * nearing / k.brake, _CLIMBS_S * coming):
        return wp.max(_OVER_GAIN * (over_m - OVER_M), -k.escape_climb)
    if then_m < _HIGH_WITHIN_M and (age_s > _LATE_S or has_depth == 0):
        return wp.max(_OVER_GAIN * (over_m - _HIGH_M), -_RISE_M_S)
    return 100.0


@wp.struct
class Bounds:
    """What may be flown near somebody."""

    closing_max: float  # [m/s] towards them
    then_m: float  # how far away they are when the vehicle answers
    sinking_max: float  # [m/s]


@wp.func
def bounds(
    k: KeepOff,
    way: wp.vec2,
    own_vel: wp.vec3,
    other_vel: wp.vec2,
    vel_std: float,
    age_s: float,
    over_m: float,
    has_depth: int,
) -> Bounds:
    """All of the rule, of who was seen so long ago; as `closing_max` is asked, with a velocity in ned."""
    b = Bounds()
    level = wp.vec2(own_vel[0], own_vel[1])
    lost_m = k.reaction_s * own_vel[2]
    over_then_m = over_m - wp.max(lost_m, 0.0)  # height that it loses is none to keep off by; none that it gains, yet,
    b.closing_max = closing_max(k, way, level, other_vel, vel_std, age_s, over_then_m)
    b.then_m = distance_then(way, level, other_vel, k.reaction_s, age_s)
    unit = unit_of(way)
    closing, coming = wp.dot(level - other_vel, unit), -wp.dot(other_vel, unit)
    high_m = over_m - lost_m  # but to climb no farther
    b.sinking_max = sinking_max(k, high_m, b.then_m, closing, coming, age_s, has_depth)
    return b


@wp.struct
class Person:
    """Somebody near a vehicle, as they are known by now."""

    way: wp.vec2  # [m] to them
    vel: wp.vec2  # [m/s]
    vel_var: wp.mat22  # [m²/s²]
    age_s: float  # since they were seen
    over_m: float  # how far the vehicle is above their chest


@wp.struct
class Asked:
    """What one vehicle wants, near so many."""

    level: wp.vec2  # [m/s]
    own_vel: wp.vec3  # [m/s], ned
    people: int
    has_depth: int  # ranges are measured
    passes_over: wp.bool  # it keeps its height, and who is far enough below is in nobody's way


@wp.kernel(enable_backward=False)
def keep_off_all(
    k: KeepOff,
    asked: wp.array(dtype=Asked),
    people: wp.array(dtype=Person),
    kept: wp.array(dtype=wp.vec2),
    out: wp.array(dtype=Bounds),
) -> None:
    """The level velocity of one vehicle without what is too fast towards any of some people, and the bounds of each."""
    a = asked[0]
    level = a.level
    for i in range(a.people):
        p = people[i]
        b = bounds(k, p.way, a.own_vel, p.vel, std_along(p.vel_var, p.way), p.age_s, p.over_m, a.has_depth)
        out[i] = b
        if not (a.passes_over and p.over_m >= OVER_M):
            level = kept_off(level, p.way, b.closing_max)
    kept[0] = level
