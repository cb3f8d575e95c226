"""A scanning rangefinder on board: the nearest return in each of 48 sectors of 5 degrees, and four tilted beams.

Sectors are those of MAVLink's OBSTACLE_DISTANCE: 120 degrees to either side of the nose, levelled, of what stands
within `BAND_M` above or below the vehicle. The beams look along the nose, up and down. What is left out: the time a
turn of the scanner takes, and errors of the levelling, which stay within the band. True places, since it is a sensor;
each value has an error of its own, and now and then there is no return.
"""

import math

import warp as wp

from common.rng import draw_key, draw_tick
from common.rotation import yaw_from_quat
from policies.tasks.layout import Element
from policies.tasks.navigate.navigate_params import NavigateParams
from sim.advance import RigArrays
from sim.world.growing import bucket_of
from sim.world.trees import Forest, Tree
from sim.world.world import ray_hit

wp.set_module_options({"enable_backward": False})

SECTORS = 48
BEAM_ELEVATIONS_DEG = (-30.0, -12.0, 12.0, 30.0)
RANGES = SECTORS + len(BEAM_ELEVATIONS_DEG)
SECTOR_RAD = wp.constant(math.radians(5.0))
RANGE_M = wp.constant(14.0)  # guess: a small scanner or depth camera under leaves
BAND_M = wp.constant(0.4)  # the hull and a little
_SECTORS = wp.constant(SECTORS)
_RANGES = wp.constant(RANGES)
_FIRST_RAD = wp.constant(-0.5 * SECTORS * math.radians(5.0))
_ELEVATIONS = wp.constant(wp.vec4(*(math.radians(angle) for angle in BEAM_ELEVATIONS_DEG)))
_STREAM = wp.constant(202)  # of the rig's seeds
_STD_FRACTION = wp.constant(0.02)  # of the range, for a noise of 1; Intel D435: below 2 % up to 2 m
_MISSES = wp.constant(0.01)  # fraction of sectors without a return, for a noise of 1; guess
_UNIFORM_HALF = wp.constant(math.sqrt(3.0))  # half the width of a uniform draw of unit variance

RANGE_ELEMENTS = (
    *(Element(f"nearness_{5 * k - 118:+d}_deg", "1") for k in range(SECTORS)),
    *(Element(f"nearness_ahead_{angle:+.0f}_deg", "1") for angle in BEAM_ELEVATIONS_DEG),
)


@wp.func
def slice_radius(tree: Tree, height: float) -> float:
    """Radius of what a tree holds within the band about a height above the home plane [m]."""
    off_up = wp.max(wp.max(tree.crown_low - height, height - tree.crown_high) - BAND_M, 0.0)
    crown = tree.crown_radius * tree.crown_radius - off_up * off_up
    radius = wp.sqrt(wp.max(crown, 0.0))
    if height - BAND_M < tree.crown_low:
        radius = wp.max(radius, tree.trunk_radius)
    return radius


@wp.func
def add_tree(tree: Tree, pos_ned: wp.vec3, heading: float, ranges_m: wp.array2d(dtype=float), i: int) -> None:
    """Shortens the ranges of the sectors that a tree reaches into: exactly, the nearest of all returns in each."""
    north = tree.north - pos_ned[0]
    east = tree.east - pos_ned[1]
    distance = wp.sqrt(north * north + east * east)
    radius = slice_radius(tree, -pos_ned[2])
    if radius <= 0.0 or distance - radius > RANGE_M:
        return
    if distance <= radius:
        for k in range(_SECTORS):
            ranges_m[i, k] = 0.0
        return
    off = wp.atan2(east, north) - heading
    bearing = wp.atan2(wp.sin(off), wp.cos(off)) - _FIRST_RAD  # from the first sector's edge
    half = wp.asin(radius / distance)
    # once more with a turn added or taken off, where the tree stands across the seam behind
    for turn in range(-1, 2):
        middle = bearing + float(turn) * 2.0 * wp.pi
        first = wp.max(int(wp.floor((middle - half) / SECTOR_RAD)), 0)
        last = wp.min(int(wp.floor((middle + half) / SECTOR_RAD)), _SECTORS - 1)
        for k in range(first, last + 1):
            nearest = wp.clamp(middle, float(k) * SECTOR_RAD, float(k + 1) * SECTOR_RAD)
            along = distance * wp.cos(nearest - middle)
            aside = distance * wp.sin(nearest - middle)
            reach = along - wp.sqrt(wp.max(radius * radius - aside * aside, 0.0))
            ranges_m[i, k] = wp.min(ranges_m[i, k], reach)


@wp.func
def add_forest(forest: Forest, pos_ned: wp.vec3, heading: float, ranges_m: wp.array2d(dtype=float), i: int) -> None:
    """All trees that can be in range, each once: where its bucket is that of its axis."""
    reach = RANGE_M + 4.0  # crowns reach towards us
    row_low = bucket_of(forest, pos_ned[0] - reach)
    row_high = bucket_of(forest, pos_ned[0] + reach)
    column_low = bucket_of(forest, pos_ned[1] - reach)
    column_high = bucket_of(forest, pos_ned[1] + reach)
    for row in range(row_low, row_high + 1):
        for column in range(column_low, column_high + 1):
            bucket = row * forest.buckets + column
            for k in range(forest.bucket_start[bucket], forest.bucket_start[bucket + 1]):
                tree = forest.trees[forest.bucket_trees[k]]
                if bucket_of(forest, tree.north) == row and bucket_of(forest, tree.east) == column:
                    add_tree(tree, pos_ned, heading, ranges_m, i)


@wp.kernel(enable_backward=False)
def scan(
    rig: RigArrays,
    params: wp.array(dtype=NavigateParams),
    rows: wp.array(dtype=wp.bool),
    ranges_m: wp.array2d(dtype=float),
) -> None:
    """The ranges of the chosen rows [m], `RANGE_M` for no return; shape (vehicles, RANGES)."""
    i = wp.tid()
    if not rows[i]:
        return
    for k in range(_RANGES):
        ranges_m[i, k] = RANGE_M
    truth = rig.truth[i]
    world = rig.worlds[rig.i_world[i]]
    heading = yaw_from_quat(truth.q_ned_from_frd)
    add_forest(world.forest, truth.pos_ned, heading, ranges_m, i)
    for k in range(_SECTORS, _RANGES):
        up = _ELEVATIONS[k - _SECTORS]
        dir_ned = wp.vec3(wp.cos(up) * wp.cos(heading), wp.cos(up) * wp.sin(heading), -wp.sin(up))
        ranges_m[i, k] = ray_hit(world, truth.pos_ned, dir_ned, RANGE_M)
    noise = params[i].range_noise
    state = draw_key(rig.seed[i], 0, draw_tick(rig.tick[i]), _STREAM)
    for k in range(_RANGES):
        error = _UNIFORM_HALF * (2.0 * wp.randf(state) - 1.0)
        if ranges_m[i, k] < RANGE_M:
            ranges_m[i, k] = wp.min(ranges_m[i, k] * (1.0 + noise * _STD_FRACTION * error), RANGE_M)
        if wp.randf(state) < noise * _MISSES:
            ranges_m[i, k] = RANGE_M


@wp.func
def write_ranges(ranges_m: wp.array2d(dtype=float), out: wp.array2d(dtype=float), i: int, at: int) -> None:
    """Nearness, 1 for touching and 0 for no return, into row i from column `at`."""
    for k in range(_RANGES):
        out[i, at + k] = 1.0 - ranges_m[i, k] / RANGE_M
