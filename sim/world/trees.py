"""Trees: Poisson-disc positions on the terrain, each a trunk (vertical cylinder) and a crown (vertical capsule).

Kernels find the trees near a point or along a ray through square buckets, each of which lists every tree that reaches
within CONTACT_MARGIN_M of it; a contact query therefore reads one bucket. Queries are exact for these shapes. Trees are
rigid: a crown stops a vehicle as a trunk does. Made once per world; contact is asked at up to 1 kHz per vehicle.
"""

from dataclasses import dataclass
from math import ceil, sqrt
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from sim.world.poisson import COVERAGE, poisson_disc
from sim.world.terrain import FloatArray, TerrainMap, grid_coordinate, next_border, outer_cell

wp.set_module_options({"enable_backward": False})

BUCKET_M = 8.0  # about one tree per bucket at the default density
CONTACT_MARGIN_M = 2.0  # largest radius that `forest_contact` accepts
EDGE_M = 5.0  # trees stand at least this far inside the map, so that no crown reaches a wall
# Proportions of a tree relative to its height; guess, after young mixed woodland.
TRUNK_RADIUS_FRACTION = 0.015
CROWN_BASE_FRACTION = 0.35
CROWN_RADIUS_FRACTION = (0.16, 0.26)
ROOT_M = 1.0  # trunks go this far into the ground, so that none floats on a slope

NO_OBSTACLE_M = -1.0e6  # height of the highest tree when there is none
_UPRIGHT = wp.constant(1.0e-12)  # squared horizontal direction below which a ray cannot cross the side of a trunk
_FAR = wp.constant(1.0e30)


@wp.struct
class Tree:
    """One tree; heights are above the home plane."""

    north: float  # [m] position of the axis
    east: float
    root_height: float  # [m] lower end of the trunk, under ground
    trunk_radius: float  # [m]
    crown_low: float  # [m] heights of the ends of the crown's axis; the trunk ends at the lower one
    crown_high: float
    crown_radius: float  # [m]


@wp.struct
class Forest:
    """All trees of one world, and the buckets to find them.

    Bucket k lists the trees bucket_trees[bucket_start[k] : bucket_start[k + 1]].
    """

    trees: wp.array[Tree]  # the first tree_count; there may be room for more
    tree_count: int
    bucket_start: wp.array[wp.int32]  # (buckets² + 1,), rows to the north
    bucket_trees: wp.array[wp.int32]  # indices into trees
    buckets: int  # per side
    buckets_per_m: float
    half_size_m: float
    top_m: float  # height of the highest crown above the home plane


@wp.struct
class Passing:
    """How a ray passes a vertical axis."""

    t_axis: float  # [m] ray parameter of the point nearest to the axis
    off_axis_squared: float  # [m²] its squared distance from the axis
    level: float  # squared horizontal length of the direction
    height: float  # [m] of the ray's origin
    climb: float  # upward component of the direction


@wp.func
def forest_contact(forest: Forest, pos_ned: wp.vec3, radius: float) -> wp.vec4:
    """Deepest contact of a sphere with trunks and crowns: unit push-out normal (ned), penetration [m]; 0 for none.

    Args:
        forest: the trees.
        pos_ned: centre of the sphere [m].
        radius: of the sphere, at most CONTACT_MARGIN_M [m].
    """
    none = wp.vec4(0.0, 0.0, 0.0, 0.0)
    height = -pos_ned[2]
    if height - radius > forest.top_m:
        return none
    row = outer_cell(grid_coordinate(pos_ned[0], forest.half_size_m, forest.buckets_per_m), forest.buckets)
    column = outer_cell(grid_coordinate(pos_ned[1], forest.half_size_m, forest.buckets_per_m), forest.buckets)
    if row < 0 or column < 0 or row >= forest.buckets or column >= forest.buckets:
        return none
    bucket = row * forest.buckets + column
    deepest = none
    for k in range(forest.bucket_start[bucket], forest.bucket_start[bucket + 1]):
        contact = tree_contact(forest.trees[forest.bucket_trees[k]], pos_ned, radius)
        if contact[3] > deepest[3]:
            deepest = contact
    return deepest


@wp.func
def tree_contact(tree: Tree, pos_ned: wp.vec3, radius: float) -> wp.vec4:
    """Deeper contact of a sphere with the trunk and the crown of one tree, as `forest_contact`."""
    height = -pos_ned[2]
    off_north = pos_ned[0] - tree.north
    off_east = pos_ned[1] - tree.east
    off_axis = wp.sqrt(off_north * off_north + off_east * off_east)
    # crown: distance from the vertical segment that is its axis
    off_up = height - wp.clamp(height, tree.crown_low, tree.crown_high)
    off_segment = wp.sqrt(off_axis * off_axis + off_up * off_up)
    contact = wp.vec4(0.0, 0.0, -1.0, radius + tree.crown_radius - off_segment)
    if off_segment > 0.0:
        contact = wp.vec4(off_north / off_segment, off_east / off_segment, -off_up / off_segment, contact[3])
    # trunk: its upper end lies inside the crown, so only its side can touch first
    trunk_depth = radius + tree.trunk_radius - off_axis
    if height < tree.crown_low and height > tree.root_height and trunk_depth > contact[3]:
        contact = wp.vec4(1.0, 0.0, 0.0, trunk_depth)
        if off_axis > 0.0:
            contact = wp.vec4(off_north / off_axis, off_east / off_axis, 0.0, trunk_depth)
    if contact[3] <= 0.0:
        contact = wp.vec4(0.0, 0.0, 0.0, 0.0)
    return contact


@wp.func
def forest_ray_hit(forest: Forest, origin_ned: wp.vec3, dir_ned: wp.vec3, max_m: float) -> float:
    """Distance [m] along a ray of unit direction to the first trunk or crown, `max_m` if none; 0 from inside one."""
    t = float(0.0)
    nearest = float(max_m)
    climb = -dir_ned[2]
    above_top = -origin_ned[2] - forest.top_m
    if above_top > 0.0:
        if climb * max_m > -above_top:
            return max_m
        t = above_top / -climb
    u_rate = dir_ned[0] * forest.buckets_per_m
    v_rate = dir_ned[1] * forest.buckets_per_m
    u = grid_coordinate(origin_ned[0], forest.half_size_m, forest.buckets_per_m)
    v = grid_coordinate(origin_ned[1], forest.half_size_m, forest.buckets_per_m)
    i = outer_cell(u + u_rate * t, forest.buckets)
    j = outer_cell(v + v_rate * t, forest.buckets)
    most_borders = 2 * forest.buckets + 4  # a straight ray crosses each line of the grid once
    for _ in range(most_borders):
        if i >= 0 and j >= 0 and i < forest.buckets and j < forest.buckets:
            bucket = i * forest.buckets + j
            for k in range(forest.bucket_start[bucket], forest.bucket_start[bucket + 1]):
                tree = forest.trees[forest.bucket_trees[k]]
                nearest = wp.min(nearest, tree_ray_hit(tree, origin_ned, dir_ned, max_m))
        t_north = next_border(u, u_rate, i, forest.buckets)
        t_east = next_border(v, v_rate, j, forest.buckets)
        t = wp.max(t, wp.min(t_north, t_east))
        # a tree hit beyond this bucket may hide behind one that only a later bucket lists
        if t >= nearest or (climb >= 0.0 and -origin_ned[2] + climb * t > forest.top_m):
            return nearest
        if t_north <= t_east:
            i = i + wp.where(u_rate > 0.0, 1, -1)
        else:
            j = j + wp.where(v_rate > 0.0, 1, -1)
    return nearest


@wp.func
def tree_ray_hit(tree: Tree, origin_ned: wp.vec3, dir_ned: wp.vec3, max_m: float) -> float:
    """Distance [m] along a ray to one tree, `max_m` if none; 0 from inside it."""
    off_north = origin_ned[0] - tree.north
    off_east = origin_ned[1] - tree.east
    pass_by = Passing()
    pass_by.level = dir_ned[0] * dir_ned[0] + dir_ned[1] * dir_ned[1]
    # measured from the point nearest to the axis: the textbook quadratic cancels digits far from a thin trunk
    if pass_by.level > _UPRIGHT:
        pass_by.t_axis = -(off_north * dir_ned[0] + off_east * dir_ned[1]) / pass_by.level
    near_north = off_north + pass_by.t_axis * dir_ned[0]
    near_east = off_east + pass_by.t_axis * dir_ned[1]
    pass_by.off_axis_squared = near_north * near_north + near_east * near_east
    if pass_by.off_axis_squared > tree.crown_radius * tree.crown_radius:
        return max_m
    pass_by.height = -origin_ned[2]
    pass_by.climb = -dir_ned[2]
    hit = side_hit(pass_by, tree.trunk_radius, tree.root_height, tree.crown_low, max_m)
    hit = side_hit(pass_by, tree.crown_radius, tree.crown_low, tree.crown_high, hit)
    low = wp.vec3(off_north, off_east, tree.crown_low + origin_ned[2])
    high = wp.vec3(off_north, off_east, tree.crown_high + origin_ned[2])
    return ball_hit(high, dir_ned, tree.crown_radius, ball_hit(low, dir_ned, tree.crown_radius, hit))


@wp.func
def side_hit(pass_by: Passing, radius: float, low: float, high: float, max_m: float) -> float:
    """Distance [m] along a ray to the side of a vertical cylinder, `max_m` if it is not nearer; 0 from inside it.

    Args:
        pass_by: how the ray passes the cylinder's axis.
        radius: of the cylinder [m].
        low: height of its lower end [m].
        high: height of its upper end [m].
        max_m: result when the side is not hit before [m].
    """
    spare = radius * radius - pass_by.off_axis_squared
    if spare <= 0.0:
        return max_m
    half = _FAR
    if pass_by.level > _UPRIGHT:
        half = wp.sqrt(spare / pass_by.level)
    entry = pass_by.t_axis - half
    if entry <= 0.0 and pass_by.t_axis + half > 0.0:
        if pass_by.height >= low and pass_by.height <= high:
            return 0.0
        return max_m
    entry_height = pass_by.height + pass_by.climb * entry
    if entry > 0.0 and entry < max_m and entry_height >= low and entry_height <= high:
        return entry
    return max_m


@wp.func
def ball_hit(off_ned: wp.vec3, dir_ned: wp.vec3, radius: float, max_m: float) -> float:
    """Distance [m] along a ray to a sphere, `max_m` if it is not nearer; 0 from inside it.

    Args:
        off_ned: origin of the ray minus centre of the sphere [m].
        dir_ned: direction, unit.
        radius: of the sphere [m].
        max_m: result when the sphere is not hit before [m].
    """
    t_near = -wp.dot(off_ned, dir_ned)
    near = off_ned + t_near * dir_ned
    spare = radius * radius - wp.dot(near, near)
    if spare <= 0.0:
        return max_m
    half = wp.sqrt(spare)
    if t_near + half <= 0.0:
        return max_m
    return wp.min(max_m, wp.max(0.0, t_near - half))


def tree_type() -> np.dtype[np.void]:
    """The NumPy type of one `Tree`."""
    kernel_type: Any = Tree
    return np.dtype(kernel_type.numpy_dtype())


def make_trees(
    seed: int,
    terrain: TerrainMap,
    density_per_ha: float,
    height_min_m: float,
    height_max_m: float,
    clearing_radius_m: float,
) -> NDArray[np.void]:
    """Seeded trees on a terrain: a structured array with the fields of `Tree`, shape (trees,).

    Args:
        seed: same seed, same bytes.
        terrain: the ground they stand on.
        density_per_ha: trees per hectare outside the clearing.
        height_min_m: of the lowest trees [m].
        height_max_m: of the highest trees [m].
        clearing_radius_m: radius round home into which no crown reaches [m].
    """
    points = np.zeros((0, 2))
    if density_per_ha > 0.0:
        spacing_m = sqrt(COVERAGE * 1.0e4 / density_per_ha)
        keep_out_m = clearing_radius_m + CROWN_RADIUS_FRACTION[1] * height_max_m
        points = poisson_disc(seed, terrain.size_m - 2.0 * EDGE_M, spacing_m, keep_out_m)
    fractions = np.random.default_rng([seed, 3]).random((len(points), 2))  # 3: stream of the tree sizes
    height = height_min_m + (height_max_m - height_min_m) * fractions[:, 0]
    crown_radius = height * (
        CROWN_RADIUS_FRACTION[0] + (CROWN_RADIUS_FRACTION[1] - CROWN_RADIUS_FRACTION[0]) * fractions[:, 1]
    )
    ground = terrain.height(points[:, 0], points[:, 1])
    trees: NDArray[np.void] = np.zeros(len(points), dtype=tree_type())
    trees["north"], trees["east"] = points[:, 0], points[:, 1]
    trees["root_height"] = ground - ROOT_M
    trees["trunk_radius"] = TRUNK_RADIUS_FRACTION * height
    trees["crown_low"] = ground + CROWN_BASE_FRACTION * height + crown_radius
    trees["crown_high"] = ground + height - crown_radius
    trees["crown_radius"] = crown_radius
    return trees


def fill_buckets(trees: NDArray[np.void], size_m: float) -> tuple[int, NDArray[np.int32], NDArray[np.int32]]:
    """Buckets per side, start of each bucket's list (buckets² + 1,), and the lists of tree indices."""
    buckets = max(1, ceil(size_m / BUCKET_M))
    scale = buckets / size_m
    reach = trees["crown_radius"] + CONTACT_MARGIN_M
    low = [np.floor((trees[axis] + 0.5 * size_m - reach) * scale).astype(np.int64) for axis in ("north", "east")]
    high = [np.floor((trees[axis] + 0.5 * size_m + reach) * scale).astype(np.int64) for axis in ("north", "east")]
    span = max((int((b - a).max(initial=0)) for a, b in zip(low, high, strict=True)), default=0)
    cells, indices = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for d_row in range(span + 1):
        for d_column in range(span + 1):
            row, column = low[0] + d_row, low[1] + d_column
            reached = (row <= high[0]) & (column <= high[1]) & (row >= 0) & (column >= 0)
            reached &= (row < buckets) & (column < buckets)
            cells.append((row * buckets + column)[reached])
            indices.append(np.flatnonzero(reached))
    cell, index = np.concatenate(cells), np.concatenate(indices)
    order = np.lexsort((index, cell))
    start = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=buckets * buckets))])
    return buckets, start.astype(np.int32), index[order].astype(np.int32)


@dataclass(frozen=True, eq=False, slots=True)
class ForestMap:
    """The trees on the host, queried in float64 for any number of points at once."""

    trees: NDArray[np.void]  # fields of `Tree`, (trees,)
    size_m: float

    @property
    def top_m(self) -> float:
        """Height of the highest crown above the home plane [m]; far below ground without trees."""
        return float((self.trees["crown_high"] + self.trees["crown_radius"]).max(initial=NO_OBSTACLE_M))

    def kernel(self, device: str) -> Forest:
        """The trees as kernels read them."""
        buckets, start, indices = fill_buckets(self.trees, self.size_m)
        forest = Forest()
        forest.trees = wp.array(self.trees, dtype=Tree, device=device)
        forest.tree_count = len(self.trees)
        forest.bucket_start = wp.array(start, dtype=wp.int32, device=device)
        forest.bucket_trees = wp.array(indices, dtype=wp.int32, device=device)
        forest.buckets = buckets
        forest.buckets_per_m = buckets / self.size_m
        forest.half_size_m = 0.5 * self.size_m
        forest.top_m = self.top_m
        return forest

    def distance(self, pos_ned: FloatArray) -> FloatArray:
        """Distance [m] from each point (points, 3) to the nearest trunk or crown; negative inside, inf for none."""
        nearest = np.full(len(pos_ned), np.inf)
        for first in range(0, len(pos_ned), 256):  # neighbours in time share their few trees
            part = slice(first, first + 256)
            nearest[part] = self._distance_to(self._candidates(pos_ned[part]), pos_ned[part])
        return nearest

    def _candidates(self, pos_ned: FloatArray) -> NDArray[np.void]:
        """The trees that can be the nearest to at least one of a cluster of points."""
        trees = self.trees
        if trees.size == 0:
            return trees
        centre = pos_ned[:, :2].mean(axis=0)
        spread = np.sqrt(((pos_ned[:, :2] - centre) ** 2).sum(axis=1).max())
        off_centre = np.sqrt((trees["north"] - centre[0]) ** 2 + (trees["east"] - centre[1]) ** 2)
        known = self._distance_to(trees[[int(off_centre.argmin())]], pos_ned).max()
        return np.asarray(trees[off_centre - spread - trees["crown_radius"] <= known])

    @staticmethod
    def _distance_to(trees: Any, pos_ned: FloatArray) -> FloatArray:
        north, east, height = (pos_ned[:, [0]], pos_ned[:, [1]], -pos_ned[:, [2]])
        off_axis = np.sqrt((north - trees["north"]) ** 2 + (east - trees["east"]) ** 2)
        off_up = height - np.clip(height, trees["crown_low"], trees["crown_high"])
        crown = np.sqrt(off_axis**2 + off_up**2) - trees["crown_radius"]
        is_beside_trunk = (height < trees["crown_low"]) & (height > trees["root_height"])
        trunk = np.where(is_beside_trunk, off_axis - trees["trunk_radius"], np.inf)
        return np.asarray(np.minimum(crown, trunk).min(axis=1, initial=np.inf))

    def ray_hit(self, origin_ned: FloatArray, dir_ned: FloatArray, max_m: float) -> float:
        """Distance [m] along a ray of unit direction to the first trunk or crown, as `forest_ray_hit`."""
        trees = self.trees
        north, east = origin_ned[0] - trees["north"], origin_ned[1] - trees["east"]
        hits = [np.array([max_m])]
        sides = (("trunk_radius", "root_height", "crown_low"), ("crown_radius", "crown_low", "crown_high"))
        for radius, low, high in sides:
            hits.append(_entry_of_sides(north, east, origin_ned, dir_ned, trees[radius], trees[low], trees[high]))
        for end in ("crown_low", "crown_high"):
            off = np.stack([north, east, trees[end] + origin_ned[2]], axis=-1)
            t_near = -off @ dir_ned
            spare = trees["crown_radius"] ** 2 - (off**2).sum(axis=-1) + t_near**2
            half = np.sqrt(np.maximum(spare, 0.0))
            hits.append(np.maximum(t_near - half, 0.0)[(spare > 0.0) & (t_near + half > 0.0)])
        return float(min(np.concatenate(hits).min(), max_m))


def _entry_of_sides(
    north: FloatArray,
    east: FloatArray,
    origin_ned: FloatArray,
    dir_ned: FloatArray,
    radius: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    """Distances [m] at which a ray enters the sides of vertical cylinders, those it misses left out."""
    level = float(dir_ned[0] ** 2 + dir_ned[1] ** 2)
    excess = north**2 + east**2 - radius**2
    height = -origin_ned[2]
    is_inside = (excess < 0.0) & (height >= low) & (height <= high)
    if level <= _UPRIGHT:
        return np.zeros(int(is_inside.sum()))
    half_b = north * dir_ned[0] + east * dir_ned[1]
    discriminant = half_b**2 - level * excess
    entry = (-half_b - np.sqrt(np.maximum(discriminant, 0.0))) / level
    entry_height = height - dir_ned[2] * entry
    is_hit = (discriminant > 0.0) & (entry > 0.0) & (entry_height >= low) & (entry_height <= high)
    return np.asarray(np.where(is_inside, 0.0, entry)[is_hit | is_inside])
