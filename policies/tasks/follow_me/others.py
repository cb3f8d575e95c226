"""What others about are to a vehicle, in training: solid, like trees, and kept off, like the owner.

In flight a map of depth has them, and the guard keeps off whom the senses follow; in training both go by the truth.
"""

import warp as wp

from common.rotation import wrap_pi, yaw_from_quat
from policies.tasks.flight.own_state import Command, OwnState
from policies.tasks.flight.ranges import HULL_M, mark_round
from policies.tasks.follow_me.owner_visibility import reach_from
from policies.tasks.follow_me.tracked.guarding import kept_from
from policies.tasks.follow_me.tracked.keep_off import KeepOff
from sim.advance import RigArrays
from sim.truth import Truth
from sim.world.people import Person, chest_ned

wp.set_module_options({"enable_backward": False})

_BODY_M = wp.constant(0.25)  # from the middle of a person to their side
_VEL_STD_M_S = wp.constant(0.3)  # with which senses tell how somebody walks; guess
_HALF_VIEW_RAD = wp.constant(0.72)  # beside the nose, where an image shows them


@wp.func
def room_between(pos_ned: wp.vec3, other: Person) -> float:
    """Distance of a place from somebody's body [m]; far away from nobody's."""
    if other.stature_m <= 0.0:
        return float(wp.inf)
    return wp.max(reach_from(pos_ned, other) - _BODY_M, 0.0)


@wp.kernel(enable_backward=False)
def mark_others(
    rig: RigArrays, others: wp.array2d(dtype=Person), rows: wp.array(dtype=wp.bool), nearness: wp.array2d(dtype=float)
) -> None:
    """Adds others to the ranges of the chosen rows, where they stand in the vehicle's height.

    Args:
        rig: the vehicles.
        others: shape (vehicles, others); of no stature: nobody.
        rows: the chosen ones.
        nearness: `RANGE_ELEMENTS`, as `measure_ranges` left them.
    """
    i = wp.tid()
    if not rows[i]:
        return
    truth = rig.truth[i]
    yaw = yaw_from_quat(truth.q_ned_from_frd)
    for k in range(others.shape[1]):
        other = others[i, k]
        over_head_m = other.pos_ned[2] - other.stature_m - truth.pos_ned[2]
        if other.stature_m > 0.0 and over_head_m < HULL_M:
            way = wp.vec2(other.pos_ned[0] - truth.pos_ned[0], other.pos_ned[1] - truth.pos_ned[1])
            mark_round(way, _BODY_M, yaw, nearness, i)


@wp.func
def kept_from_others(
    command: Command,
    own: OwnState,
    truth: Truth,
    others: wp.array2d(dtype=Person),
    age_s: float,
    k: KeepOff,
    i: int,
) -> Command:
    """What is flown of a command near those whom the newest image shows, which is so old."""
    yaw = yaw_from_quat(truth.q_ned_from_frd)
    for j in range(others.shape[1]):
        other = others[i, j]
        way = chest_ned(other) - truth.pos_ned
        off_rad = wp.abs(wrap_pi(wp.atan2(way[1], way[0]) - yaw))
        if other.stature_m > 0.0 and off_rad < _HALF_VIEW_RAD:
            vel = wp.vec2(other.vel_ned[0], other.vel_ned[1])
            command = kept_from(command, own, way, vel, _VEL_STD_M_S, age_s, k)
    return command
