"""How vehicles of a flight stand to their owners: the truth that a track of a flight is made of.

The batch task has the same in its own measures.
"""

import warp as wp

from policies.tasks.follow_me.follow_me_params import FollowParams
from policies.tasks.follow_me.owner_visibility import reach_from, see
from sim.truth import Truth, has_touched
from sim.world.people import Person
from sim.world.world import World

wp.set_module_options({"enable_backward": False})

_STANDING_M_S = wp.constant(0.1)  # guess

COLUMNS = ("distance_m", "bearing_rad", "is_in_view", "is_collided")


@wp.kernel(enable_backward=False)
def measure_rows(
    worlds: wp.array(dtype=World),
    i_world: wp.array(dtype=wp.int32),
    truths: wp.array(dtype=Truth),
    params: wp.array(dtype=FollowParams),
    people: wp.array(dtype=Person),
    bystanders: wp.array2d(dtype=Person),
    drawn: wp.array2d(dtype=Person),
    drives: int,
    touch_m: float,
    out: wp.array2d(dtype=float),
) -> None:
    """The row of `COLUMNS` of each vehicle.

    Args:
        worlds: where they are.
        i_world: the world of each.
        truths: the vehicles, their impacts forgotten when they began to follow.
        params: of the following.
        people: the owner of each.
        bystanders: others, a row for each vehicle.
        drawn: all of them as cameras can see them, the owner first.
        drives: 1 if they stand on the ground, and may touch it; who walks into one that stands has not been run into.
        touch_m: nearer to any part of the owner is a collision.
        out: shape (vehicles, columns).
    """
    i = wp.tid()
    truth = truths[i]
    if drives == 1:
        truth.is_on_ground = 0
    is_standing = drives == 1 and wp.length(truth.vel_ned) < _STANDING_M_S
    sight = see(worlds[i_world[i]], truth, params[i], people[i], drawn[i, 0])
    reach_m = sight.reach_m
    for k in range(bystanders.shape[1]):
        if bystanders[i, k].stature_m > 0.0:
            reach_m = wp.min(reach_m, reach_from(truth.pos_ned, bystanders[i, k]))
    out[i, 0] = sight.distance_m
    out[i, 1] = sight.bearing_rad
    out[i, 2] = float(sight.is_in_view)
    out[i, 3] = wp.where(has_touched(truth) or (reach_m < touch_m and not is_standing), 1.0, 0.0)
