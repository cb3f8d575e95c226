"""A scanning range finder on board: the nearest return in each of 48 sectors of 5 degrees, and four tilted beams.

Its driver levels what it measures by the attitude that the flight controller estimates, so that an error of the
estimate tilts all of it; then it keeps, per sector, the nearest of what stands within `BAND_M` above or below the
vehicle, the ground taken out. The beams look along the nose, up and down, and see the ground too. Each value has an
error of its own, and now and then there is no return. What is left out: the time that a turn of the scanner takes.
"""

import math
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.attitude import Quat
from common.kernels import TICK_US
from common.range_sectors import BEAM_ELEVATIONS_DEG, FIRST_EDGE_DEG, RANGE_M, RANGES, SECTOR_DEG, SECTORS
from common.rng import draw_key
from common.rotation import quat_from_yaw, wrap_pi, yaw_from_quat
from sim.rig import Rig
from sim.world.boxes import Box, box_middle, in_box_axes
from sim.world.custom.solids import FLOOR, Solids, solids_hit
from sim.world.growing import bucket_of
from sim.world.neighbours import neighbour_box
from sim.world.trees import Forest, Tree
from sim.world.walls import slab
from sim.world.world import World, WorldMap, ray_hit, world_at

wp.set_module_options({"enable_backward": False})

BAND_M = wp.constant(0.4)  # the hull and a little
_RANGE_M = wp.constant(RANGE_M)
_SECTORS = wp.constant(SECTORS)
_RANGES = wp.constant(RANGES)
_SECTOR_RAD = wp.constant(math.radians(SECTOR_DEG))
_FIRST_RAD = wp.constant(math.radians(FIRST_EDGE_DEG))
_ELEVATIONS = wp.constant(wp.vec4(*(math.radians(angle) for angle in BEAM_ELEVATIONS_DEG)))
_BOX_RAYS = wp.constant(3)  # of a sector that looks for boxes
_STREAM = wp.constant(202)  # of the rig's seeds
_STD_FRACTION = wp.constant(0.02)  # of the range, for a noise of 1; Intel D435: below 2 % up to 2 m
_MISSES = wp.constant(0.01)  # fraction of sectors without a return, for a noise of 1; guess
_UNIFORM_HALF = wp.constant(math.sqrt(3.0))  # half the width of a uniform draw of unit variance
_UPRIGHT = wp.constant(0.1)  # of the level plane's normal: an attitude that is off by more is no attitude


@wp.func
def ned_from_levelled(q_true: wp.quat, q_est: wp.quat) -> wp.quat:
    """Where the axes of what the driver has levelled point in truth: ahead, right and down by the estimate.

    Args:
        q_true: attitude of the vehicle, ned from frd.
        q_est: the same as it is estimated.
    """
    return q_true * wp.quat_inverse(q_est) * quat_from_yaw(yaw_from_quat(q_est))


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
def add_tree(
    tree: Tree, pos_ned: wp.vec3, heading: float, rise: wp.vec2, ranges_m: wp.array2d(dtype=float), i: int
) -> None:
    """Shortens the ranges of the sectors that a tree reaches into: exactly, the nearest of all returns in each.

    Args:
        tree: seen.
        pos_ned: of the scanner [m].
        heading: of its nose [rad].
        rise: of the levelled plane, per metre to the north and to the east.
        ranges_m: of all scanners.
        i: the scanner.
    """
    north = tree.north - pos_ned[0]
    east = tree.east - pos_ned[1]
    distance = wp.sqrt(north * north + east * east)
    radius = slice_radius(tree, -pos_ned[2] + rise[0] * north + rise[1] * east)
    if radius <= 0.0 or distance - radius > _RANGE_M:
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
        first = wp.max(int(wp.floor((middle - half) / _SECTOR_RAD)), 0)
        last = wp.min(int(wp.floor((middle + half) / _SECTOR_RAD)), _SECTORS - 1)
        for k in range(first, last + 1):
            nearest = wp.clamp(middle, float(k) * _SECTOR_RAD, float(k + 1) * _SECTOR_RAD)
            along = distance * wp.cos(nearest - middle)
            aside = distance * wp.sin(nearest - middle)
            reach = along - wp.sqrt(wp.max(radius * radius - aside * aside, 0.0))
            ranges_m[i, k] = wp.min(ranges_m[i, k], reach)


@wp.func
def add_forest(
    forest: Forest, pos_ned: wp.vec3, heading: float, rise: wp.vec2, ranges_m: wp.array2d(dtype=float), i: int
) -> None:
    """All trees that can be in range, each once: where its bucket is that of its axis."""
    reach = _RANGE_M + 4.0  # crowns reach towards us
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
                    add_tree(tree, pos_ned, heading, rise, ranges_m, i)


@wp.func
def add_box(
    box: Box, tick: int, pos_ned: wp.vec3, heading: float, rise: wp.vec2, ranges_m: wp.array2d(dtype=float), i: int
) -> None:
    """Shortens the ranges of the sectors that a box reaches into: three rays each, and its corners, however thin."""
    middle = box_middle(box, tick)
    off = wp.vec2(middle[0] - pos_ned[0], middle[1] - pos_ned[1])
    distance = wp.length(off)
    radius = wp.sqrt(box.half_length * box.half_length + box.half_width * box.half_width)
    height = -pos_ned[2] + rise[0] * off[0] + rise[1] * off[1]
    if distance - radius > _RANGE_M or height - BAND_M > box.high or height + BAND_M < box.low:
        return
    start = in_box_axes(box, -off[0], -off[1])
    half = wp.where(distance > radius, wp.asin(radius / wp.max(distance, radius)), wp.pi)
    bearing = wp.atan2(off[1], off[0]) - heading
    for ray in range(_BOX_RAYS * _SECTORS):
        angle = _FIRST_RAD + (float(ray) + 0.5) * _SECTOR_RAD / float(_BOX_RAYS)
        if wp.abs(wrap_pi(angle - bearing)) <= half:
            rate = in_box_axes(box, wp.cos(heading + angle), wp.sin(heading + angle))
            lengthwise = slab(start[0], rate[0], -box.half_length, box.half_length)
            across = slab(start[1], rate[1], -box.half_width, box.half_width)
            entry = wp.max(0.0, wp.max(lengthwise[0], across[0]))
            if entry <= wp.min(lengthwise[1], across[1]):
                k = ray // _BOX_RAYS
                ranges_m[i, k] = wp.min(ranges_m[i, k], entry)
    for corner in range(4):
        ahead = wp.where(corner < 2, box.half_length, -box.half_length)
        right = wp.where(corner % 2 == 0, box.half_width, -box.half_width)
        north = off[0] + box.cos_yaw * ahead - box.sin_yaw * right
        east = off[1] + box.sin_yaw * ahead + box.cos_yaw * right
        k = int(wp.floor((wrap_pi(wp.atan2(east, north) - heading) - _FIRST_RAD) / _SECTOR_RAD))
        if k >= 0 and k < _SECTORS:
            ranges_m[i, k] = wp.min(ranges_m[i, k], wp.sqrt(north * north + east * east))


@wp.func
def add_solids(
    solids: Solids, pos_ned: wp.vec3, heading: float, rise: wp.vec2, ranges_m: wp.array2d(dtype=float), i: int
) -> None:
    """Shortens the ranges of the sectors in which rays meet solids: three each at three heights; floors are ground."""
    for ray in range(_BOX_RAYS * _SECTORS):
        k = ray // _BOX_RAYS
        angle = heading + _FIRST_RAD + (float(ray) + 0.5) * _SECTOR_RAD / float(_BOX_RAYS)
        north = wp.cos(angle)
        east = wp.sin(angle)
        climb = rise[0] * north + rise[1] * east
        dir_ned = wp.normalize(wp.vec3(north, east, -climb))
        level = wp.length(wp.vec2(dir_ned[0], dir_ned[1]))
        for height in range(-1, 2):
            start_ned = pos_ned - wp.vec3(0.0, 0.0, float(height) * BAND_M)
            hit = solids_hit(solids, start_ned, dir_ned, ranges_m[i, k] / level)
            if hit.face >= 0 and -hit.normal_ned[2] < FLOOR:
                ranges_m[i, k] = hit.t * level


@wp.func
def scan_ranges(
    world: World,
    pos_ned: wp.vec3,
    q_ned_from_level: wp.quat,
    noise: float,
    seed: int,
    tick: int,
    ranges_m: wp.array2d(dtype=float),
    i: int,
) -> None:
    """The ranges of scanner i [m], `RANGE_M` for no return.

    Args:
        world: what is seen, its movers where they are at `tick`.
        pos_ned: where it is [m].
        q_ned_from_level: how it is levelled (`ned_from_levelled`).
        noise: factor on its errors.
        seed: of its errors.
        tick: now, and of its errors.
        ranges_m: of all scanners, shape (scanners, RANGES).
        i: the scanner.
    """
    for k in range(_RANGES):
        ranges_m[i, k] = _RANGE_M
    down = wp.quat_rotate(q_ned_from_level, wp.vec3(0.0, 0.0, 1.0))
    rise = wp.vec2(down[0], down[1]) / wp.max(down[2], _UPRIGHT)
    nose = wp.quat_rotate(q_ned_from_level, wp.vec3(1.0, 0.0, 0.0))
    heading = wp.atan2(nose[1], nose[0])
    add_forest(world.forest, pos_ned, heading, rise, ranges_m, i)
    for i_box in range(world.boxes.box_count):
        add_box(world.boxes.boxes[i_box], tick, pos_ned, heading, rise, ranges_m, i)
    for k in range(world.neighbours.count):
        if k != world.neighbours.i_own:
            add_box(neighbour_box(world.neighbours.rows[k], tick), 0, pos_ned, heading, rise, ranges_m, i)
    if world.solids.count > 0:
        add_solids(world.solids, pos_ned, heading, rise, ranges_m, i)
    for k in range(_SECTORS, _RANGES):
        up = _ELEVATIONS[k - _SECTORS]
        dir_ned = wp.quat_rotate(q_ned_from_level, wp.vec3(wp.cos(up), 0.0, -wp.sin(up)))
        ranges_m[i, k] = ray_hit(world_at(world, tick), pos_ned, dir_ned, _RANGE_M)
    state = draw_key(seed, 0, tick, _STREAM)
    for k in range(_RANGES):
        error = _UNIFORM_HALF * (2.0 * wp.randf(state) - 1.0)
        if ranges_m[i, k] < _RANGE_M:
            ranges_m[i, k] = wp.min(ranges_m[i, k] * (1.0 + noise * _STD_FRACTION * error), _RANGE_M)
        if wp.randf(state) < noise * _MISSES:
            ranges_m[i, k] = _RANGE_M


@wp.kernel(enable_backward=False)
def scan_once(
    world: World,
    pos_ned: wp.vec3,
    q_true: wp.quat,
    q_est: wp.quat,
    noise: float,
    seed: int,
    tick: int,
    ranges_m: wp.array2d(dtype=float),
) -> None:
    """One scan of one scanner, shape (1, RANGES)."""
    scan_ranges(world, pos_ned, ned_from_levelled(q_true, q_est), noise, seed, tick, ranges_m, wp.tid())


class Scanner:
    """The scanner on one vehicle.

    Args:
        rig: where the vehicle is, and what its flight controller estimates.
        world: what it sees.
        noise: scale of its errors.
        seed: of its errors.
        i_vehicle: the vehicle.
    """

    def __init__(self, rig: Rig, world: WorldMap, noise: float, seed: int, i_vehicle: int = 0) -> None:
        self._world = world.kernel
        self._truth: Any = rig.rows["truth"][i_vehicle]
        self._estimate: Any = rig.rows["autopilot.ekf.rows"][i_vehicle]["estimate"]
        self._ranges = wp.zeros((1, RANGES), dtype=float, device="cpu")
        self._noise, self._seed = noise, seed

    @property
    def q_ned_from_frd(self) -> Quat:
        """The attitude that it levels by."""
        x, y, z, w = (float(element) for element in self._estimate["q_ned_from_frd"])
        return x, y, z, w

    def measure(self, time_us: int) -> NDArray[np.float32]:
        """Ranges [m] of the sectors and then of the beams, `RANGE_M` for no return, shape (RANGES,)."""
        pos_ned = wp.vec3(*(float(element) for element in self._truth["pos_ned"]))
        q_true = wp.quat(*(float(element) for element in self._truth["q_ned_from_frd"]))
        q_est = wp.quat(*self.q_ned_from_frd)
        inputs = [self._world, pos_ned, q_true, q_est, self._noise, self._seed, time_us // TICK_US]
        wp.launch(scan_once, dim=1, inputs=inputs, outputs=[self._ranges], device="cpu")
        ranges: NDArray[np.float32] = self._ranges.numpy()[0].copy()
        return ranges
