"""How vehicles of a flight stand to their owners: the truth that a track of a flight is made of.

The batch task has the same in its own measures; flights come from power-on, so that what a vehicle met before it began
to follow must not count.
"""

import warp as wp

from policies.tasks.follow_me.sight import see
from sim.advance import RigArrays
from sim.world.people import Person

wp.set_module_options({"enable_backward": False})

COLUMNS = ("distance_m", "bearing_rad", "is_in_view", "is_collided")


@wp.kernel(enable_backward=False)
def measure_rows(
    rig: RigArrays,
    people: wp.array(dtype=Person),
    touch_m: float,
    impact_before: float,
    out: wp.array2d(dtype=float),
) -> None:
    """The row of `COLUMNS` of each vehicle.

    Args:
        rig: the vehicles.
        people: the owner of each.
        touch_m: nearer to any part of the owner is a collision.
        impact_before: what speed of impact a vehicle had met before [m/s].
        out: shape (vehicles, columns).
    """
    i = wp.tid()
    body = rig.body[i]
    sight = see(rig.worlds[rig.i_world[i]], body, people[i])
    has_touched = body.impact_speed > impact_before or body.is_on_ground == 1 or body.is_crashed == 1
    out[i, 0] = sight.distance_m
    out[i, 1] = sight.bearing_rad
    out[i, 2] = float(sight.is_in_view)
    out[i, 3] = wp.where(has_touched or sight.reach_m < touch_m, 1.0, 0.0)
