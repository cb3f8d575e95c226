"""The ground as the fast camera reads it: one vector per terrain cell; the light on it is in `light.py`.

In: the worlds' structs, and which worlds are new. Out: flat arrays, one stretch per world. Packed when a world is made.
The surface is the world's own: two flat triangles per cell, level beyond the edges.
"""

from typing import Any

import warp as wp

from sim.world.world import World, WorldConfig

wp.set_module_options({"enable_backward": False})

TEXEL_M = 1.0  # of the light's raster: shadows of crowns need no finer one


@wp.struct
class Ground:
    """Terrain and sunlight of all worlds."""

    cells: wp.array[wp.vec4]  # height [m] of the south-west corner; rises to the north-west, south-east, north-east one
    corners: wp.array[float]  # cosine of the sun at the terrain's grid points, (side + 1)² per world
    light: wp.array[wp.uint8]  # cosine of the sun on the ground times 255; 0 in a shadow
    light_four: wp.array[wp.uint32]  # a texel's, its eastern, northern and north-eastern neighbours', lowest byte first
    steepness: wp.array[float]  # square of the steepest slope in each row of cells [m²/m²], (side,) per world
    side: int  # cells per side of a world
    texels: int  # per side of a world
    cells_per_m: float
    texels_per_m: float
    half_size_m: float


@wp.func
def surface(ground: Ground, base: int, u_map: float, v_map: float) -> wp.vec3:
    """Height [m] of the ground, and its rise per cell to the north and to the east.

    Args:
        ground: all worlds.
        base: index of the world's first cell.
        u_map: place in cells from the south edge.
        v_map: in cells from the west edge.
    """
    edge = float(ground.side) - 1.0e-3  # so that the last cell is the last index
    u = wp.clamp(u_map, 0.0, edge)
    v = wp.clamp(v_map, 0.0, edge)
    i = int(u)
    j = int(v)
    cell = ground.cells[base + i * ground.side + j]
    u = u - float(i)
    v = v - float(j)
    is_northern = u >= v
    rise_north = wp.where(is_northern, cell[1], cell[3] - cell[2])
    rise_east = wp.where(is_northern, cell[3] - cell[1], cell[2])
    return wp.vec3(cell[0] + u * rise_north + v * rise_east, rise_north, rise_east)


@wp.struct
class Plane:
    """One triangle of the ground as a camera sees it."""

    i: int  # of all triangles of all worlds; -1 for one that must be looked up anew
    below: float  # [m] from the camera down to the triangle's plane
    rise_north: float  # [m] per cell
    rise_east: float


@wp.func
def triangle_at(ground: Ground, base: int, u: float, v: float) -> int:
    """Index of the triangle under a position in cells from the south and west edges; -2 beyond the edges."""
    edge = float(ground.side)
    if wp.min(u, v) < 0.0 or wp.max(u, v) >= edge:
        return -2
    i = int(u)
    j = int(v)
    return 2 * (base + i * ground.side + j) + wp.where(u - float(i) >= v - float(j), 1, 0)


@wp.func
def plane_at(ground: Ground, base: int, u: float, v: float, eye: wp.vec3) -> Plane:
    """The plane of the triangle at a position, given in cells from the south and west edges; level beyond them.

    Args:
        ground: all worlds.
        base: index of the world's first cell.
        u: to the north.
        v: to the east.
        eye: where it is seen from: cells to the north and to the east, metres above home.
    """
    here = surface(ground, base, u, v)
    plane = Plane()
    plane.i = wp.max(triangle_at(ground, base, u, v), -1)
    edge = float(ground.side)
    plane.rise_north = wp.where(u < 0.0 or u >= edge, 0.0, here[1])
    plane.rise_east = wp.where(v < 0.0 or v >= edge, 0.0, here[2])
    plane.below = eye[2] - here[0] - (eye[0] - u) * plane.rise_north - (eye[1] - v) * plane.rise_east
    return plane


@wp.kernel
def pack_cells(worlds: wp.array[World], is_chosen: wp.array[wp.bool], ground: Ground) -> None:
    i_world, i = wp.tid()
    if not is_chosen[i_world]:
        return
    heights = worlds[i_world].terrain.heights
    start = (i_world * ground.side + i) * ground.side
    steepest = float(0.0)
    for j in range(ground.side):
        corner = heights[i, j]
        rises = wp.vec3(heights[i + 1, j] - corner, heights[i, j + 1] - corner, heights[i + 1, j + 1] - corner)
        ground.cells[start + j] = wp.vec4(corner, rises[0], rises[1], rises[2])
        northern = wp.vec2(rises[0], rises[2] - rises[0])
        eastern = wp.vec2(rises[2] - rises[1], rises[1])
        steepest = wp.max(steepest, wp.max(wp.dot(northern, northern), wp.dot(eastern, eastern)))
    ground.steepness[i_world * ground.side + i] = steepest * ground.cells_per_m * ground.cells_per_m


def make_ground(config: WorldConfig, count: int, device: str) -> Any:
    """Unpacked `Ground` of so many worlds of one configuration."""
    ground = Ground()
    ground.side = max(2, round(config.size_m / config.cell_m))
    ground.texels = max(2, round(config.size_m / TEXEL_M))
    ground.cells_per_m = ground.side / config.size_m
    ground.texels_per_m = ground.texels / config.size_m
    ground.half_size_m = 0.5 * config.size_m
    ground.cells = wp.zeros(count * ground.side**2, dtype=wp.vec4, device=device)
    ground.corners = wp.zeros(count * (ground.side + 1) ** 2, dtype=wp.float32, device=device)
    ground.light = wp.zeros(count * ground.texels**2, dtype=wp.uint8, device=device)
    ground.light_four = wp.zeros(count * ground.texels**2, dtype=wp.uint32, device=device)
    ground.steepness = wp.zeros(count * ground.side, dtype=wp.float32, device=device)
    return ground
