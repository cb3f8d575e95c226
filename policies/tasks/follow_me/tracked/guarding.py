"""What the guard makes of what a policy asks for, as far as it goes by the owner: the part that training has too.

In: the velocity asked for, the vehicle's own state, the owner's filter. Out: what is flown. What the
guard does about trees it does by a map, which training has not.
"""

import warp as wp

from policies.tasks.flight.own_state import Command, OwnState
from policies.tasks.follow_me.tracked.keep_off import SLOW_S, STOP_S, KeepOff, bounds, kept_off
from policies.tasks.follow_me.tracked.owner_filter import OwnerFilter, place_now, std_along, velocity_now

wp.set_module_options({"enable_backward": False})

_SLOW_S, _STOP_S = wp.constant(SLOW_S), wp.constant(STOP_S)


@wp.func
def guarded(command: Command, own: OwnState, owner: OwnerFilter, k: KeepOff) -> Command:
    """What is flown of a command."""
    if owner.is_known == 0:
        return command
    scale = wp.clamp((_STOP_S - owner.age_s) / (_STOP_S - _SLOW_S), 0.0, 1.0)
    place = place_now(owner)
    way = wp.vec2(place[0] - own.pos_ned[0], place[1] - own.pos_ned[1])
    over_m = place[2] - own.pos_ned[2]
    b = bounds(k, way, own.vel_ned, velocity_now(owner), std_along(owner.both.vel_var, way), owner.age_s, over_m)
    level = kept_off(scale * wp.vec2(command.vel_ned[0], command.vel_ned[1]), way, b.closing_max)
    command.vel_ned = wp.vec3(level[0], level[1], wp.min(scale * command.vel_ned[2], b.sinking_max))
    return command
