"""The colours of what a camera sees, in linear light: grass, earth, leaves, bark, concrete, sky, and the air between.

Colours and the strengths of sun, sky and haze are guesses made by eye. Left out: clouds' shadows, water, light that
bounces more than once.
"""

from math import cos, radians, sin

import warp as wp

from sim.sensors.ray import CROWN, GROUND, SOLID, TRUNK, VEHICLE, WALL, Hit, smooth_normal_ned
from sim.sensors.solid_paint import SolidPaint, solid_albedo
from sim.world.neighbours import neighbour_contact
from sim.world.trees import Tree
from sim.world.world import World

wp.set_module_options({"enable_backward": False})

SUN_AZIMUTH, SUN_ELEVATION = radians(140.0), radians(38.0)
SUN_NED = wp.constant(
    wp.vec3(cos(SUN_ELEVATION) * cos(SUN_AZIMUTH), cos(SUN_ELEVATION) * sin(SUN_AZIMUTH), -sin(SUN_ELEVATION))
)
SUN_LIGHT = wp.constant(wp.vec3(1.45, 1.32, 1.08))
SKY_LIGHT = wp.constant(wp.vec3(0.26, 0.33, 0.44))
EARTH_LIGHT = wp.constant(wp.vec3(0.10, 0.11, 0.06))  # bounced up from the ground
HAZE = wp.constant(wp.vec3(0.60, 0.70, 0.80))
ZENITH = wp.constant(wp.vec3(0.10, 0.26, 0.60))
VISIBILITY_M = wp.constant(900.0)  # distance over which haze takes up 63 % of the light

_GRASS = wp.constant(wp.vec3(0.075, 0.135, 0.028))
_MEADOW = wp.constant(wp.vec3(0.155, 0.185, 0.055))
_EARTH = wp.constant(wp.vec3(0.170, 0.135, 0.070))
_ROCK = wp.constant(wp.vec3(0.230, 0.215, 0.195))
_BARK = wp.constant(wp.vec3(0.115, 0.080, 0.055))
_CONCRETE = wp.constant(wp.vec3(0.380, 0.370, 0.350))
_HULL = wp.constant(wp.vec3(0.05, 0.05, 0.06))  # carbon fibre
_PAINT = wp.constant(wp.vec3(0.75, 0.75, 0.72))
_SEED = wp.constant(wp.uint32(11))


@wp.func
def mix(a: wp.vec3, b: wp.vec3, fraction: float) -> wp.vec3:
    """`a` with a share [0..1] of `b`."""
    s = wp.clamp(fraction, 0.0, 1.0)
    return a + s * (b - a)


@wp.func
def detail(x: float, y: float, wavelength_m: float, footprint_m: float) -> float:
    """Noise in about [-1, 1] of one wavelength, faded out where a pixel covers too much of it to show it."""
    fade = wp.clamp(1.5 - 3.0 * footprint_m / wavelength_m, 0.0, 1.0)
    if fade == 0.0:
        return 0.0
    return 1.6 * fade * wp.noise(_SEED, wp.vec2(x / wavelength_m, y / wavelength_m))


@wp.func
def detail_3d(point: wp.vec3, wavelength_m: float, footprint_m: float) -> float:
    """As `detail`, for surfaces that are not level."""
    fade = wp.clamp(1.5 - 3.0 * footprint_m / wavelength_m, 0.0, 1.0)
    if fade == 0.0:
        return 0.0
    return 1.6 * fade * wp.noise(_SEED, point / wavelength_m)


@wp.func
def landing_pad(north: float, east: float) -> float:
    """1 on the painted lines of the pad at home: a ring and an H."""
    off = wp.sqrt(north * north + east * east)
    if off > 1.32 and off < 1.5:
        return 1.0
    is_post = wp.abs(wp.abs(east) - 0.42) < 0.09 and wp.abs(north) < 0.7
    is_bar = wp.abs(north) < 0.09 and wp.abs(east) < 0.42
    if is_post or is_bar:
        return 1.0
    return 0.0


@wp.func
def ground_albedo(point_ned: wp.vec3, normal_ned: wp.vec3, footprint_m: float) -> wp.vec3:
    """Fraction of light that the ground sends back: grass and meadow in patches, earth where it is bare or steep."""
    north = point_ned[0]
    east = point_ned[1]
    broad = detail(north, east, 47.0, footprint_m) + 0.5 * detail(east + 31.0, north, 17.0, footprint_m)
    middle = detail(north + 90.0, east, 5.3, footprint_m)
    fine = detail(north, east + 50.0, 0.9, footprint_m) + 0.7 * detail(east, north, 0.21, footprint_m)
    albedo = mix(_GRASS, _MEADOW, 0.5 + 0.9 * broad + 0.25 * middle)
    albedo = mix(albedo, _EARTH, 1.6 * (middle + 0.6 * broad - 0.62))
    albedo = mix(albedo, _ROCK, 4.0 * (0.90 + normal_ned[2]))
    if north * north + east * east < 2.56:
        albedo = mix(_CONCRETE * 0.55, _PAINT, landing_pad(north, east))
        return albedo * (1.0 + 0.06 * fine)
    return albedo * (1.0 + 0.16 * middle + 0.22 * fine)


@wp.func
def tree_normal_ned(tree: Tree, point_ned: wp.vec3, is_bark: bool) -> wp.vec3:
    """Outward unit normal of a trunk or crown."""
    up = float(0.0)
    if not is_bark:
        up = -point_ned[2] - wp.clamp(-point_ned[2], tree.crown_low, tree.crown_high)
    return wp.normalize(wp.vec3(point_ned[0] - tree.north, point_ned[1] - tree.east, -up))


@wp.func
def leaf_albedo(i_tree: int, point_ned: wp.vec3, footprint_m: float) -> wp.vec3:
    """Each tree has a green of its own; leaves make it uneven."""
    state = wp.rand_init(7, i_tree)
    hue = wp.randf(state)
    tone = 0.75 + 0.5 * wp.randf(state)
    albedo = mix(wp.vec3(0.050, 0.105, 0.028), wp.vec3(0.150, 0.160, 0.032), hue * hue)
    if hue > 0.93:
        albedo = wp.vec3(0.24, 0.13, 0.03)
    leaves = detail_3d(point_ned, 0.32, footprint_m) + 1.2 * detail_3d(point_ned, 1.1, footprint_m)
    return albedo * tone * wp.max(0.3, 1.0 + 0.55 * leaves)


@wp.func
def sky_colour(dir_ned: wp.vec3) -> wp.vec3:
    """Light of the sky in a direction: haze at the horizon, blue above, thin clouds, the sun."""
    up = wp.max(-dir_ned[2], 0.0)
    colour = mix(HAZE, ZENITH, 1.0 - wp.exp(-4.0 * up))
    if up > 0.02:
        x = dir_ned[0] / (up + 0.06)
        y = dir_ned[1] / (up + 0.06)
        cloud = wp.noise(_SEED, wp.vec2(0.9 * x + 3.0, 0.9 * y)) + 0.5 * wp.noise(_SEED, wp.vec2(2.1 * x, 2.1 * y))
        cloud = cloud + 0.25 * wp.noise(_SEED, wp.vec2(4.7 * x, 4.7 * y))
        cover = wp.clamp(1.5 * (cloud - 0.02), 0.0, 0.85) * wp.clamp(6.0 * (up - 0.02), 0.0, 1.0)
        colour = mix(colour, wp.vec3(0.93, 0.94, 0.96), cover)
    towards = wp.max(wp.dot(dir_ned, SUN_NED), 0.0)
    glow = wp.pow(towards, 64.0)
    colour = colour + (0.35 * glow) * SUN_LIGHT
    if towards > 0.99985:  # 1 deg across: the real sun is half of that, and would vanish between pixels
        colour = 6.0 * SUN_LIGHT
    return colour


@wp.func
def with_haze(colour: wp.vec3, dir_ned: wp.vec3, distance_m: float) -> wp.vec3:
    """A colour seen through so much air."""
    towards = wp.max(wp.dot(dir_ned, SUN_NED), 0.0)
    air = HAZE + (0.25 * wp.pow(towards, 8.0)) * SUN_LIGHT
    return mix(colour, air, 1.0 - wp.exp(-distance_m / VISIBILITY_M))


@wp.func
def surface_normal_ned(w: World, hit: Hit, point_ned: wp.vec3) -> wp.vec3:
    """Outward unit normal of what was hit."""
    normal = wp.vec3(0.0, 0.0, -1.0)
    if hit.kind == GROUND:
        normal = smooth_normal_ned(w, point_ned[0], point_ned[1])
    elif hit.kind == CROWN or hit.kind == TRUNK:
        normal = tree_normal_ned(w.forest.trees[hit.i_tree], point_ned, hit.kind == TRUNK)
    elif hit.kind == WALL:
        inner = w.walls.half_size_m
        if -point_ned[2] < w.walls.top_m - 0.01:
            if wp.abs(point_ned[0]) > wp.abs(point_ned[1]):
                normal = wp.vec3(-wp.sign(point_ned[0]), 0.0, 0.0)
            else:
                normal = wp.vec3(0.0, -wp.sign(point_ned[1]), 0.0)
            if wp.max(wp.abs(point_ned[0]), wp.abs(point_ned[1])) > inner + 0.25:
                normal = -normal
    elif hit.kind == VEHICLE:
        push = neighbour_contact(w.neighbours.rows[hit.i_tree], w.boxes.tick, point_ned, 1.0)
        normal = wp.vec3(push[0], push[1], push[2])
    elif hit.kind == SOLID:
        normal = hit.solid.normal_ned
    return normal


@wp.func
def surface_albedo(
    w: World, paint: SolidPaint, hit: Hit, point_ned: wp.vec3, normal_ned: wp.vec3, footprint_m: float
) -> wp.vec3:
    """Fraction of the light that the surface hit sends back."""
    albedo = _CONCRETE
    if hit.kind == GROUND:
        albedo = ground_albedo(point_ned, normal_ned, footprint_m / wp.max(0.15, -normal_ned[2]))
    elif hit.kind == CROWN:
        tree = w.forest.trees[hit.i_tree]
        low = tree.crown_low - tree.crown_radius
        high = tree.crown_high + tree.crown_radius
        depth = wp.clamp((-point_ned[2] - low) / (high - low), 0.0, 1.0)  # little light reaches the inner leaves
        albedo = leaf_albedo(hit.i_tree, point_ned, footprint_m) * (0.45 + 0.65 * depth)
    elif hit.kind == TRUNK:
        rough = detail(point_ned[0] + point_ned[1], 0.2 * point_ned[2], 0.08, footprint_m)
        albedo = _BARK * (1.0 + 0.5 * rough)
    elif hit.kind == WALL:
        stain = detail(point_ned[0] + point_ned[1], point_ned[2], 3.0, footprint_m)
        albedo = _CONCRETE * (1.0 + 0.15 * stain)
    elif hit.kind == VEHICLE:
        albedo = _HULL
    elif hit.kind == SOLID:
        albedo = solid_albedo(paint, hit.solid.face, hit.solid.u, hit.solid.v)
    return albedo


@wp.func
def lit(albedo: wp.vec3, normal_ned: wp.vec3, kind: int, is_shaded: bool) -> wp.vec3:
    """Light sent back by a surface under sun and sky."""
    facing = wp.dot(normal_ned, SUN_NED)
    sun = wp.max(facing, 0.0)
    if kind == CROWN:
        sun = wp.max(0.22 * facing + 0.26, 0.9 * facing + 0.06)  # leaves let light through
    if is_shaded:
        sun = 0.0
    up = 0.5 - 0.5 * normal_ned[2]
    light = sun * SUN_LIGHT + up * SKY_LIGHT + (1.0 - up) * EARTH_LIGHT
    return 2.2 * wp.cw_mul(albedo, light)
