"""What the guard makes of what a policy asks for, as far as it goes by people: the part that training has too.

In: the velocity asked for, the vehicle's own state, the owner's filter. Out: what is flown. What the guard does about
trees it does by a map, which training has not.
"""

import warp as wp

from policies.tasks.flight.own_state import Command, OwnState
from policies.tasks.follow_me.tracked.keep_off import (
    IMAGE_SLOW_S,
    IMAGE_STOP_S,
    SLOW_S,
    STOP_S,
    KeepOff,
    bounds,
    kept_off,
)
from policies.tasks.follow_me.tracked.owner_filter import OwnerFilter, place_now, std_along, velocity_now

wp.set_module_options({"enable_backward": False})

_SLOW_S, _STOP_S = wp.constant(SLOW_S), wp.constant(STOP_S)
_IMAGE_SLOW_S, _IMAGE_STOP_S = wp.constant(IMAGE_SLOW_S), wp.constant(IMAGE_STOP_S)


@wp.func
def kept_from(
    command: Command,
    own: OwnState,
    way: wp.vec3,
    vel: wp.vec2,
    vel_std: float,
    age_s: float,
    has_depth: int,
    k: KeepOff,
) -> Command:
    """What is flown of a command near somebody whose chest lies that way [m], seen so long ago."""
    level_way = wp.vec2(way[0], way[1])
    b = bounds(k, level_way, own.vel_ned, vel, vel_std, age_s, way[2], has_depth)
    level = kept_off(wp.vec2(command.vel_ned[0], command.vel_ned[1]), level_way, b.closing_max)
    command.vel_ned = wp.vec3(level[0], level[1], wp.min(command.vel_ned[2], b.sinking_max))
    return command


@wp.func
def faded(age_s: float, slow_s: float, stop_s: float) -> float:
    """What is left of a velocity, from all to nothing."""
    return wp.clamp((stop_s - age_s) / (stop_s - slow_s), 0.0, 1.0)


@wp.func
def guarded(
    command: Command, own: OwnState, owner: OwnerFilter, image_age_s: float, has_depth: int, k: KeepOff
) -> Command:
    """What is flown of a command, the newest image being so old."""
    command.vel_ned = faded(image_age_s, _IMAGE_SLOW_S, _IMAGE_STOP_S) * command.vel_ned
    if owner.is_known == 0:
        return command
    command.vel_ned = faded(owner.age_s, _SLOW_S, _STOP_S) * command.vel_ned
    way = place_now(owner) - own.pos_ned
    std = std_along(owner.both.vel_var, wp.vec2(way[0], way[1]))
    return kept_from(command, own, way, velocity_now(owner), std, owner.age_s, has_depth, k)
