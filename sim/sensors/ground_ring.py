"""A scanner with many layers on a rover: what stands round it in 72 sectors of 5 degrees, the ground left out.

Sectors are those of MAVLink's OBSTACLE_DISTANCE, clockwise, the first one's middle at the nose. Each tells the nearest
of its rays to anything that stands on the ground, seen from above: trunks, walls, boxes and movers, however low and
whatever the slope. What is left out: hills that hide things, and the time that a turn takes. True places, since it is a
sensor; each value has an error of its own, and now and then there is no return. Asked for every decision, so each thing
is cast against the rays that can meet it alone.
"""

import math
from typing import Any

import warp as wp

from common.rng import draw_key, draw_tick
from common.rotation import yaw_from_quat
from sim.rig import Rig
from sim.truth import Truth
from sim.world.boxes import Box, box_middle, in_box_axes
from sim.world.custom.solids import FLOOR, solids_hit
from sim.world.growing import bucket_of
from sim.world.neighbours import neighbour_box
from sim.world.trees import Forest, Tree
from sim.world.walls import slab
from sim.world.world import World, WorldMap, ground_height, top_surface, world_at

wp.set_module_options({"enable_backward": False})

SECTORS = 72
RAYS_PER_SECTOR = 3
RING_MAX_M = wp.constant(10.0)  # guess: of what is called sure on dark bark
_SECTORS = wp.constant(SECTORS)
_PER_SECTOR = wp.constant(RAYS_PER_SECTOR)
_RAYS = wp.constant(SECTORS * RAYS_PER_SECTOR)
_RAY_RAD = wp.constant(2.0 * math.pi / (SECTORS * RAYS_PER_SECTOR))
_LOW_M = wp.constant(1.0)  # another vehicle that flies higher does not stand on the ground
_LAYERS_M = wp.constant(wp.vec2(0.15, 0.5))  # above the ground, at which solids are looked for; guess
_STREAM = wp.constant(203)  # of the rig's seeds
_STD_M = wp.constant(0.02)  # for a noise of 1; Slamtec RPLIDAR S2 data sheet: 3 cm
_MISSES = wp.constant(0.01)  # fraction of sectors without a return, for a noise of 1; guess
_UNIFORM_HALF = wp.constant(math.sqrt(3.0))  # half the width of a uniform draw of unit variance


@wp.func
def shorten(ranges_m: wp.array2d(dtype=float), i: int, ray: int, distance_m: float) -> None:
    """Takes a ray's return into its sector: the rays of a sector lie round its middle."""
    k = ((ray + _RAYS + _PER_SECTOR // 2) // _PER_SECTOR) % _SECTORS
    ranges_m[i, k] = wp.min(ranges_m[i, k], distance_m)


@wp.func
def add_box(box: Box, tick: int, place: wp.vec2, heading: float, ranges_m: wp.array2d(dtype=float), i: int) -> None:
    """Casts the rays that can meet a box, seen from above."""
    middle = box_middle(box, tick)
    off = middle - place
    distance = wp.length(off)
    radius = wp.sqrt(box.half_length * box.half_length + box.half_width * box.half_width)
    if distance - radius > RING_MAX_M:
        return
    first = int(0)
    last = int(_RAYS) - 1
    if distance > radius:
        bearing = wp.atan2(off[1], off[0]) - heading
        half = wp.asin(radius / distance)
        first = int(wp.ceil((bearing - half) / _RAY_RAD))
        last = int(wp.floor((bearing + half) / _RAY_RAD))
    start = in_box_axes(box, -off[0], -off[1])
    for ray in range(first, last + 1):
        angle = heading + float(ray) * _RAY_RAD
        rate = in_box_axes(box, wp.cos(angle), wp.sin(angle))
        lengthwise = slab(start[0], rate[0], -box.half_length, box.half_length)
        across = slab(start[1], rate[1], -box.half_width, box.half_width)
        entry = wp.max(0.0, wp.max(lengthwise[0], across[0]))
        if entry <= wp.min(lengthwise[1], across[1]):
            # rays are numbered from -RAYS up to twice as many: one turn more makes them positive
            shorten(ranges_m, i, ray + _RAYS, entry)


@wp.func
def add_trunk(tree: Tree, place: wp.vec2, heading: float, ranges_m: wp.array2d(dtype=float), i: int) -> None:
    """Takes a trunk into the sectors that it reaches into."""
    off = wp.vec2(tree.north, tree.east) - place
    distance = wp.length(off)
    if distance - tree.trunk_radius > RING_MAX_M or distance <= tree.trunk_radius:
        return
    bearing = wp.atan2(off[1], off[0]) - heading
    half = wp.asin(tree.trunk_radius / distance)
    first = int(wp.ceil((bearing - half) / _RAY_RAD))
    last = int(wp.floor((bearing + half) / _RAY_RAD))
    for ray in range(first, last + 1):
        aside = distance * wp.sin(float(ray) * _RAY_RAD - bearing)
        along = distance * wp.cos(float(ray) * _RAY_RAD - bearing)
        depth = wp.sqrt(wp.max(tree.trunk_radius * tree.trunk_radius - aside * aside, 0.0))
        shorten(ranges_m, i, ray + _RAYS, along - depth)


@wp.func
def add_trunks(forest: Forest, place: wp.vec2, heading: float, ranges_m: wp.array2d(dtype=float), i: int) -> None:
    """All trees that can be in range, each once: where its bucket is that of its axis."""
    if forest.tree_count == 0:
        return
    row_low = bucket_of(forest, place[0] - RING_MAX_M)
    row_high = bucket_of(forest, place[0] + RING_MAX_M)
    column_low = bucket_of(forest, place[1] - RING_MAX_M)
    column_high = bucket_of(forest, place[1] + RING_MAX_M)
    for row in range(row_low, row_high + 1):
        for column in range(column_low, column_high + 1):
            bucket = row * forest.buckets + column
            for k in range(forest.bucket_start[bucket], forest.bucket_start[bucket + 1]):
                tree = forest.trees[forest.bucket_trees[k]]
                if bucket_of(forest, tree.north) == row and bucket_of(forest, tree.east) == column:
                    add_trunk(tree, place, heading, ranges_m, i)


@wp.func
def add_solids(world: World, place: wp.vec2, heading: float, ranges_m: wp.array2d(dtype=float), i: int) -> None:
    """Casts level rays at two heights over what the ring stands on; what can be driven up is none of its returns."""
    up = top_surface(world, place[0], place[1])
    for ray in range(_RAYS):
        angle = heading + float(ray) * _RAY_RAD
        dir_ned = wp.vec3(wp.cos(angle), wp.sin(angle), 0.0)
        for layer in range(2):
            height_m = wp.where(layer == 0, _LAYERS_M[0], _LAYERS_M[1])
            hit = solids_hit(world.solids, wp.vec3(place[0], place[1], -up - height_m), dir_ned, RING_MAX_M)
            if hit.face >= 0 and -hit.normal_ned[2] < FLOOR:
                shorten(ranges_m, i, ray, hit.t)


@wp.func
def ring_ranges(
    world: World,
    place: wp.vec2,
    heading: float,
    noise: float,
    seed: int,
    tick: int,
    ranges_m: wp.array2d(dtype=float),
    i: int,
) -> None:
    """The ranges of a ring into row i [m], RING_MAX_M for no return.

    Args:
        world: what stands there, the movers where they are now.
        place: north and east of the ring [m].
        heading: of its first sector's middle [rad].
        noise: factor on its errors.
        seed: of its errors.
        tick: now.
        ranges_m: shape (rows, SECTORS).
        i: the row.
    """
    for k in range(_SECTORS):
        ranges_m[i, k] = RING_MAX_M
    boxes = world.boxes
    for i_box in range(boxes.box_count):
        add_box(boxes.boxes[i_box], boxes.tick, place, heading, ranges_m, i)
    for k in range(world.neighbours.count):
        if k != world.neighbours.i_own:
            box = neighbour_box(world.neighbours.rows[k], boxes.tick)
            if box.low - ground_height(world, box.north, box.east) < _LOW_M:
                add_box(box, 0, place, heading, ranges_m, i)
    add_trunks(world.forest, place, heading, ranges_m, i)
    if world.solids.count > 0:
        add_solids(world, place, heading, ranges_m, i)
    if world.walls.is_built == 1:
        inner = world.walls.half_size_m
        if wp.max(wp.abs(place[0]), wp.abs(place[1])) > inner - RING_MAX_M:
            for ray in range(_RAYS):
                angle = heading + float(ray) * _RAY_RAD
                north = slab(place[0], wp.cos(angle), -inner, inner)
                east = slab(place[1], wp.sin(angle), -inner, inner)
                shorten(ranges_m, i, ray, wp.clamp(wp.min(north[1], east[1]), 0.0, RING_MAX_M))
    state = draw_key(seed, 0, tick, _STREAM)
    for k in range(_SECTORS):
        error = _UNIFORM_HALF * (2.0 * wp.randf(state) - 1.0)
        if ranges_m[i, k] < RING_MAX_M:
            ranges_m[i, k] = wp.clamp(ranges_m[i, k] + noise * _STD_M * error, 0.0, RING_MAX_M)
        if wp.randf(state) < noise * _MISSES:
            ranges_m[i, k] = RING_MAX_M


@wp.kernel(enable_backward=False)
def ring_rows(
    world: World,
    truth: wp.array(dtype=Truth),
    ticks: wp.array(dtype=wp.int64),
    i_vehicle: int,
    noise: float,
    seed: int,
    ranges_m: wp.array2d(dtype=float),
) -> None:
    """What the ring of one vehicle tells, shape (1, SECTORS)."""
    row = truth[i_vehicle]
    tick = draw_tick(ticks[i_vehicle])
    place = wp.vec2(row.pos_ned[0], row.pos_ned[1])
    heading = yaw_from_quat(row.q_ned_from_frd)
    ring_ranges(world_at(world, tick), place, heading, noise, seed, tick, ranges_m, wp.tid())


class GroundRing:
    """The ring on one vehicle, fixed to its hull: the first sector's middle is at the nose.

    Args:
        rig: where the vehicle is.
        world: what it sees.
        noise: scale of its errors.
        seed: of its errors.
        i_vehicle: the vehicle.
    """

    def __init__(self, rig: Rig, world: WorldMap, noise: float, seed: int, i_vehicle: int = 0) -> None:
        self.ranges = wp.zeros((1, SECTORS), dtype=float, device="cpu")
        self._inputs: list[Any] = [world.kernel, rig.arrays.truth, rig.arrays.tick, i_vehicle, noise, seed]

    def measure(self, yaw_rad: float) -> list[float]:  # noqa: ARG002  (of rings that are turned by the estimate)
        """Distances [m] clockwise from the nose, inf where nothing is within reach."""
        wp.launch(ring_rows, 1, inputs=self._inputs, outputs=[self.ranges], device="cpu")
        return [float(m) if m < RING_MAX_M else math.inf for m in self.ranges.numpy()[0]]
