"""How fast a vehicle may come nearer to somebody: the guard's rule, and what policies are trained under.

Whoever walks away may have begun to stop when they were seen last; the way that takes them is room for the vehicle to
stop in, after its reaction: the safe distance of responsibility-sensitive safety (Shalev-Shwartz et al. 2017, arXiv
1708.06374), with late pictures. Whoever comes is given way to. One source: a guard calls these functions from Python,
training in kernels.
"""

from typing import Any

import warp as wp

wp.set_module_options({"enable_backward": False})

OWNER_M = 1.0  # [m] to the middle of the person: it comes no nearer
OWNER_BRAKE_M_S2 = 4.5  # with which the vehicle is taken to brake before them
REACTION_S = 0.35  # from a setpoint to the motion, besides the age of the picture; measured on the x500
ESCAPE_CLIMB_M_S = 1.5  # nearer than allowed, until it is over their head
_OVER_M = wp.constant(1.45)  # so far above their chest it is
_OVER_GAIN = wp.constant(2.0)  # [1/s]
SLOW_S, STOP_S = 0.7, 2.0  # without a sight of them for so long it becomes slower, until it stands
_UNTOLD_S = wp.constant(0.8)  # who sets off is thought of for so long: from then on there are no pictures
_STOPS_M_S2 = wp.constant(2.5)  # how fast a person stops, and sets off; guess
_DOUBT_M_S = wp.constant(0.2)  # of the speed that the tracker says; guess
_BACK_GAIN = wp.constant(3.0)  # [1/s]
_BACK_MAX_M_S = wp.constant(4.0)


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
def stopping_speed(room_m: float, delay_s: float, brake: float) -> float:
    """The speed [m/s] from which one stands within a way [m], braking at so much [m/s²] after a delay [s]."""
    lag = brake * delay_s
    return wp.sqrt(lag * lag + 2.0 * brake * wp.max(room_m, 0.0)) - lag


@wp.func
def come_m(delay_s: float) -> float:
    """How much nearer somebody comes who sets off now [m]."""
    untold_s = wp.min(delay_s, _UNTOLD_S)
    return 0.5 * _STOPS_M_S2 * untold_s * untold_s


@wp.func
def distance_then(way: wp.vec2, own_vel: wp.vec2, other_vel: wp.vec2, delay_s: float) -> float:
    """How far away they are [m] when the vehicle answers, if both go on and they come at it besides."""
    far_m = wp.max(wp.length(way), 1.0e-3)
    return far_m - delay_s * wp.max(wp.dot(own_vel - other_vel, way) / far_m, 0.0) - come_m(delay_s)


@wp.func
def level_m(k: KeepOff, over_m: float) -> float:
    """How near it may come on the level [m], so far above their chest: an ellipsoid about them, free of it above."""
    fraction = wp.clamp(over_m / _OVER_M, 0.0, 1.0)
    return k.owner_m * wp.sqrt(1.0 - fraction * fraction)


@wp.func
def closing_max(k: KeepOff, way: wp.vec2, own_vel: wp.vec2, other_vel: wp.vec2, age_s: float, over_m: float) -> float:
    """How fast it may come nearer to somebody [m/s]; negative: it has to give way.

    `way` leads to where they would be by now [m]; `own_vel` it has until it answers; `age_s` ago they were seen;
    so far above their chest.
    """
    far_m = wp.max(wp.length(way), 1.0e-3)
    leaving = wp.dot(other_vel, way) / far_m
    room_m = far_m - level_m(k, over_m)
    given = wp.min(leaving, 0.0)
    if leaving > 0.0:
        sure = wp.max(leaving - _DOUBT_M_S, 0.0)
        room_m += 0.5 * sure * sure / _STOPS_M_S2 - leaving * age_s
    else:
        room_m += leaving * (age_s + k.reaction_s)
    room_m -= come_m(wp.max(age_s + k.reaction_s - wp.max(leaving, 0.0) / _STOPS_M_S2, 0.0))
    left_m = room_m - k.reaction_s * wp.max(wp.dot(own_vel, way) / far_m, 0.0)
    if left_m > 0.0:
        return given + wp.min(stopping_speed(room_m, k.reaction_s, k.brake), stopping_speed(left_m, 0.0, k.brake))
    return wp.max(given + _BACK_GAIN * left_m, -_BACK_MAX_M_S)


@wp.func
def kept_off(velocity: wp.vec2, way: wp.vec2, most: float) -> wp.vec2:
    """A level velocity without what is faster towards somebody than it may be [m/s]."""
    unit = way / wp.max(wp.length(way), 1.0e-3)
    return velocity - wp.max(wp.dot(velocity, unit) - most, 0.0) * unit


@wp.func
def sinking_max(k: KeepOff, over_m: float, then_m: float) -> float:
    """How fast it may sink [m/s], so far above their chest and so near; negative: it has to climb."""
    if then_m < k.owner_m:
        return wp.max(_OVER_GAIN * (over_m - _OVER_M), -k.escape_climb)
    return 100.0


@wp.struct
class Bounds:
    """What may be flown near somebody."""

    closing_max: float  # [m/s] towards them
    then_m: float  # how far away they are when the vehicle answers
    sinking_max: float  # [m/s]


@wp.func
def bounds(k: KeepOff, way: wp.vec2, own_vel: wp.vec2, other_vel: wp.vec2, age_s: float, over_m: float) -> Bounds:
    """All of the rule, of who was seen so long ago; as `closing_max` is asked."""
    b = Bounds()
    b.closing_max = closing_max(k, way, own_vel, other_vel, age_s, over_m)
    b.then_m = distance_then(way, own_vel, other_vel, k.reaction_s + age_s)
    b.sinking_max = sinking_max(k, over_m, b.then_m)
    return b
