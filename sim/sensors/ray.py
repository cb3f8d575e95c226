"""What a camera ray meets first: ground, a trunk, a crown, a wall, a solid, another vehicle, or the sky.

Exact for the world's shapes inside the map, like `sim.world.world.ray_hit`, and quicker by the skyline. Beyond the map
the ground is taken as it continues from the edge. Asked for every pixel, and once more for its shadow.
"""

import warp as wp

from sim.sensors.skyline import BLOCK_BUCKETS, Skyline
from sim.world.custom.solids import SolidHit, solids_hit
from sim.world.neighbours import Neighbours, neighbour_ray_hit
from sim.world.terrain import terrain_height, terrain_ray_hit
from sim.world.trees import Forest, Tree, tree_ray_hit
from sim.world.walls import walls_ray_hit
from sim.world.world import World

wp.set_module_options({"enable_backward": False})

SKY = wp.constant(0)  # what is seen: the classes of the segmentation image
GROUND = wp.constant(1)
TRUNK = wp.constant(2)
CROWN = wp.constant(3)
WALL = wp.constant(4)
PERSON = wp.constant(5)  # drawn by the fast camera only
VEHICLE = wp.constant(6)
SOLID = wp.constant(7)  # of a world file

RAY_MAX_M = wp.constant(4000.0)  # beyond it fog hides everything
_NEVER = wp.constant(1.0e30)
_NUDGE_M = wp.constant(1.0e-3)  # past a border, so that the next square is found beyond it
_PARALLEL = wp.constant(1.0e-9)
_EDGE_STEPS = wp.constant(4)


@wp.struct
class Hit:
    """The first thing a ray meets."""

    t: float  # [m] along the unit ray
    kind: int  # SKY, GROUND, TRUNK, CROWN, WALL, VEHICLE or SOLID
    i_tree: int  # or which vehicle, or which triangle of the solids
    solid: SolidHit


@wp.func
def square_exit(start: float, rate: float, index: int, squares_per_m: float, half_size_m: float) -> float:
    """Ray parameter [m] at which one coordinate leaves the square of an index.

    Args:
        start: coordinate of the ray's origin [m].
        rate: its change per metre of ray.
        index: of the square.
        squares_per_m: how many squares a metre holds.
        half_size_m: the first square starts at -half_size_m.
    """
    if wp.abs(rate) < _PARALLEL:
        return _NEVER
    border = float(index)
    if rate > 0.0:
        border = float(index + 1)
    return (border / squares_per_m - half_size_m - start) / rate


@wp.func
def bucket_hit(forest: Forest, bucket: int, origin_ned: wp.vec3, dir_ned: wp.vec3, known: Hit) -> Hit:
    """The nearer of a known hit and the trees of one bucket."""
    hit = Hit()
    hit.t = known.t
    hit.kind = known.kind
    hit.i_tree = known.i_tree
    for k in range(forest.bucket_start[bucket], forest.bucket_start[bucket + 1]):
        i_tree = forest.bucket_trees[k]
        t = tree_ray_hit(forest.trees[i_tree], origin_ned, dir_ned, hit.t)
        if t < hit.t:
            hit.t = t
            hit.kind = CROWN
            hit.i_tree = i_tree
    return hit


@wp.func
def map_entry(start: float, rate: float, half_size_m: float) -> float:
    """Ray parameter [m] from which one coordinate is inside the map; never if it is not."""
    if start > half_size_m:
        if rate > -_PARALLEL:
            return _NEVER
        return (half_size_m - start) / rate
    if start < -half_size_m:
        if rate < _PARALLEL:
            return _NEVER
        return (-half_size_m - start) / rate
    return 0.0


@wp.func
def scenery_entry(origin_ned: wp.vec3, dir_ned: wp.vec3, half_size_m: float, top_m: float) -> float:
    """Ray parameter [m] from which a ray is inside the map and below all that stands there; never if it is not."""
    t = wp.max(map_entry(origin_ned[0], dir_ned[0], half_size_m), map_entry(origin_ned[1], dir_ned[1], half_size_m))
    height = -origin_ned[2]
    climb = -dir_ned[2]
    if height > top_m:
        if climb >= -_PARALLEL:
            return _NEVER
        return wp.max(t, (height - top_m) / -climb)
    return t


@wp.func
def first_hit(w: World, skyline: Skyline, origin_ned: wp.vec3, dir_ned: wp.vec3, max_m: float) -> Hit:
    """The first thing a ray of unit direction meets within `max_m` [m]; kind SKY and `max_m` if nothing."""
    hit = Hit()
    hit.t = max_m
    hit.kind = SKY
    half = w.terrain.half_size_m
    buckets = w.forest.buckets
    per_m = w.forest.buckets_per_m
    block_per_m = per_m / float(BLOCK_BUCKETS)
    height = -origin_ned[2]
    climb = -dir_ned[2]
    top = wp.max(w.terrain.ground_max_m, w.forest.top_m)
    t = scenery_entry(origin_ned, dir_ned, half, top)
    wall = walls_ray_hit(w.walls, origin_ned, dir_ned, max_m)
    if wall < hit.t:
        hit.t = wall
        hit.kind = WALL
    most_squares = 8 * buckets + 16  # a straight ray crosses each line of both grids once
    for _ in range(most_squares):
        if t >= hit.t or (climb >= 0.0 and height + climb * t > top):
            break
        ahead = t + _NUDGE_M
        row = int(wp.floor((origin_ned[0] + ahead * dir_ned[0] + half) * per_m))
        column = int(wp.floor((origin_ned[1] + ahead * dir_ned[1] + half) * per_m))
        if row < 0 or column < 0 or row >= buckets or column >= buckets:
            break
        block_row = row / BLOCK_BUCKETS
        block_column = column / BLOCK_BUCKETS
        t_block = wp.min(
            square_exit(origin_ned[0], dir_ned[0], block_row, block_per_m, half),
            square_exit(origin_ned[1], dir_ned[1], block_column, block_per_m, half),
        )
        t_block = wp.max(t_block, ahead)
        lowest = height + wp.min(climb * t, climb * t_block)
        if lowest > skyline.block_top[block_row, block_column]:
            t = t_block
            continue
        t_exit = wp.min(
            square_exit(origin_ned[0], dir_ned[0], row, per_m, half),
            square_exit(origin_ned[1], dir_ned[1], column, per_m, half),
        )
        t_exit = wp.max(t_exit, ahead)
        lowest = height + wp.min(climb * t, climb * t_exit)
        if lowest <= skyline.bucket_top[row, column]:
            hit = bucket_hit(w.forest, row * buckets + column, origin_ned, dir_ned, hit)
            if lowest <= skyline.bucket_ground[row, column]:
                start = origin_ned + t * dir_ned
                reach = wp.min(t_exit, hit.t) - t
                ground = terrain_ray_hit(w.terrain, start, dir_ned, reach)
                if ground < reach:
                    hit.t = t + ground
                    hit.kind = GROUND
        t = t_exit
    if hit.kind == SKY:
        hit = beyond_map(w, origin_ned, dir_ned, hit)
    if w.neighbours.count > 0:
        hit = neighbour_hit(w.neighbours, w.boxes.tick, origin_ned, dir_ned, hit)
    if w.solids.count > 0:
        hit = nearer_solid(w, origin_ned, dir_ned, hit)
    return hit


@wp.func
def nearer_solid(w: World, origin_ned: wp.vec3, dir_ned: wp.vec3, known: Hit) -> Hit:
    """The nearer of a known hit and the solids."""
    solid = solids_hit(w.solids, origin_ned, dir_ned, known.t)
    if solid.face < 0:
        return known
    hit = Hit()
    hit.t = solid.t
    hit.kind = SOLID
    hit.i_tree = solid.face
    hit.solid = solid
    return hit


@wp.func
def neighbour_hit(others: Neighbours, tick: int, origin_ned: wp.vec3, dir_ned: wp.vec3, known: Hit) -> Hit:
    """The nearer of a known hit and the other vehicles."""
    hit = Hit()
    hit.t = known.t
    hit.kind = known.kind
    hit.i_tree = known.i_tree
    for i in range(others.count):
        if i != others.i_own:
            t = neighbour_ray_hit(others.rows[i], tick, origin_ned, dir_ned, hit.t)
            if t < hit.t:
                hit.t = t
                hit.kind = VEHICLE
                hit.i_tree = i
    return hit


@wp.func
def beyond_map(w: World, origin_ned: wp.vec3, dir_ned: wp.vec3, known: Hit) -> Hit:
    """Where a ray that has passed the map meets the ground that continues from its edge."""
    hit = Hit()
    hit.t = known.t
    hit.kind = known.kind
    climb = -dir_ned[2]
    if climb > -1.0e-4:
        return hit
    t = float(0.0)
    ground = float(0.0)
    for _ in range(_EDGE_STEPS):
        t = (-origin_ned[2] - ground) / -climb
        ground = terrain_height(w.terrain, origin_ned[0] + t * dir_ned[0], origin_ned[1] + t * dir_ned[1])
    t = (-origin_ned[2] - ground) / -climb
    outer = wp.max(wp.abs(origin_ned[0] + t * dir_ned[0]), wp.abs(origin_ned[1] + t * dir_ned[1]))
    if t > 0.0 and t < known.t and outer >= w.terrain.half_size_m:
        hit.t = t
        hit.kind = GROUND
    return hit


@wp.func
def is_trunk(tree: Tree, point_ned: wp.vec3) -> bool:
    """Whether a point on a tree's surface is on its trunk."""
    off_up = -point_ned[2] - wp.clamp(-point_ned[2], tree.crown_low, tree.crown_high)
    off_north = point_ned[0] - tree.north
    off_east = point_ned[1] - tree.east
    off = wp.sqrt(off_north * off_north + off_east * off_east + off_up * off_up)
    return off > tree.crown_radius + 0.02


@wp.func
def is_shadowed(w: World, skyline: Skyline, point_ned: wp.vec3, sun_ned: wp.vec3) -> bool:
    """Whether ground or trees stand between a point and the sun."""
    hit = first_hit(w, skyline, point_ned, sun_ned, 150.0)
    return hit.kind != SKY


@wp.func
def smooth_normal_ned(w: World, north: float, east: float) -> wp.vec3:
    """Unit normal of the ground blended over neighbouring cells, pointing up: facets would show in the shading."""
    terrain = w.terrain
    step = 1.0 / terrain.cells_per_m
    d_north = terrain_height(terrain, north + step, east) - terrain_height(terrain, north - step, east)
    d_east = terrain_height(terrain, north, east + step) - terrain_height(terrain, north, east - step)
    return wp.normalize(wp.vec3(-0.5 * d_north / step, -0.5 * d_east / step, -1.0))
