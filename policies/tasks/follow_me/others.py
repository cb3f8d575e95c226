"""What others about are to a vehicle, in training: solid, like trees, and kept off, like the owner.

To critic and teacher by the truth. To a policy without images as its senses would have them: on the map of depth where
an image showed them last, and kept off by the guard's rule for as long as it follows them.
"""

import warp as wp

from common.rotation import wrap_pi, yaw_from_quat
from policies.tasks.flight.own_state import Command, OwnState
from policies.tasks.flight.ranges import HULL_M, mark_round, mark_sectors
from policies.tasks.follow_me.follow_me_params import FollowParams
from policies.tasks.follow_me.observe import DECISION_S
from policies.tasks.follow_me.owner_visibility import lens_in, reach_from
from policies.tasks.follow_me.tracked.guarding import kept_from
from policies.tasks.follow_me.tracked.keep_off import KeepOff
from policies.tasks.follow_me.tracked.sight_model import HALF_VIEW_RAD, OTHERS, Tracked, has_depth, is_covered
from sim.advance import RigArrays
from sim.truth import Truth
from sim.world.people import Person, chest_ned, is_line_free
from sim.world.world import World

wp.set_module_options({"enable_backward": False})

_BODY_M = wp.constant(0.25)  # from the middle of a person to their side
_VEL_STD_M_S = wp.constant(0.3)  # with which senses tell how somebody walks; guess
_WALKS_M_S = wp.constant(0.7)  # with depth who is slower is the map's, in flight too
_LATELY_S = wp.constant(0.55)  # they are followed for so long after they were seen
_SOLID_S = wp.constant(15.0)  # and their last place is solid for so long, or until an image shows it without them
_NEVER_S = wp.constant(1.0e6)
_DECISION_S = wp.constant(DECISION_S)
_OTHERS = wp.constant(OTHERS)


@wp.func
def room_between(pos_ned: wp.vec3, other: Person) -> float:
    """Distance of a place from somebody's body [m]; far away from nobody's."""
    if other.stature_m <= 0.0:
        return float(wp.inf)
    return wp.max(reach_from(pos_ned, other) - _BODY_M, 0.0)


@wp.func
def off_nose(way: wp.vec3, yaw: float) -> float:
    """How far beside the nose a way leads [rad]."""
    return wp.abs(wrap_pi(wp.atan2(way[1], way[0]) - yaw))


@wp.func
def is_beside(pos_ned: wp.vec3, other: Person) -> bool:
    """Whether somebody is in the height of a vehicle, not below it."""
    return other.stature_m > 0.0 and other.pos_ned[2] - other.stature_m - pos_ned[2] < HULL_M


@wp.kernel(enable_backward=False)
def mark_others(
    rig: RigArrays, drawn: wp.array2d(dtype=Person), rows: wp.array(dtype=wp.bool), nearness: wp.array2d(dtype=float)
) -> None:
    """Adds others to the ranges of the chosen rows: the truth.

    Args:
        rig: the vehicles.
        drawn: shape (vehicles, 1 + others), the owner first; of no stature: nobody.
        rows: the chosen ones.
        nearness: `RANGE_ELEMENTS`, as `measure_ranges` left them.
    """
    i = wp.tid()
    if not rows[i]:
        return
    truth = rig.truth[i]
    yaw = yaw_from_quat(truth.q_ned_from_frd)
    for k in range(1, drawn.shape[1]):
        way = drawn[i, k].pos_ned - truth.pos_ned
        if is_beside(truth.pos_ned, drawn[i, k]):
            mark_round(wp.vec2(way[0], way[1]), _BODY_M, yaw, nearness, i)


@wp.func
def is_shown(w: World, truth: Truth, eye_ned: wp.vec3, other: Person, owner: Person) -> bool:
    """Whether an image shows somebody, and not the owner before them."""
    chest = chest_ned(other)
    if other.stature_m <= 0.0 or off_nose(chest - truth.pos_ned, yaw_from_quat(truth.q_ned_from_frd)) > HALF_VIEW_RAD:
        return False
    return not is_covered(eye_ned, chest, owner) and is_line_free(w, eye_ned, chest)


@wp.kernel(enable_backward=False)
def see_others(
    rig: RigArrays,
    params: wp.array(dtype=FollowParams),
    drawn: wp.array2d(dtype=Person),
    tracked: Tracked,
    is_first: int,
    rows: wp.array(dtype=wp.bool),
) -> None:
    """Takes in where the newest image shows others, and adds them to what the map knows; after `sense`.

    Args:
        rig: the vehicles.
        params: of the episodes.
        drawn: as of `mark_others`.
        tracked: what of the senses is kept.
        is_first: 1 where episodes begin.
        rows: the chosen ones.
    """
    i = wp.tid()
    if not rows[i]:
        return
    truth = rig.truth[i]
    n = params[i]
    yaw = yaw_from_quat(truth.q_ned_from_frd)
    eye = lens_in(truth, n).pos_ned
    for k in range(_OTHERS):
        other = drawn[i, k + 1]
        age_s = wp.where(is_first == 1, _NEVER_S, tracked.others_age_s[i, k] + _DECISION_S)
        if is_shown(rig.worlds[rig.i_world[i]], truth, eye, other, drawn[i, 0]):
            age_s = 0.0
            tracked.others_ned[i, k] = other.pos_ned
        way = tracked.others_ned[i, k] - truth.pos_ned
        if age_s > 0.0 and off_nose(way, yaw) < HALF_VIEW_RAD:  # they have gone from there
            age_s = wp.max(age_s, _SOLID_S)
        tracked.others_age_s[i, k] = age_s
        far_m = wp.sqrt(way[0] * way[0] + way[1] * way[1])
        if age_s < _SOLID_S and has_depth(n) and far_m < n.depth_max_m and is_beside(truth.pos_ned, other):
            mark_sectors(wp.vec2(way[0], way[1]), _BODY_M, yaw, tracked.nearness, i)


@wp.func
def kept_from_others(
    command: Command,
    own: OwnState,
    truth: Truth,
    drawn: wp.array2d(dtype=Person),
    tracked: Tracked,
    image_age_s: float,
    k: KeepOff,
    i: int,
) -> Command:
    """What is flown of a command near those who were seen lately, the newest image being so old."""
    for j in range(_OTHERS):
        other = drawn[i, j + 1]
        age_s = tracked.others_age_s[i, j] + image_age_s
        walks = wp.length(other.vel_ned) > _WALKS_M_S or tracked.has_depth[i] == 0
        if other.stature_m > 0.0 and age_s < _LATELY_S and walks:
            vel = wp.vec2(other.vel_ned[0], other.vel_ned[1])
            way = chest_ned(other) - truth.pos_ned
            command = kept_from(command, own, way, vel, _VEL_STD_M_S, age_s, tracked.has_depth[i], k)
    return command
