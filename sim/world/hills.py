"""Kernels that raise the hills of the chosen worlds of a batch: those of `terrain.make_heights`, in float32.

In: `Growing`. Out: the heights of the chosen worlds, and how high their ground and its edges reach. Launched in the
order of this file; a thread takes one row of the terrain's grid.
"""

import warp as wp

from sim.rng_streams import HILLS
from sim.world.growing import Growing
from sim.world.terrain import LACUNARITY, PERSISTENCE

wp.set_module_options({"enable_backward": False})

_LACUNARITY = wp.constant(LACUNARITY)
_PERSISTENCE = wp.constant(PERSISTENCE)
_LEAST_WAVELENGTH_M = wp.constant(1.0)  # below it lattice numbers lose digits
_LEAST_BLEND_M = wp.constant(1.0e-3)


@wp.func
def lattice_gradient(row_key: wp.uint32, j: int) -> wp.vec2:
    """Unit gradient at column `j` of the lattice row that the key names."""
    state = wp.rand_init(int(row_key), j)
    x = 2.0 * wp.randf(state) - 1.0
    y = 2.0 * wp.randf(state) - 1.0
    return wp.vec2(x, y) / wp.sqrt(x * x + y * y + 1.0e-12)


@wp.func
def smooth(x: float) -> float:
    """`terrain.smootherstep`."""
    return x * x * x * (x * (x * 6.0 - 15.0) + 10.0)


@wp.func
def add_octave(
    heights: wp.array2d[wp.float32], key: wp.uint32, row: int, lattice_per_cell: float, amplitude: float
) -> None:
    """Adds one layer of gradient noise (Perlin 2002) to a row of the terrain's grid, from west to east."""
    north = float(row) * lattice_per_cell
    i = int(north)
    u = north - float(i)
    fade_u = smooth(u)
    south_key = wp.rand_init(int(key), i)
    north_key = wp.rand_init(int(key), i + 1)
    south_west = wp.vec2(0.0, 0.0)
    north_west = wp.vec2(0.0, 0.0)
    south_east = wp.vec2(0.0, 0.0)
    north_east = wp.vec2(0.0, 0.0)
    at = int(-2)
    for column in range(heights.shape[1]):
        east = float(column) * lattice_per_cell
        j = int(east)
        if j != at:
            if j == at + 1:
                south_west = south_east
                north_west = north_east
            else:
                south_west = lattice_gradient(south_key, j)
                north_west = lattice_gradient(north_key, j)
            south_east = lattice_gradient(south_key, j + 1)
            north_east = lattice_gradient(north_key, j + 1)
            at = j
        v = east - float(j)
        fade_v = smooth(v)
        south = wp.lerp(south_west[0] * u + south_west[1] * v, south_east[0] * u + south_east[1] * (v - 1.0), fade_v)
        beyond = wp.lerp(
            north_west[0] * (u - 1.0) + north_west[1] * v,
            north_east[0] * (u - 1.0) + north_east[1] * (v - 1.0),
            fade_v,
        )
        heights[row, column] = heights[row, column] + amplitude * wp.lerp(south, beyond, fade_u)


@wp.kernel(enable_backward=False)
def raise_noise(growing: Growing, groups: int) -> None:
    """Fractal noise in place of the heights: LACUNARITY and PERSISTENCE from each octave to the next."""
    group, row = wp.tid()
    for slot in range(group, growing.chosen_count[0], groups):
        i_world = growing.chosen[slot]
        terrain = growing.worlds[i_world].terrain
        for column in range(terrain.cells + 1):
            terrain.heights[row, column] = 0.0
        wavelength_m = wp.max(growing.params[i_world].hill_wavelength_m, _LEAST_WAVELENGTH_M)
        lattice_per_cell = 1.0 / (wavelength_m * terrain.cells_per_m)
        amplitude = float(1.0)
        hills_key = wp.rand_init(growing.seeds[i_world], HILLS)
        for octave in range(growing.octaves):
            add_octave(terrain.heights, wp.rand_init(int(hills_key), octave), row, lattice_per_cell, amplitude)
            lattice_per_cell *= _LACUNARITY
            amplitude *= _PERSISTENCE


@wp.kernel(enable_backward=False)
def find_highest(growing: Growing, groups: int) -> None:
    """The noise at home, and its largest rise or fall from there."""
    group, row = wp.tid()
    for slot in range(group, growing.chosen_count[0], groups):
        i_world = growing.chosen[slot]
        terrain = growing.worlds[i_world].terrain
        middle = terrain.heights[terrain.cells // 2, terrain.cells // 2]
        if row == 0:
            growing.middle[i_world] = middle
        highest = float(0.0)
        for column in range(terrain.cells + 1):
            highest = wp.max(highest, wp.abs(terrain.heights[row, column] - middle))
        wp.atomic_max(growing.highest, i_world, highest)


@wp.kernel(enable_backward=False)
def shape_hills(growing: Growing, groups: int) -> None:
    """Heights from the noise: within the bound of the hills, level in the clearing, and how high they reach."""
    group, row = wp.tid()
    for slot in range(group, growing.chosen_count[0], groups):
        i_world = growing.chosen[slot]
        terrain = growing.worlds[i_world].terrain
        params = growing.params[i_world]
        scale = float(0.0)
        if growing.highest[i_world] > 0.0:
            scale = params.hill_height_m / growing.highest[i_world]
        cell_m = 1.0 / terrain.cells_per_m
        # triangles that reach into the clearing have corners up to a cell's diagonal outside of it
        level_radius_m = params.clearing_radius_m + 1.5 * cell_m
        north = float(row) * cell_m - terrain.half_size_m
        row_max = float(-1.0e9)
        edge_max = float(-1.0e9)
        for column in range(terrain.cells + 1):
            east = float(column) * cell_m - terrain.half_size_m
            beyond_m = wp.sqrt(north * north + east * east) - level_radius_m
            fraction = smooth(wp.clamp(beyond_m / wp.max(params.clearing_blend_m, _LEAST_BLEND_M), 0.0, 1.0))
            hill = (terrain.heights[row, column] - growing.middle[i_world]) * scale
            # the product may exceed the bound by a rounding
            height = wp.clamp(hill, -params.hill_height_m, params.hill_height_m) * fraction + 0.0
            terrain.heights[row, column] = height
            row_max = wp.max(row_max, height)
            if row == 0 or row == terrain.cells or column == 0 or column == terrain.cells:
                edge_max = wp.max(edge_max, height)
        wp.atomic_max(growing.ground_max_m, i_world, row_max)
        wp.atomic_max(growing.edge_max_m, i_world, edge_max)


@wp.kernel(enable_backward=False)
def keep_ground(growing: Growing, groups: int, ground_max_m: float, edge_max_m: float) -> None:
    """How high the ground of the chosen worlds reaches, and along the edges of the map; it is the same for all."""
    group = wp.tid()
    for slot in range(group, growing.chosen_count[0], groups):
        i_world = growing.chosen[slot]
        growing.ground_max_m[i_world] = ground_max_m
        growing.edge_max_m[i_world] = edge_max_m
