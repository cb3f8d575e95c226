"""Kernels that grow worlds: how the chosen worlds of a batch are prepared, planted and completed, from a seed each.

In: `Growing`, the numbers and the scratch of a batch. Out: the `World` rows. `choose` comes first, then the hills
(`hills.py`), then `plant` again and again, and `settle`, each for all chosen worlds; a thread takes one cell of a
planting grid or a whole world. The trees stand on Poisson-disc points, planted as in `poisson.py`.
"""

import warp as wp

from sim.rng_streams import TREE_POSITIONS, TREE_SIZES
from sim.world.terrain import Terrain, terrain_height
from sim.world.trees import (
    CONTACT_MARGIN_M,
    CROWN_BASE_FRACTION,
    CROWN_RADIUS_FRACTION,
    EDGE_M,
    NO_OBSTACLE_M,
    ROOT_M,
    TRUNK_RADIUS_FRACTION,
    Forest,
    Tree,
)
from sim.world.world import World

wp.set_module_options({"enable_backward": False})

ROUNDS = 3  # times each empty cell is visited
DARTS = wp.constant(4)  # thrown at it in each visit
PHASES = 9  # cells three apart cannot disturb each other (Wei 2008)
COVERAGE = wp.constant(0.655)  # points per spacing² reached with these darts; measured
EMPTY_M = wp.constant(1.0e9)  # coordinate of the point of an empty cell [m]

_CROWN_RADIUS_LEAST = wp.constant(CROWN_RADIUS_FRACTION[0])
_CROWN_RADIUS_MOST = wp.constant(CROWN_RADIUS_FRACTION[1])
_CROWN_BASE = wp.constant(CROWN_BASE_FRACTION)
_TRUNK_RADIUS = wp.constant(TRUNK_RADIUS_FRACTION)
_ROOT_M = wp.constant(ROOT_M)
_EDGE_M = wp.constant(EDGE_M)
_MARGIN_M = wp.constant(CONTACT_MARGIN_M)
_NO_OBSTACLE = wp.constant(NO_OBSTACLE_M)
_SQRT_HALF = wp.constant(0.7071067811865476)
_SQUARE_M_PER_HA = wp.constant(1.0e4)


@wp.struct
class WorldParams:
    """What one world of a batch is grown from; the fields are those of `WorldConfig`."""

    hill_height_m: float
    hill_wavelength_m: float
    clearing_radius_m: float
    clearing_blend_m: float
    trees_per_ha: float
    tree_height_min_m: float
    tree_height_max_m: float
    has_walls: int
    wall_height_m: float
    wall_count: int
    mover_count: int
    spot_count: int


@wp.struct
class Grid:
    """The planting grid of one world: cells that hold one point at most."""

    side_m: float
    spacing_m: float
    cell_m: float
    cells: int  # per side
    keep_out_m: float  # radius round home without trees
    tree_height_max_m: float


@wp.struct
class Growing:
    """A batch of worlds and what is needed to grow them; arrays have one row per world."""

    worlds: wp.array[World]
    params: wp.array[WorldParams]
    seeds: wp.array[wp.int32]
    chosen: wp.array[wp.int32]  # indices of the worlds to grow, the first `chosen_count`
    chosen_count: wp.array[wp.int32]  # (1,)
    grids: wp.array[Grid]
    middle: wp.array[wp.float32]  # noise at home
    highest: wp.array[wp.float32]  # largest rise or fall of the noise from there
    ground_max_m: wp.array[wp.float32]
    edge_max_m: wp.array[wp.float32]  # highest ground along the edges of the map
    points: wp.array2d[wp.vec2]  # (worlds, most_cells²) [m] from the planting square's corner; all empty between calls
    most_cells: int  # per side of a planting grid
    octaves: int
    trees_per_ha_max: float
    tree_height_limit_m: float


@wp.struct
class BucketSpan:
    """The rows and columns of buckets that list a tree, ends included."""

    row_low: int
    row_high: int
    column_low: int
    column_high: int


@wp.func
def planting_grid(growing: Growing, i_world: int) -> Grid:
    """The planting grid of a world, within the limits of the batch; no cells when it has no trees."""
    params = growing.params[i_world]
    grid = Grid()
    grid.tree_height_max_m = wp.min(params.tree_height_max_m, growing.tree_height_limit_m)
    grid.keep_out_m = params.clearing_radius_m + _CROWN_RADIUS_MOST * grid.tree_height_max_m
    grid.side_m = 2.0 * (growing.worlds[i_world].terrain.half_size_m - _EDGE_M)
    density = wp.min(params.trees_per_ha, growing.trees_per_ha_max)
    if density > 0.0 and grid.side_m > 0.0:
        grid.spacing_m = wp.sqrt(COVERAGE * _SQUARE_M_PER_HA / density)
        grid.cell_m = grid.spacing_m * _SQRT_HALF
        grid.cells = wp.min(int(wp.ceil(grid.side_m / grid.cell_m)), growing.most_cells)
    return grid


@wp.kernel(enable_backward=False)
def choose(growing: Growing, is_chosen: wp.array[wp.bool], seeds: wp.array[wp.int32]) -> None:
    """Lists the chosen worlds, in any order, takes their seeds and lays out their planting grids."""
    i_world = wp.tid()
    if not is_chosen[i_world]:
        return
    growing.chosen[wp.atomic_add(growing.chosen_count, 0, 1)] = i_world
    growing.seeds[i_world] = seeds[i_world]
    growing.grids[i_world] = planting_grid(growing, i_world)
    growing.highest[i_world] = 0.0
    growing.ground_max_m[i_world] = -1.0e9
    growing.edge_max_m[i_world] = -1.0e9


@wp.func
def is_free(points: wp.array2d[wp.vec2], i_world: int, grid: Grid, row: int, column: int, dart: wp.vec2) -> bool:
    """Whether no point of the neighbouring cells is nearer to the dart than the spacing."""
    for i in range(wp.max(row - 2, 0), wp.min(row + 3, grid.cells)):
        for j in range(wp.max(column - 2, 0), wp.min(column + 3, grid.cells)):
            off = points[i_world, i * grid.cells + j] - dart
            if wp.dot(off, off) < grid.spacing_m * grid.spacing_m:
                return False
    return True


@wp.kernel(enable_backward=False)
def plant(growing: Growing, groups: int, visit: int) -> None:
    """One visit to a ninth of the cells of each planting grid: darts until one lands free, DARTS at most."""
    group, grid_row, grid_column = wp.tid()
    for slot in range(group, growing.chosen_count[0], groups):
        i_world = growing.chosen[slot]
        grid = growing.grids[i_world]
        key = wp.rand_init(growing.seeds[i_world], TREE_POSITIONS)
        # each world and round begins at another ninth
        phase = (visit + int(wp.rand_init(int(key), visit // PHASES) % wp.uint32(PHASES))) % PHASES
        row = 3 * grid_row + phase // 3
        column = 3 * grid_column + phase % 3
        cell = row * grid.cells + column
        if row < grid.cells and column < grid.cells and growing.points[i_world, cell][0] == EMPTY_M:
            middle = wp.vec2(0.5 * grid.side_m, 0.5 * grid.side_m)
            state = wp.rand_init(int(wp.rand_init(int(key), ROUNDS + visit // PHASES)), cell)
            has_landed = bool(False)
            for _ in range(DARTS):
                north = (float(row) + wp.randf(state)) * grid.cell_m
                east = (float(column) + wp.randf(state)) * grid.cell_m
                dart = wp.vec2(north, east)
                if not has_landed and wp.max(north, east) < grid.side_m and wp.length(dart - middle) > grid.keep_out_m:
                    if is_free(growing.points, i_world, grid, row, column, dart):
                        growing.points[i_world, cell] = dart
                        has_landed = True


@wp.func
def grown_tree(terrain: Terrain, params: WorldParams, height_max_m: float, position: wp.vec2, key: wp.uint32) -> Tree:
    """The tree at a position [m], with the proportions of `trees.make_trees`."""
    state = key
    height_min_m = wp.min(params.tree_height_min_m, height_max_m)
    height = height_min_m + (height_max_m - height_min_m) * wp.randf(state)
    crown_fraction = _CROWN_RADIUS_LEAST + (_CROWN_RADIUS_MOST - _CROWN_RADIUS_LEAST) * wp.randf(state)
    ground = terrain_height(terrain, position[0], position[1])
    tree = Tree()
    tree.north = position[0]
    tree.east = position[1]
    tree.root_height = ground - _ROOT_M
    tree.trunk_radius = _TRUNK_RADIUS * height
    tree.crown_radius = height * crown_fraction
    tree.crown_low = ground + _CROWN_BASE * height + tree.crown_radius
    tree.crown_high = ground + height - tree.crown_radius
    return tree


@wp.func
def bucket_of(forest: Forest, coordinate_m: float) -> int:
    """Row or column of the bucket at a coordinate, that of the nearest edge beyond the map."""
    return wp.clamp(int((coordinate_m + forest.half_size_m) * forest.buckets_per_m), 0, forest.buckets - 1)


@wp.func
def bucket_span(forest: Forest, tree: Tree) -> BucketSpan:
    """The buckets that list a tree: those it reaches within CONTACT_MARGIN_M of."""
    reach = tree.crown_radius + _MARGIN_M
    span = BucketSpan()
    span.row_low = bucket_of(forest, tree.north - reach)
    span.row_high = bucket_of(forest, tree.north + reach)
    span.column_low = bucket_of(forest, tree.east - reach)
    span.column_high = bucket_of(forest, tree.east + reach)
    return span


@wp.func
def collect_trees(growing: Growing, i_world: int, forest: Forest) -> Forest:
    """Trees on the planted points, and how many each bucket lists, in the element after its start.

    Empties the planting grid for the next time. A tree for which the store has no room is left out.
    """
    grid = growing.grids[i_world]
    terrain = growing.worlds[i_world].terrain
    params = growing.params[i_world]
    sizes_key = wp.rand_init(growing.seeds[i_world], TREE_SIZES)
    for bucket in range(forest.bucket_start.shape[0]):
        forest.bucket_start[bucket] = 0
    tree_count = int(0)
    entries = int(0)
    top_m = float(_NO_OBSTACLE)
    corner = wp.vec2(0.5 * grid.side_m, 0.5 * grid.side_m)
    for cell in range(grid.cells * grid.cells):
        point = growing.points[i_world, cell]
        if point[0] != EMPTY_M:
            growing.points[i_world, cell] = wp.vec2(EMPTY_M, EMPTY_M)
            tree = grown_tree(
                terrain, params, grid.tree_height_max_m, point - corner, wp.rand_init(int(sizes_key), cell)
            )
            span = bucket_span(forest, tree)
            wanted = (span.row_high - span.row_low + 1) * (span.column_high - span.column_low + 1)
            if tree_count < forest.trees.shape[0] and entries + wanted <= forest.bucket_trees.shape[0]:
                forest.trees[tree_count] = tree
                tree_count += 1
                entries += wanted
                top_m = wp.max(top_m, tree.crown_high + tree.crown_radius)
                for row in range(span.row_low, span.row_high + 1):
                    for column in range(span.column_low, span.column_high + 1):
                        following = row * forest.buckets + column + 1
                        forest.bucket_start[following] = forest.bucket_start[following] + 1
    forest.tree_count = tree_count
    forest.top_m = top_m
    return forest


@wp.func
def list_trees(forest: Forest) -> None:
    """Fills the buckets' lists, each in ascending order, from how many they hold."""
    bucket_count = forest.buckets * forest.buckets
    for bucket in range(bucket_count):
        forest.bucket_start[bucket + 1] = forest.bucket_start[bucket + 1] + forest.bucket_start[bucket]
    # the starts run ahead to the ends while the lists are filled
    for i_tree in range(forest.tree_count):
        span = bucket_span(forest, forest.trees[i_tree])
        for row in range(span.row_low, span.row_high + 1):
            for column in range(span.column_low, span.column_high + 1):
                bucket = row * forest.buckets + column
                forest.bucket_trees[forest.bucket_start[bucket]] = i_tree
                forest.bucket_start[bucket] = forest.bucket_start[bucket] + 1
    for k in range(bucket_count):
        forest.bucket_start[bucket_count - k] = forest.bucket_start[bucket_count - k - 1]
    forest.bucket_start[0] = 0


@wp.kernel(enable_backward=False)
def settle(growing: Growing, groups: int) -> None:
    """Makes the trees and their buckets of the planted points, and completes the `World` rows."""
    group = wp.tid()
    for slot in range(group, growing.chosen_count[0], groups):
        i_world = growing.chosen[slot]
        world = growing.worlds[i_world]
        world.forest = collect_trees(growing, i_world, world.forest)
        list_trees(world.forest)
        world.terrain.ground_max_m = growing.ground_max_m[i_world]
        world.walls.is_built = growing.params[i_world].has_walls
        world.walls.top_m = growing.edge_max_m[i_world] + growing.params[i_world].wall_height_m
        growing.worlds[i_world] = world
