"""The sun's light on the ground, a raster baked when a world is made: its slope towards the sun, and crowns' shadows.

In: the worlds' structs, and which worlds are new. Out: `Ground.light`. A crown's shadow is exact for ground that slopes
evenly under it; trunks throw none, theirs are finer than the raster.
"""

from math import cos, sin

import warp as wp

from sim.sensors.fast_camera.ground import Ground
from sim.sensors.shading import SUN_AZIMUTH, SUN_ELEVATION, SUN_NED
from sim.world.terrain import Terrain, terrain_height
from sim.world.trees import Tree
from sim.world.world import World

wp.set_module_options({"enable_backward": False})

STRIPS = 16  # threads per world on a GPU
_BLEND_M = wp.constant(0.5)
_AWAY_NORTH = wp.constant(-cos(SUN_AZIMUTH))  # level direction in which shadows fall
_AWAY_EAST = wp.constant(-sin(SUN_AZIMUTH))
_SIN = wp.constant(sin(SUN_ELEVATION))
_COS = wp.constant(cos(SUN_ELEVATION))
_FALL_STEPS = wp.constant(3)
_FALL_MAX_M = wp.constant(60.0)  # longest way from a crown's middle to its shadow's, over the map
_SPAN_M = wp.constant(4.0)  # over which the slope under a shadow is taken


@wp.struct
class Shadow:
    """A crown's shadow as seen from the sun: all points at most a radius from a line that goes up from the origin."""

    across: wp.vec3  # metres to the side of the line: at the map's middle, and per metre to the north and to the east
    up: wp.vec3  # metres along it, likewise
    length: float  # [m] of the line
    radius: float  # [m]
    low_ne: wp.vec2  # corners of what it may cover
    high_ne: wp.vec2


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
        return float(int(ground.light_four[base + texel]) & 255) * (1.0 / 255.0)
    edge = float(ground.texels) - 1.001
    u = wp.clamp(x - 0.5, 0.0, edge)
    v = wp.clamp(y - 0.5, 0.0, edge)
    i = int(u)
    j = int(v)
    u = u - float(i)
    v = v - float(j)
    four = int(ground.light_four[base + i * ground.texels + j])
    here = float(four & 255)
    north = float((four >> 16) & 255)
    south = here + v * (float((four >> 8) & 255) - here)
    north = north + v * (float((four >> 24) & 255) - north)
    return (south + u * (north - south)) * (1.0 / 255.0)


@wp.func
def sun_on_corner(terrain: Terrain, i: int, j: int) -> float:
    """Cosine of the sun at a grid point of the terrain, whose slope is that between its neighbours."""
    last = terrain.cells
    north = wp.min(i + 1, last)
    south = wp.max(i - 1, 0)
    east = wp.min(j + 1, last)
    west = wp.max(j - 1, 0)
    rise_north = (terrain.heights[north, j] - terrain.heights[south, j]) / float(north - south) * terrain.cells_per_m
    rise_east = (terrain.heights[i, east] - terrain.heights[i, west]) / float(east - west) * terrain.cells_per_m
    normal = wp.normalize(wp.vec3(-rise_north, -rise_east, -1.0))
    return wp.max(wp.dot(normal, SUN_NED), 0.0)


@wp.func
def crown_shadow(terrain: Terrain, tree: Tree) -> Shadow:
    """The shadow of a tree's crown on ground that slopes as it does under the shadow's middle."""
    shadow = Shadow()
    middle = 0.5 * (tree.crown_low + tree.crown_high)
    height = terrain_height(terrain, tree.north, tree.east)
    north = tree.north
    east = tree.east
    for _ in range(_FALL_STEPS):
        way = wp.clamp((middle - height) * (_COS / _SIN), 0.0, _FALL_MAX_M)
        north = tree.north + way * _AWAY_NORTH
        east = tree.east + way * _AWAY_EAST
        height = terrain_height(terrain, north, east)
    rise_north = terrain_height(terrain, north + 0.5 * _SPAN_M, east)
    rise_north = (rise_north - terrain_height(terrain, north - 0.5 * _SPAN_M, east)) / _SPAN_M
    rise_east = terrain_height(terrain, north, east + 0.5 * _SPAN_M)
    rise_east = (rise_east - terrain_height(terrain, north, east - 0.5 * _SPAN_M)) / _SPAN_M
    shadow.across = wp.vec3(tree.north * _AWAY_EAST - tree.east * _AWAY_NORTH, -_AWAY_EAST, _AWAY_NORTH)
    level = height - rise_north * north - rise_east * east - tree.crown_low  # of the sloping plane at the map's middle
    up_north = _SIN * _AWAY_NORTH + _COS * rise_north
    up_east = _SIN * _AWAY_EAST + _COS * rise_east
    up = _COS * level - _SIN * (_AWAY_NORTH * tree.north + _AWAY_EAST * tree.east)
    shadow.up = wp.vec3(up, up_north, up_east)
    shadow.length = _COS * (tree.crown_high - tree.crown_low)
    shadow.radius = tree.crown_radius
    steepness = wp.max(up_north * _AWAY_NORTH + up_east * _AWAY_EAST, 0.2)
    reach = (0.5 * shadow.length + tree.crown_radius) / steepness
    half_north = reach * wp.abs(_AWAY_NORTH) + tree.crown_radius + 1.0
    half_east = reach * wp.abs(_AWAY_EAST) + tree.crown_radius + 1.0
    shadow.low_ne = wp.vec2(north - half_north, east - half_east)
    shadow.high_ne = wp.vec2(north + half_north, east + half_east)
    return shadow


@wp.func
def first_texel(ground: Ground, position_m: float) -> int:
    """The first texel whose middle is at or beyond a position, along one side of the map; 0..texels."""
    texel = (position_m + ground.half_size_m) * ground.texels_per_m - 0.5
    return int(wp.ceil(wp.clamp(texel, 0.0, float(ground.texels))))


@wp.func
def darken(ground: Ground, base: int, shadow: Shadow, first: int, end: int) -> None:
    """Takes a shadow's fraction of the light from the texels of some rows, with a soft edge one texel wide."""
    texel_m = 1.0 / ground.texels_per_m
    j_first = first_texel(ground, shadow.low_ne[1])
    j_end = first_texel(ground, shadow.high_ne[1])
    east_first = (float(j_first) + 0.5) * texel_m - ground.half_size_m
    outer = shadow.radius + 0.5 * texel_m
    inner = wp.max(shadow.radius - 0.5 * texel_m, 0.0)
    i_first = wp.max(first, first_texel(ground, shadow.low_ne[0]))
    i_end = wp.min(end, first_texel(ground, shadow.high_ne[0]))
    for i in range(i_first, i_end):
        north = (float(i) + 0.5) * texel_m - ground.half_size_m
        across = shadow.across[0] + north * shadow.across[1] + east_first * shadow.across[2]
        up = shadow.up[0] + north * shadow.up[1] + east_first * shadow.up[2]
        for j in range(j_first, j_end):
            off = up - wp.clamp(up, 0.0, shadow.length)
            squared = across * across + off * off
            if squared < outer * outer:
                k = base + i * ground.texels + j
                left = float(0.0)
                if squared > inner * inner:
                    left = float(ground.light[k]) * wp.min((wp.sqrt(squared) - inner) / (outer - inner), 1.0)
                ground.light[k] = wp.uint8(left)
            across = across + texel_m * shadow.across[2]
            up = up + texel_m * shadow.up[2]


@wp.func
def brighten(ground: Ground, i_world: int, row: int) -> None:
    """Light of one row of texels by the slope of the ground alone, blended between the terrain's grid points."""
    start = (i_world * ground.texels + row) * ground.texels
    per_texel = ground.cells_per_m / ground.texels_per_m
    edge = float(ground.side) - 1.0e-3
    u = wp.min((float(row) + 0.5) * per_texel, edge)
    i = int(u)
    u = u - float(i)
    stride = ground.side + 1
    south = (i_world * stride + i) * stride
    north = south + stride
    for texel in range(ground.texels):
        v = wp.min((float(texel) + 0.5) * per_texel, edge)
        j = int(v)
        v = v - float(j)
        west = ground.corners[south + j] + u * (ground.corners[north + j] - ground.corners[south + j])
        east = ground.corners[south + j + 1] + u * (ground.corners[north + j + 1] - ground.corners[south + j + 1])
        ground.light[start + texel] = wp.uint8(255.0 * (west + v * (east - west)))


@wp.kernel
def light_corners(worlds: wp.array[World], is_chosen: wp.array[wp.bool], ground: Ground) -> None:
    i_world, i = wp.tid()
    if not is_chosen[i_world]:
        return
    terrain = worlds[i_world].terrain
    start = (i_world * (ground.side + 1) + i) * (ground.side + 1)
    for j in range(ground.side + 1):
        ground.corners[start + j] = sun_on_corner(terrain, i, j)


@wp.kernel
def light_strips(worlds: wp.array[World], is_chosen: wp.array[wp.bool], ground: Ground, strips: int) -> None:
    """Each thread does some rows of texels with all shadows on them, in the order of the trees."""
    i_world, strip = wp.tid()
    if not is_chosen[i_world]:
        return
    w = worlds[i_world]
    first = strip * ground.texels / strips
    end = (strip + 1) * ground.texels / strips
    for row in range(first, end):
        brighten(ground, i_world, row)
    for k in range(w.forest.tree_count):
        tree = w.forest.trees[k]
        far_m = _FALL_MAX_M + tree.crown_high - tree.crown_low + 6.0 * tree.crown_radius
        north = (tree.north + ground.half_size_m) * ground.texels_per_m
        reach = far_m * ground.texels_per_m
        if north + reach > float(first) and north - reach < float(end):
            darken(ground, i_world * ground.texels * ground.texels, crown_shadow(w.terrain, tree), first, end)


@wp.kernel
def pack_light(ground: Ground, is_chosen: wp.array[wp.bool]) -> None:
    i_world, i = wp.tid()
    if not is_chosen[i_world]:
        return
    last = ground.texels - 1
    start = i_world * ground.texels * ground.texels
    south = start + i * ground.texels
    north = start + wp.min(i + 1, last) * ground.texels
    here = wp.uint32(ground.light[south])
    north_here = wp.uint32(ground.light[north])
    for j in range(ground.texels):
        east = wp.uint32(ground.light[south + wp.min(j + 1, last)])
        north_east = wp.uint32(ground.light[north + wp.min(j + 1, last)])
        low = here | (east << wp.uint32(8))
        ground.light_four[south + j] = low | (north_here << wp.uint32(16)) | (north_east << wp.uint32(24))
        here = east
        north_here = north_east
