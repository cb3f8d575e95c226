"""How near everything solid is to a vehicle, all round: truth for teachers and critics.

24 level sectors of 15 degrees from the true heading clockwise, each with the nearest thing in it: rays would pass thin
trunks by. Then up and down, and where the nearest tree is. What lies beyond `RANGE_M` is not told.
"""

import math

import warp as wp

from common.rotation import wrap_pi, yaw_from_quat
from policies.tasks.layout import Element
from sim.advance import RigArrays
from sim.world.terrain import grid_coordinate, outer_cell, terrain_ray_hit
from sim.world.trees import Tree
from sim.world.walls import walls_ray_hit
from sim.world.world import World, ray_hit

wp.set_module_options({"enable_backward": False})

SECTORS = 24
RANGES = SECTORS + 4
RANGE_M = wp.constant(8.0)  # no more than a bucket of the forest, so that its neighbours hold every tree within
_SECTORS = wp.constant(SECTORS)
_SECTOR_RAD = wp.constant(2.0 * math.pi / SECTORS)
HULL_M = wp.constant(0.35)  # a crown that begins this much higher or lower counts: half a vehicle's height and more

RANGE_ELEMENTS = (
    *(Element(f"nearness_{15 * k}_deg", "1") for k in range(SECTORS)),
    Element("nearness_up", "1"),
    Element("nearness_down", "1"),
    Element("nearest_tree_ahead", "1"),  # unit vector to the tree, or to another person, times its nearness
    Element("nearest_tree_right", "1"),
)


@wp.func
def nearness(distance_m: float) -> float:
    """1 for touching, 0 at `RANGE_M` and beyond."""
    return wp.clamp(1.0 - distance_m / RANGE_M, 0.0, 1.0)


@wp.func
def width_at(tree: Tree, height: float) -> float:
    """Radius of a tree at a height [m]: of its crown or of its trunk, 0 above it."""
    radius = float(0.0)
    if height < tree.crown_low:
        radius = tree.trunk_radius
    nearest = wp.clamp(wp.clamp(height, tree.crown_low, tree.crown_high), height - HULL_M, height + HULL_M)
    off = nearest - wp.clamp(nearest, tree.crown_low, tree.crown_high)
    spare = tree.crown_radius * tree.crown_radius - off * off
    if spare > 0.0:
        radius = wp.max(radius, wp.sqrt(spare))
    return radius


@wp.func
def mark_sectors(way: wp.vec2, radius: float, yaw: float, out: wp.array2d(dtype=float), i: int) -> None:
    """Marks the sectors that something round fills, its middle so far north and east [m]."""
    distance = wp.length(way)
    near = nearness(wp.max(distance - radius, 0.0))
    if near <= 0.0:
        return
    bearing = wrap_pi(wp.atan2(way[1], way[0]) - yaw)
    half = wp.asin(wp.min(radius / wp.max(distance, 1.0e-3), 1.0))
    first = int(wp.round((bearing - half) / _SECTOR_RAD))
    last = int(wp.round((bearing + half) / _SECTOR_RAD))
    for k in range(first, last + 1):
        sector = (k + _SECTORS) % _SECTORS
        out[i, sector] = wp.max(out[i, sector], near)


@wp.func
def mark_round(way: wp.vec2, radius: float, yaw: float, out: wp.array2d(dtype=float), i: int) -> None:
    """Marks something round in all of `RANGE_ELEMENTS`: its sectors, and whether it is the nearest."""
    mark_sectors(way, radius, yaw, out, i)
    near = nearness(wp.max(wp.length(way) - radius, 0.0))
    bearing = wp.atan2(way[1], way[0]) - yaw
    ahead = out[i, _SECTORS + 2]
    right = out[i, _SECTORS + 3]
    if near * near > ahead * ahead + right * right:
        out[i, _SECTORS + 2] = near * wp.cos(bearing)
        out[i, _SECTORS + 3] = near * wp.sin(bearing)


@wp.func
def add_trees(w: World, pos_ned: wp.vec3, yaw: float, out: wp.array2d(dtype=float), i: int) -> None:
    """Marks the sectors that the trees around fill."""
    forest = w.forest
    row = outer_cell(grid_coordinate(pos_ned[0], forest.half_size_m, forest.buckets_per_m), forest.buckets)
    column = outer_cell(grid_coordinate(pos_ned[1], forest.half_size_m, forest.buckets_per_m), forest.buckets)
    for r in range(wp.max(row - 1, 0), wp.min(row + 2, forest.buckets)):
        for c in range(wp.max(column - 1, 0), wp.min(column + 2, forest.buckets)):
            bucket = r * forest.buckets + c
            for k in range(forest.bucket_start[bucket], forest.bucket_start[bucket + 1]):
                tree = forest.trees[forest.bucket_trees[k]]
                radius = width_at(tree, -pos_ned[2])
                if radius > 0.0:
                    mark_round(wp.vec2(tree.north - pos_ned[0], tree.east - pos_ned[1]), radius, yaw, out, i)


@wp.kernel(enable_backward=False)
def measure_ranges(rig: RigArrays, rows: wp.array(dtype=wp.bool), out: wp.array2d(dtype=float)) -> None:
    """The elements of `RANGE_ELEMENTS`, shape (vehicles, RANGES), of the chosen rows."""
    i = wp.tid()
    if not rows[i]:
        return
    truth = rig.truth[i]
    w = rig.worlds[rig.i_world[i]]
    yaw = yaw_from_quat(truth.q_ned_from_frd)
    for k in range(_SECTORS):
        bearing = yaw + float(k) * _SECTOR_RAD
        dir_ned = wp.vec3(wp.cos(bearing), wp.sin(bearing), 0.0)
        ground = terrain_ray_hit(w.terrain, truth.pos_ned, dir_ned, RANGE_M)
        out[i, k] = nearness(walls_ray_hit(w.walls, truth.pos_ned, dir_ned, ground))
    out[i, _SECTORS] = nearness(ray_hit(w, truth.pos_ned, wp.vec3(0.0, 0.0, -1.0), RANGE_M))
    out[i, _SECTORS + 1] = nearness(ray_hit(w, truth.pos_ned, wp.vec3(0.0, 0.0, 1.0), RANGE_M))
    out[i, _SECTORS + 2] = 0.0
    out[i, _SECTORS + 3] = 0.0
    add_trees(w, truth.pos_ned, yaw, out, i)
