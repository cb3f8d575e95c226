"""How vehicles of a flight stand to their owners: the truth that a track of a flight is made of.

The batch task has the same in its own measures.
"""

import warp as wp

from policies.tasks.follow_me.owner_visibility import see
from sim.advance import RigArrays
from sim.truth import has_touched
from sim.world.people import Person

wp.set_module_options({"enable_backward": False})

COLUMNS = ("distance_m", "bearing_rad", "is_in_view", "is_collided")


@wp.kernel(enable_backward=False)
def measure_rows(rig: RigArrays, people: wp.array(dtype=Person), touch_m: float, out: wp.array2d(dtype=float)) -> None:
    """The row of `COLUMNS` of each vehicle.

    Args:
        rig: the vehicles, their impacts forgotten when they began to follow.
        people: the owner of each.
        touch_m: nearer to any part of the owner is a collision.
        out: shape (vehicles, columns).
    """
    i = wp.tid()
    truth = rig.truth[i]
    sight = see(rig.worlds[rig.i_world[i]], truth, people[i])
    out[i, 0] = sight.distance_m
    out[i, 1] = sight.bearing_rad
    out[i, 2] = float(sight.is_in_view)
    out[i, 3] = wp.where(has_touched(truth) or sight.reach_m < touch_m, 1.0, 0.0)
