"""What the chain of detector, depth and map makes of a decision's truth, without a picture: the model for training.

In: where the owner truly is, the numbers of the episode, how near solid things truly are. Out: the sight that each
picture would have been, the filter fed with those that have come, and what a map would know. Its figures are measured
on flights with the real chain (docs/explanation/following.md).
"""

import math
from collections.abc import Callable
from typing import Any

import warp as wp

from common.rng import draw_key
from common.rotation import wrap_pi, yaw_from_quat
from policies.tasks.flight.flown_vehicle import own_state
from policies.tasks.flight.own_state import Command, ned_from_level
from policies.tasks.follow_me.cast import PEOPLE_MAX
from policies.tasks.follow_me.follow_me_params import FollowParams
from policies.tasks.follow_me.image_way import Way
from policies.tasks.follow_me.observe import DECISION_S, TILT_DEG
from policies.tasks.follow_me.owner_visibility import HALF_WIDTH, Sight
from policies.tasks.follow_me.tracked.owner_filter import OwnerFilter, seen, waited
from policies.tasks.follow_me.tracked.vector import REACH_M, SECTORS
from sim.advance import RigArrays
from sim.world.people import Person

wp.set_module_options({"enable_backward": False})

OTHERS = PEOPLE_MAX - 1
KEPT = wp.constant(10)  # sights on their way, as of pictures
_SECTORS = wp.constant(SECTORS)
_SECTOR_RAD = wp.constant(6.2831853 / float(SECTORS))
_DECISION_S = wp.constant(DECISION_S)
_STREAM = wp.constant(21)
_EPISODE_STREAM = wp.constant(22)
_ALONG_BIAS_M = wp.constant(0.05)  # standard deviation from episode to episode, with depth
_ALONG_M, _ALONG_FRACTION = wp.constant(0.045), wp.constant(0.01)
_COLOUR_BIAS, _COLOUR_FRACTION = wp.constant(0.12), wp.constant(0.13)  # of the range by colours alone
_RADIANS = wp.constant(0.0174532925)
_TILT = wp.constant(math.tan(math.radians(-TILT_DEG)))  # of the camera, down, per metre ahead
_ACROSS_RAD, _ACROSS_BIAS_RAD = wp.constant(0.016), wp.constant(0.01)
_DOWN_BIAS_M, _DOWN_M = wp.constant(0.1), wp.constant(0.09)
_MISS = wp.constant(0.01)
_MISS_NEAR_M, _MISS_NEAR = wp.constant(1.0), wp.constant(0.15)
_MISS_FAR_M, _MISS_PER_M = wp.constant(3.0), wp.constant(0.05)  # farther away more and more are missed
_MISS_DARK = wp.constant(0.1)  # with all the gain there is, or all the blur
_STRAY = wp.constant(0.01)  # of the sights are something else beside the owner,
_STRAY_M = wp.constant(0.4)
_STOLEN_M = wp.constant(0.9)  # so near the owner somebody else may be taken for them,
_STOLEN = wp.constant(0.3)
_HIDES_M = wp.constant(0.35)  # beside the line of sight somebody else hides them
_HOLD = wp.constant(150)  # decisions for which a map remembers
HALF_VIEW_RAD = wp.constant(0.72)
_FORGETS = wp.constant(0.9933)  # of the way flown, a decision: what fifteen seconds' map is good for
_IN_A_ROW = wp.constant(4)  # images that must show them, after so long without:
_GONE_S = wp.constant(1.0)
_MISSED = wp.constant(3)  # with no more than so many between two that do not
_MAP_STD_M = wp.constant(0.12)
_MAP_COLOUR_STD = wp.constant(0.08)  # of the range, by colours: `policies.mono_depth.training --judge`


@wp.struct
class Tracked:
    """One row per environment; in other presets unused."""

    commands: wp.array(dtype=Command)  # as asked for last
    before: wp.array(dtype=Command)  # and by the decision before
    filters: wp.array(dtype=OwnerFilter)
    sights_ned: wp.array2d(dtype=wp.vec3)  # (envs, KEPT) chests, as pictures under way show them
    eyes_ned: wp.array2d(dtype=wp.vec3)
    kinds: wp.array2d(dtype=int)  # 0: nobody seen, 1: range by colours, 2: by depth
    shown: wp.array(dtype=int)  # the picture that was taken in last
    looked: wp.array2d(dtype=int)  # (envs, SECTORS) pictures since each direction of the world was looked at
    trails_ned: wp.array(dtype=wp.vec2)  # [m] the way that it flew as it looked, lately
    in_row: wp.array(dtype=int)  # images that showed the owner, one after the other
    missed: wp.array(dtype=int)  # and those since that did not
    nearness: wp.array2d(dtype=float)  # (envs, SECTORS) as a map knows it
    has_depth: wp.array(dtype=int)  # it is measured, not told from colours
    others_ned: wp.array2d(dtype=wp.vec3)  # (envs, others) where images showed them last
    others_age_s: wp.array2d(dtype=float)  # since then


def make_tracked(zeros: Callable[[str, Any, Any], Any], count: int) -> Any:
    """The arrays, of so many rows."""
    tracked, kept = Tracked(), int(KEPT)
    tracked.commands = zeros("commands", count, Command)
    tracked.before = zeros("commands_before", count, Command)
    tracked.filters = zeros("owner_filters", count, OwnerFilter)
    tracked.sights_ned = zeros("sights_ned", (count, kept), wp.vec3)
    tracked.eyes_ned = zeros("sight_eyes_ned", (count, kept), wp.vec3)
    tracked.kinds = zeros("sight_kinds", (count, kept), int)
    tracked.shown = zeros("sights_shown", count, int)
    tracked.looked = zeros("looked", (count, SECTORS), int)
    tracked.trails_ned = zeros("trails_ned", count, wp.vec2)
    tracked.in_row = zeros("in_row", count, int)
    tracked.missed = zeros("missed", count, int)
    tracked.nearness = zeros("mapped_nearness", (count, SECTORS), float)
    tracked.has_depth = zeros("has_depth", count, int)
    tracked.others_ned = zeros("others_ned", (count, OTHERS), wp.vec3)
    tracked.others_age_s = zeros("others_age", (count, OTHERS), float)
    return tracked


@wp.func
def is_covered(eye_ned: wp.vec3, chest_ned: wp.vec3, other: Person) -> bool:
    """Whether somebody stands before the owner."""
    if other.stature_m <= 0.0:
        return False
    way = wp.vec2(chest_ned[0] - eye_ned[0], chest_ned[1] - eye_ned[1])
    off = wp.vec2(other.pos_ned[0] - eye_ned[0], other.pos_ned[1] - eye_ned[1])
    far_m = wp.max(wp.length(way), 1.0e-3)
    along = wp.dot(off, way) / far_m
    aside = wp.abs(off[0] * way[1] - off[1] * way[0]) / far_m
    return along > 0.2 and along < far_m - 0.2 and aside < _HIDES_M


@wp.func
def has_depth(n: FollowParams) -> bool:
    """Whether an episode's images have depth anywhere."""
    return n.depth_max_m > 1.0


@wp.func
def miss_chance(n: FollowParams, distance_m: float) -> float:
    """That a picture of the owner shows nobody."""
    chance = _MISS + _MISS_PER_M * wp.max(distance_m - _MISS_FAR_M, 0.0)
    if distance_m < _MISS_NEAR_M:
        chance += _MISS_NEAR
    chance += _MISS_DARK * wp.max(1.0 - n.light, n.shutter_s / 0.033) + 0.05 * n.depth_holes
    return wp.min(chance, 0.6)


@wp.func
def sight_drawn(
    n: FollowParams, sight: Sight, yaw: float, own_ned: wp.vec3, is_measured: int, seed: int, i: int, k: int
) -> wp.vec3:
    """Where picture k shows the owner's chest."""
    state = draw_key(seed, i, k, _STREAM)
    fixed = draw_key(seed, i, 0, _EPISODE_STREAM)
    p = sight.position_hfrd + wp.vec3(0.0, 0.0, sight.lower_m)
    level_m = wp.max(wp.sqrt(p[0] * p[0] + p[1] * p[1]), 1.0e-3)
    noise = n.camera_noise
    along = _ALONG_BIAS_M * wp.randn(fixed) + noise * (_ALONG_M + _ALONG_FRACTION * level_m) * wp.randn(state)
    bias = _COLOUR_BIAS * wp.randn(fixed)
    if is_measured == 0:
        along = level_m * (bias + noise * _COLOUR_FRACTION * wp.randn(state))
    aside = level_m * (_ACROSS_BIAS_RAD * wp.randn(fixed) + noise * _ACROSS_RAD * wp.randn(state))
    down = _DOWN_BIAS_M * wp.randn(fixed) + _DOWN_M * wp.randn(state)
    across = p[0] / level_m  # of what is aside in the image
    aside += p[1] * across * (1.0 / n.lens_scale - 1.0)  # where a lens shows them that is taken for the usual one
    down += level_m * wp.tan(n.lens_tilt_deg * _RADIANS)
    if n.lens_distortion != 0.0 and sight.is_in_view == 1:
        ahead = wp.max(p[0], 0.1)
        below = p[2] - ahead * _TILT
        off = wp.vec2(p[1], below) / (ahead * HALF_WIDTH)  # from the image's middle, in halves of its width
        shown = float(1.0)  # times as far from the middle as it is without: `undistorted`, the other way round
        for _ in range(3):
            shown = (1.0 + n.lens_distortion) / (1.0 + n.lens_distortion * shown * shown * wp.dot(off, off))
        aside += p[1] * across * (shown - 1.0)
        down += below * (shown - 1.0)
    out = p * (1.0 + wp.max(along / level_m, -0.5)) + wp.vec3(-p[1] / level_m * aside, p[0] / level_m * aside, down)
    if wp.randf(state) < _STRAY:
        out += wp.vec3(_STRAY_M * wp.randn(state), _STRAY_M * wp.randn(state), 0.0)
    return own_ned + ned_from_level(out, yaw)


@wp.func
def map_known(
    n: FollowParams, tracked: Tracked, nearness: wp.array2d(dtype=float), yaw: float, seed: int, i: int, k: int
) -> None:
    """What the map knows of how near things are: by depth, or by colours if there is none."""
    state = draw_key(seed, i, k, _STREAM + 1)
    tracked.has_depth[i] = int(has_depth(n))
    reach_m = wp.where(has_depth(n), n.depth_max_m, REACH_M)
    for j in range(_SECTORS):
        off = wp.abs(wrap_pi(float(j) * _SECTOR_RAD - yaw))
        tracked.looked[i, j] = wp.where(off < HALF_VIEW_RAD, 0, tracked.looked[i, j] + 1)
    turn = int(wp.round(yaw / _SECTOR_RAD))
    for j in range(_SECTORS):
        near = nearness[i, j]
        far_m = REACH_M * (1.0 - near)
        absolute = ((j + turn) % _SECTORS + _SECTORS) % _SECTORS
        bearing = yaw + float(j) * _SECTOR_RAD
        lies = far_m * wp.vec2(wp.cos(bearing), wp.sin(bearing))
        is_known = tracked.looked[i, absolute] < _HOLD or was_passed(lies, tracked.trails_ned[i])
        std_m = wp.where(has_depth(n), _MAP_STD_M, _MAP_COLOUR_STD * far_m)
        known = wp.where(is_known and near > 0.0 and far_m < reach_m, 1.0, 0.0)
        tracked.nearness[i, j] = known * wp.clamp(near + std_m / REACH_M * wp.randn(state), 0.0, 1.0)


@wp.func
def was_passed(off: wp.vec2, trail: wp.vec2) -> bool:
    """Whether something that lies so [m] was in view ahead, 45 degrees to either side, on the way to here."""
    far_m = wp.length(trail)
    if far_m < 0.1:
        return False
    along = wp.dot(off, trail) / far_m
    aside = wp.abs(off[0] * trail[1] - off[1] * trail[0]) / far_m
    return far_m + along > aside


@wp.func
def is_believed(tracked: Tracked, i: int, is_there: bool) -> bool:
    """Whether an image that shows the owner is taken in: after some time without, only the last of some in a row."""
    if not is_there:
        tracked.missed[i] = tracked.missed[i] + 1
        if tracked.missed[i] > _MISSED:
            tracked.in_row[i] = 0
        return False
    tracked.missed[i] = 0
    tracked.in_row[i] = tracked.in_row[i] + 1
    f = tracked.filters[i]
    return f.is_known == 0 or f.age_s < _GONE_S or tracked.in_row[i] >= _IN_A_ROW


@wp.kernel(enable_backward=False)
def sense(
    rig: RigArrays,
    has_estimator: int,
    params: wp.array(dtype=FollowParams),
    sights: wp.array(dtype=Sight),
    drawn: wp.array2d(dtype=Person),
    nearness: wp.array2d(dtype=float),
    seeds: wp.array(dtype=int),
    way: Way,
    tracked: Tracked,
    is_first: int,
    rows: wp.array(dtype=wp.bool),
) -> None:
    """Takes the sight of a new picture, and takes in what has come; after `note` of the pictures' way."""
    i = wp.tid()
    if not rows[i]:
        return
    n = params[i]
    own = own_state(rig, i, has_estimator)
    yaw = yaw_from_quat(own.q_ned_from_frd)
    k = way.count[i] - 1
    if is_first == 1:
        tracked.filters[i] = OwnerFilter()
        tracked.commands[i] = Command()
        tracked.before[i] = Command()
        tracked.shown[i] = -1
        tracked.trails_ned[i] = wp.vec2()
        tracked.in_row[i] = 0
        tracked.missed[i] = 0
        for j in range(_SECTORS):
            tracked.looked[i, j] = _HOLD
    nose = wp.vec2(wp.cos(yaw), wp.sin(yaw))
    ahead = wp.max(nose[0] * own.vel_ned[0] + nose[1] * own.vel_ned[1], 0.0)
    tracked.trails_ned[i] = _FORGETS * tracked.trails_ned[i] + _DECISION_S * ahead * nose
    map_known(n, tracked, nearness, yaw, seeds[i], i, k)
    take(n, sights[i], drawn, own.pos_ned, yaw, seeds[i], i, k, tracked)
    tracked.filters[i] = waited(tracked.filters[i], _DECISION_S)
    shown = way.shown[i]
    if shown > tracked.shown[i]:
        tracked.shown[i] = shown
        at = shown % KEPT
        kind = tracked.kinds[i, at]
        if is_believed(tracked, i, kind > 0):
            place, eye = tracked.sights_ned[i, at], tracked.eyes_ned[i, at]
            tracked.filters[i] = seen(tracked.filters[i], place, eye, kind - 1, way.age_s[i])


@wp.func
def take(
    n: FollowParams,
    sight: Sight,
    drawn: wp.array2d(dtype=Person),
    own_ned: wp.vec3,
    yaw: float,
    seed: int,
    i: int,
    k: int,
    tracked: Tracked,
) -> None:
    """The sight of picture k."""
    slot = k % KEPT
    state = draw_key(seed, i, k, _STREAM + 2)
    chest_ned = own_ned + ned_from_level(sight.position_hfrd, yaw)
    is_seen = sight.is_in_view == 1 and wp.randf(state) >= miss_chance(n, sight.distance_m)
    is_measured = int(sight.distance_m < n.depth_max_m and wp.randf(state) >= n.depth_holes)
    place = sight_drawn(n, sight, yaw, own_ned, is_measured, seed, i, k)
    for j in range(1, drawn.shape[1]):
        other = drawn[i, j]
        if is_covered(own_ned, chest_ned, other):
            is_seen = False
        off = wp.vec2(other.pos_ned[0] - chest_ned[0], other.pos_ned[1] - chest_ned[1])
        if other.stature_m > 0.0 and wp.length(off) < _STOLEN_M and wp.randf(state) < _STOLEN:
            place = place + wp.vec3(off[0], off[1], 0.0)
    tracked.sights_ned[i, slot] = place
    tracked.eyes_ned[i, slot] = own_ned
    tracked.kinds[i, slot] = wp.where(is_seen, 1 + is_measured, 0)
