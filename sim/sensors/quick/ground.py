"""The ground as the fast camera reads it: one vector per terrain cell, and the sun's light in a finer raster.

In: the worlds' structs, and which worlds are new. Out: flat arrays, one stretch per world. Packed when a world is made.
The surface is the world's own: two flat triangles per cell, level beyond the edges.
"""

from typing import Any

import warp as wp

from sim.sensors.ray import smooth_normal_ned
from sim.sensors.shading import SUN_NED
from sim.world.terrain import terrain_height
from sim.world.trees import tree_ray_hit
from sim.world.world import World, WorldConfig

wp.set_module_options({"enable_backward": False})

TEXEL_M = 1.0  # of the light's raster: shadows of crowns need no finer one
_BLEND_M = wp.constant(0.5)
_SHADOW_MAX_M = wp.constant(60.0)  # longest way of the sun's light from a crown to the ground


@wp.struct
class Ground:
    """Terrain and sunlight of all worlds."""

    cells: wp.array[wp.vec4]  # height [m] of the south-west corner; rises to the north-west, south-east, north-east one
    light: wp.array[wp.uint8]  # cosine of the sun on the ground times 255; 0 in a shadow
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


@wp.func
def sunlight(ground: Ground, base: int, x: float, y: float, footprint_m: float) -> float:
    """Cosine of the sun on the ground, 0 in a shadow; blended between four texels where a pixel is finer than they.

    Args:
        ground: all worlds.
        base: index of the world's first texel.
        x: place in texels from the south edge.
        y: in texels from the west edge.
        footprint_m: width of a pixel there.
    """
    if footprint_m > _BLEND_M:
        last = ground.texels - 1
        texel = wp.clamp(int(x), 0, last) * ground.texels + wp.clamp(int(y), 0, last)
        return float(ground.light[base + texel]) * (1.0 / 255.0)
    edge = float(ground.texels) - 1.001
    u = wp.clamp(x - 0.5, 0.0, edge)
    v = wp.clamp(y - 0.5, 0.0, edge)
    i = int(u)
    j = int(v)
    u = u - float(i)
    v = v - float(j)
    k = base + i * ground.texels + j
    south = float(ground.light[k]) + v * (float(ground.light[k + 1]) - float(ground.light[k]))
    k = k + ground.texels
    north = float(ground.light[k]) + v * (float(ground.light[k + 1]) - float(ground.light[k]))
    return (south + u * (north - south)) * (1.0 / 255.0)


@wp.kernel
def pack_cells(worlds: wp.array[World], is_chosen: wp.array[wp.bool], ground: Ground) -> None:
    i_world, i_cell = wp.tid()
    if not is_chosen[i_world]:
        return
    heights = worlds[i_world].terrain.heights
    i = i_cell / ground.side
    j = i_cell % ground.side
    corner = heights[i, j]
    rises = wp.vec3(heights[i + 1, j] - corner, heights[i, j + 1] - corner, heights[i + 1, j + 1] - corner)
    ground.cells[i_world * ground.side * ground.side + i_cell] = wp.vec4(corner, rises[0], rises[1], rises[2])


@wp.kernel
def light_texels(worlds: wp.array[World], is_chosen: wp.array[wp.bool], ground: Ground) -> None:
    i_world, i_texel = wp.tid()
    if not is_chosen[i_world]:
        return
    north = (float(i_texel / ground.texels) + 0.5) / ground.texels_per_m - ground.half_size_m
    east = (float(i_texel % ground.texels) + 0.5) / ground.texels_per_m - ground.half_size_m
    facing = wp.dot(smooth_normal_ned(worlds[i_world], north, east), SUN_NED)
    ground.light[i_world * ground.texels * ground.texels + i_texel] = wp.uint8(255.0 * wp.clamp(facing, 0.0, 1.0))


@wp.kernel
def cast_shadows(worlds: wp.array[World], is_chosen: wp.array[wp.bool], ground: Ground) -> None:
    """Each bucket's trees darken the texels they shade; texels shaded twice are written twice with the same 0."""
    i_world, bucket = wp.tid()
    if not is_chosen[i_world]:
        return
    w = worlds[i_world]
    forest = w.forest
    if bucket >= forest.buckets * forest.buckets:
        return
    for k in range(forest.bucket_start[bucket], forest.bucket_start[bucket + 1]):
        tree = forest.trees[forest.bucket_trees[k]]
        row = int((tree.north + forest.half_size_m) * forest.buckets_per_m)
        column = int((tree.east + forest.half_size_m) * forest.buckets_per_m)
        if row * forest.buckets + column == bucket:  # listed in its neighbours' buckets too
            low = (tree.crown_low - tree.crown_radius - terrain_height(w.terrain, tree.north, tree.east)) / -SUN_NED[2]
            high = (tree.crown_high + tree.crown_radius - tree.root_height) / -SUN_NED[2]
            high = wp.min(high, _SHADOW_MAX_M)
            reach = 1.3 * tree.crown_radius + 1.0
            n0 = tree.north + wp.min(-SUN_NED[0] * low, -SUN_NED[0] * high) - reach
            n1 = tree.north + wp.max(-SUN_NED[0] * low, -SUN_NED[0] * high) + reach
            e0 = tree.east + wp.min(-SUN_NED[1] * low, -SUN_NED[1] * high) - reach
            e1 = tree.east + wp.max(-SUN_NED[1] * low, -SUN_NED[1] * high) + reach
            last = ground.texels - 1
            i0 = wp.clamp(int((n0 + ground.half_size_m) * ground.texels_per_m), 0, last)
            i1 = wp.clamp(int((n1 + ground.half_size_m) * ground.texels_per_m), 0, last)
            j0 = wp.clamp(int((e0 + ground.half_size_m) * ground.texels_per_m), 0, last)
            j1 = wp.clamp(int((e1 + ground.half_size_m) * ground.texels_per_m), 0, last)
            for i in range(i0, i1 + 1):
                north = (float(i) + 0.5) / ground.texels_per_m - ground.half_size_m
                for j in range(j0, j1 + 1):
                    east = (float(j) + 0.5) / ground.texels_per_m - ground.half_size_m
                    spot_ned = wp.vec3(north, east, -terrain_height(w.terrain, north, east))
                    if tree_ray_hit(tree, spot_ned, SUN_NED, _SHADOW_MAX_M) < _SHADOW_MAX_M:
                        ground.light[(i_world * ground.texels + i) * ground.texels + j] = wp.uint8(0)


def make_ground(config: WorldConfig, count: int, device: str) -> Any:
    """Unpacked `Ground` of so many worlds of one configuration."""
    ground = Ground()
    ground.side = max(2, round(config.size_m / config.cell_m))
    ground.texels = max(2, round(config.size_m / TEXEL_M))
    ground.cells_per_m = ground.side / config.size_m
    ground.texels_per_m = ground.texels / config.size_m
    ground.half_size_m = 0.5 * config.size_m
    ground.cells = wp.zeros(count * ground.side**2, dtype=wp.vec4, device=device)
    ground.light = wp.zeros(count * ground.texels**2, dtype=wp.uint8, device=device)
    return ground


def pack(ground: Any, worlds: Any, buckets: int, is_chosen: Any) -> None:
    """Packs the chosen worlds.

    Args:
        ground: of `make_ground`.
        worlds: array of `World`, shape (worlds,).
        buckets: of the forests, per side.
        is_chosen: bool, shape (worlds,).
    """
    count, device = len(worlds), worlds.device
    inputs = [worlds, is_chosen, ground]
    wp.launch(pack_cells, dim=(count, ground.side**2), inputs=inputs, device=device)
    wp.launch(light_texels, dim=(count, ground.texels**2), inputs=inputs, device=device)
    wp.launch(cast_shadows, dim=(count, buckets**2), inputs=inputs, device=device)
