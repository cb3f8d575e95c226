"""Terrain: fractal hills on a square map, with a level clearing at home.

The surface is defined by a grid of heights joined by two flat triangles per cell (split from its south-west to its
north-east corner), and continues level beyond the edges of the map. Height, normal and ray hits are exact for that
surface, in kernels and on the host; the ray goes from cell border to cell border, so it cannot step over a ridge.
Made once per world from a seed; queried at up to 1 kHz per vehicle. Heights are metres up from the home plane.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

wp.set_module_options({"enable_backward": False})

FloatArray = NDArray[np.float64]

LACUNARITY = 2.0  # wavelength ratio of neighbouring octaves, Perlin 1985
PERSISTENCE = 0.45  # amplitude ratio of neighbouring octaves; guess, 0.5 leaves the ground too rough to land on
_NEVER = wp.constant(1.0e30)  # ray parameter of a border that is never crossed
_PARALLEL = wp.constant(1.0e-9)  # direction component below which a ray never crosses a border [cells/m]


@wp.struct
class Terrain:
    """Height grid of one world."""

    heights: wp.array2d[wp.float32]  # [m] up, (cells + 1, cells + 1), rows to the north, columns to the east
    cells: int  # per side
    cells_per_m: float
    half_size_m: float  # the map spans [-half_size, half_size] in north and east
    ground_max_m: float


@wp.func
def grid_coordinate(x: float, half_size_m: float, cells_per_m: float) -> float:
    """Position [m] as a number of cells from the map's south or west edge."""
    return (x + half_size_m) * cells_per_m


@wp.func
def next_border(start: float, rate: float, cell: int, cells: int) -> float:
    """Ray parameter [m] at which one coordinate leaves `cell`; cells -1 and `cells` reach to infinity.

    Args:
        start: coordinate of the ray's origin [cells].
        rate: its change per metre of ray [cells/m].
        cell: index of the cell the ray is in, -1..cells.
        cells: number of cells per side.
    """
    t = _NEVER
    if rate > _PARALLEL and cell < cells:
        t = (float(cell + 1) - start) / rate
    if rate < -_PARALLEL and cell >= 0:
        t = (float(cell) - start) / rate
    return t


@wp.func
def outer_cell(coordinate: float, cells: int) -> int:
    """Index of the cell of a grid coordinate, -1 and `cells` standing for all that is beyond the map."""
    return int(wp.floor(wp.clamp(coordinate, -1.0, float(cells))))


@wp.func
def terrain_height(terrain: Terrain, north: float, east: float) -> float:
    """Ground height above the home plane [m]."""
    # Warp's clamp turns NaN into its lower bound: no position reads outside the array
    u = wp.clamp(grid_coordinate(north, terrain.half_size_m, terrain.cells_per_m), 0.0, float(terrain.cells))
    v = wp.clamp(grid_coordinate(east, terrain.half_size_m, terrain.cells_per_m), 0.0, float(terrain.cells))
    i = wp.min(int(u), terrain.cells - 1)
    j = wp.min(int(v), terrain.cells - 1)
    u = u - float(i)
    v = v - float(j)
    south_west = terrain.heights[i, j]
    north_east = terrain.heights[i + 1, j + 1]
    if u >= v:
        corner = terrain.heights[i + 1, j]
        return south_west + u * (corner - south_west) + v * (north_east - corner)
    corner = terrain.heights[i, j + 1]
    return south_west + v * (corner - south_west) + u * (north_east - corner)


@wp.func
def terrain_normal_ned(terrain: Terrain, north: float, east: float) -> wp.vec3:
    """Unit normal of the ground, pointing up (z < 0)."""
    u_map = grid_coordinate(north, terrain.half_size_m, terrain.cells_per_m)
    v_map = grid_coordinate(east, terrain.half_size_m, terrain.cells_per_m)
    u = wp.clamp(u_map, 0.0, float(terrain.cells))
    v = wp.clamp(v_map, 0.0, float(terrain.cells))
    i = wp.min(int(u), terrain.cells - 1)
    j = wp.min(int(v), terrain.cells - 1)
    south_west = terrain.heights[i, j]
    north_east = terrain.heights[i + 1, j + 1]
    slope_north = float(0.0)
    slope_east = float(0.0)
    if u - float(i) >= v - float(j):
        corner = terrain.heights[i + 1, j]
        slope_north = corner - south_west
        slope_east = north_east - corner
    else:
        corner = terrain.heights[i, j + 1]
        slope_north = north_east - corner
        slope_east = corner - south_west
    # beyond an edge the ground continues level across that edge
    if u != u_map:
        slope_north = 0.0
    if v != v_map:
        slope_east = 0.0
    return wp.normalize(wp.vec3(-slope_north * terrain.cells_per_m, -slope_east * terrain.cells_per_m, -1.0))


@wp.func
def gap_above_ground(terrain: Terrain, pos_ned: wp.vec3) -> float:
    """Height of a point above the ground below it [m]."""
    return -pos_ned[2] - terrain_height(terrain, pos_ned[0], pos_ned[1])


@wp.func
def terrain_ray_hit(terrain: Terrain, origin_ned: wp.vec3, dir_ned: wp.vec3, max_m: float) -> float:
    """Distance [m] along a ray of unit direction to the first ground it meets, `max_m` if none; 0 from under ground.

    Along the ray the height above ground is linear between the borders and diagonals of cells (Amanatides and Woo 1987
    for the walk), so its sign at these points finds the first hit and a linear equation gives it.
    """
    t = float(0.0)
    t_end = float(max_m)
    climb = -dir_ned[2]
    # only the stretch below the highest ground can hit
    above_top = -origin_ned[2] - terrain.ground_max_m
    if above_top > 0.0:
        if climb * max_m > -above_top:
            return max_m
        t = above_top / -climb
    u_rate = dir_ned[0] * terrain.cells_per_m
    v_rate = dir_ned[1] * terrain.cells_per_m
    u = grid_coordinate(origin_ned[0], terrain.half_size_m, terrain.cells_per_m)
    v = grid_coordinate(origin_ned[1], terrain.half_size_m, terrain.cells_per_m)
    i = outer_cell(u + u_rate * t, terrain.cells)
    j = outer_cell(v + v_rate * t, terrain.cells)
    gap = gap_above_ground(terrain, origin_ned + t * dir_ned)
    if gap <= 0.0:
        return t
    most_borders = 2 * terrain.cells + 4  # a straight ray crosses each line of the grid once
    for _ in range(most_borders):
        t_north = next_border(u, u_rate, i, terrain.cells)
        t_east = next_border(v, v_rate, j, terrain.cells)
        t_exit = wp.max(t, wp.min(t_end, wp.min(t_north, t_east)))
        # the diagonal of the cell, if it is crossed inside
        t_mid = t_exit
        if wp.abs(u_rate - v_rate) > _PARALLEL:
            t_mid = wp.clamp(((v - float(j)) - (u - float(i))) / (u_rate - v_rate), t, t_exit)
        gap_mid = gap_above_ground(terrain, origin_ned + t_mid * dir_ned)
        if gap_mid <= 0.0:
            return t + (t_mid - t) * gap / (gap - gap_mid)
        gap_exit = gap_above_ground(terrain, origin_ned + t_exit * dir_ned)
        if gap_exit <= 0.0:
            return t_mid + (t_exit - t_mid) * gap_mid / (gap_mid - gap_exit)
        if t_exit >= t_end:
            return max_m
        t = t_exit
        gap = gap_exit
        if climb >= 0.0 and -origin_ned[2] + climb * t > terrain.ground_max_m:
            return max_m
        if t_north <= t_east:
            i = i + wp.where(u_rate > 0.0, 1, -1)
        else:
            j = j + wp.where(v_rate > 0.0, 1, -1)
    return max_m


def _gradient_noise(rng: np.random.Generator, along: FloatArray) -> FloatArray:
    """Gradient noise (Perlin 2002) at all pairs of ascending lattice coordinates >= 0, shape (count, count).

    Only +, *, / and sqrt are used, which IEEE 754 rounds the same on every machine.
    """
    count = int(along[-1]) + 2
    gradient = 2.0 * rng.random((2, count, count)) - 1.0
    gradient /= np.sqrt(gradient[0] ** 2 + gradient[1] ** 2 + 1.0e-12)
    i, j = along.astype(np.int64)[:, None], along.astype(np.int64)[None, :]
    u, v = along[:, None] - i, along[None, :] - j

    def ramp(di: int, dj: int) -> FloatArray:
        return gradient[0, i + di, j + dj] * (u - di) + gradient[1, i + di, j + dj] * (v - dj)

    fade_u, fade_v = smootherstep(u), smootherstep(v)
    south_west, north_west = ramp(0, 0), ramp(1, 0)
    south = south_west + fade_v * (ramp(0, 1) - south_west)
    north_side = north_west + fade_v * (ramp(1, 1) - north_west)
    noise: FloatArray = south + fade_u * (north_side - south)
    return noise


def smootherstep(x: FloatArray) -> FloatArray:
    """Quintic step from 0 at x = 0 to 1 at x = 1 with level ends of first and second order (Perlin 2002)."""
    return x * x * x * (x * (x * 6.0 - 15.0) + 10.0)


@lru_cache(maxsize=8)  # one flight after another is over the same ground
def make_heights(
    seed: int,
    cells: int,
    size_m: float,
    hill_height_m: float,
    hill_wavelength_m: float,
    octaves: int,
    clearing_radius_m: float,
    blend_m: float,
) -> NDArray[np.float32]:
    """Seeded heights [m] of the grid points, shape (cells + 1, cells + 1), read-only.

    They are 0 in the clearing and within ±hill_height_m.

    Args:
        seed: same seed, same bytes.
        cells: number of cells per side.
        size_m: side of the map [m].
        hill_height_m: largest rise or fall from home on the map [m].
        hill_wavelength_m: wavelength of the broadest hills [m].
        octaves: number of noise layers, each LACUNARITY finer than the one before.
        clearing_radius_m: radius round home that is exactly level [m].
        blend_m: width of the ring in which the hills grow to full height [m].
    """
    rng = np.random.default_rng([seed, 1])  # 1: stream of the terrain
    along: FloatArray = np.arange(cells + 1, dtype=np.float64) * (size_m / cells)
    noise = np.zeros((cells + 1, cells + 1))
    for octave in range(octaves):
        scale = float(LACUNARITY**octave) / hill_wavelength_m
        noise += float(PERSISTENCE**octave) * _gradient_noise(rng, along * scale)
    middle = along - 0.5 * size_m
    distance = np.sqrt(middle[:, None] ** 2 + middle[None, :] ** 2)
    noise -= noise[cells // 2, cells // 2]
    # triangles that reach into the clearing have corners up to a cell's diagonal outside of it
    level_radius = clearing_radius_m + 1.5 * size_m / cells
    highest = float(np.abs(noise).max())
    hills = noise * (hill_height_m / highest if highest > 0.0 else 0.0)
    heights = (hills * smootherstep(np.clip((distance - level_radius) / blend_m, 0.0, 1.0)) + 0.0).astype(np.float32)
    heights.setflags(write=False)
    return heights


@dataclass(frozen=True, eq=False, slots=True)
class TerrainMap:
    """The terrain on the host: the same surface in float64, for any number of points at once."""

    heights: NDArray[np.float32]  # [m] up, (cells + 1, cells + 1)
    size_m: float

    @property
    def cells(self) -> int:
        """Number of cells per side."""
        return self.heights.shape[0] - 1

    def kernel(self, device: str) -> Terrain:
        """The terrain as kernels read it."""
        terrain = Terrain()
        terrain.heights = wp.array(self.heights, dtype=wp.float32, device=device)
        terrain.cells = self.cells
        terrain.cells_per_m = self.cells / self.size_m
        terrain.half_size_m = 0.5 * self.size_m
        terrain.ground_max_m = float(self.heights.max())
        return terrain

    def _coordinates(self, north: ArrayLike, east: ArrayLike) -> tuple[FloatArray, FloatArray]:
        scale = self.cells / self.size_m
        u = (np.asarray(north, np.float64) + 0.5 * self.size_m) * scale
        v = (np.asarray(east, np.float64) + 0.5 * self.size_m) * scale
        u, v = np.broadcast_arrays(u, v)
        return u, v

    def _triangles(
        self, u_map: FloatArray, v_map: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        """South-west corner height, its rise per cell to the north and east, and the position in the cell."""
        u, v = np.clip(u_map, 0.0, self.cells), np.clip(v_map, 0.0, self.cells)
        i = np.minimum(u.astype(np.int64), self.cells - 1)
        j = np.minimum(v.astype(np.int64), self.cells - 1)
        u, v = u - i, v - j
        heights = self.heights
        south_west = heights[i, j].astype(np.float64)
        south_east = heights[i, j + 1].astype(np.float64)
        north_west = heights[i + 1, j].astype(np.float64)
        north_east = heights[i + 1, j + 1].astype(np.float64)
        is_northern = u >= v
        rise_north = np.where(is_northern, north_west - south_west, north_east - south_east)
        rise_east = np.where(is_northern, north_east - north_west, south_east - south_west)
        return south_west, rise_north, rise_east, u, v

    def height(self, north: ArrayLike, east: ArrayLike) -> FloatArray:
        """Ground height above the home plane [m], shape of the broadcast arguments."""
        south_west, rise_north, rise_east, u, v = self._triangles(*self._coordinates(north, east))
        return np.asarray(south_west + u * rise_north + v * rise_east)

    def normal_ned(self, north: ArrayLike, east: ArrayLike) -> FloatArray:
        """Unit normals of the ground pointing up (z < 0), shape (..., 3)."""
        u_map, v_map = self._coordinates(north, east)
        _, rise_north, rise_east, _, _ = self._triangles(u_map, v_map)
        scale = self.cells / self.size_m
        slope_north = np.where((u_map < 0.0) | (u_map > self.cells), 0.0, rise_north * scale)
        slope_east = np.where((v_map < 0.0) | (v_map > self.cells), 0.0, rise_east * scale)
        up = np.stack([-slope_north, -slope_east, -np.ones_like(slope_north)], axis=-1)
        return np.asarray(up / np.linalg.norm(up, axis=-1, keepdims=True))

    def ray_hit(self, origin_ned: FloatArray, dir_ned: FloatArray, max_m: float) -> float:
        """Distance [m] along a ray of unit direction to the first ground, `max_m` if none; 0 from under ground."""
        u, v = self._coordinates(origin_ned[0], origin_ned[1])
        u_rate, v_rate = dir_ned[:2] * (self.cells / self.size_m)
        lines = np.arange(self.cells + 1)
        diagonals = np.arange(-self.cells, self.cells + 1)
        breaks = [np.array([0.0, max_m])]
        for start, rate, borders in ((u, u_rate, lines), (v, v_rate, lines), (u - v, u_rate - v_rate, diagonals)):
            if abs(rate) > _PARALLEL:
                breaks.append((borders - start) / rate)
        t = np.concatenate(breaks)
        t = np.sort(t[(t >= 0.0) & (t <= max_m)])
        points = origin_ned + t[:, None] * dir_ned
        gap = -points[:, 2] - self.height(points[:, 0], points[:, 1])
        under = np.flatnonzero(gap <= 0.0)
        if under.size == 0:
            return max_m
        k = int(under[0])
        if k == 0:
            return 0.0
        return float(t[k - 1] + (t[k] - t[k - 1]) * gap[k - 1] / (gap[k - 1] - gap[k]))
