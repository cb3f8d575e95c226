"""The rows of the images: solids first, then the ground where they leave it free, then one colour per pixel.

One thread per row: neighbouring pixels share the search for the ground, and a GPU gets enough threads.
"""

import warp as wp

from sim.sensors.fast_camera.camera_view import View
from sim.sensors.fast_camera.colours import Paints, blended, code, ground_colour, sky_light
from sim.sensors.fast_camera.columns import Columns, Found, ground_depth, level_ray
from sim.sensors.fast_camera.flags import FAST
from sim.sensors.fast_camera.ground import Ground, plane_at
from sim.sensors.fast_camera.light import sunlight
from sim.sensors.fast_camera.solids import NEVER, Sights, Solid, solid_depth
from sim.sensors.ray import CROWN, GROUND, RAY_MAX_M, SKY, WALL
from sim.sensors.shading import EARTH_LIGHT, HAZE, SKY_LIGHT, SUN_LIGHT, SUN_NED, landing_pad
from sim.world.walls import WALL_THICKNESS_M

wp.set_module_options(FAST)

_CONCRETE = wp.constant(wp.vec3(0.380, 0.370, 0.350))
_PAD = wp.constant(wp.vec3(0.210, 0.204, 0.193))
_PAINT = wp.constant(wp.vec3(0.75, 0.75, 0.72))
_PARALLEL = wp.constant(1.0e-9)


@wp.struct
class Outputs:
    """Images, flat."""

    rgb: wp.array[wp.uint8]
    depth_m: wp.array[wp.float32]
    kind: wp.array[wp.uint8]
    front: wp.array[wp.int32]  # scratch: index of the nearest solid, -1 for none
    width: int
    height: int


@wp.func
def splat(sights: Sights, outputs: Outputs, view: View, i_camera: int, row: int) -> None:
    """Depth and index of the nearest solid in each pixel of a row."""
    start = (i_camera * outputs.height + row) * outputs.width
    for column in range(outputs.width):
        outputs.depth_m[start + column] = NEVER
        outputs.front[start + column] = -1
    y = (float(row) + 0.5 - 0.5 * float(outputs.height)) * view.per_pixel
    for k in range(view.solids):
        i_solid = i_camera * sights.room + k
        box = sights.boxes[i_solid]
        if row >= box[2] and row <= box[3]:
            solid = sights.solids[i_solid]
            for column in range(box[0], box[1] + 1):
                x = (float(column) + 0.5 - 0.5 * float(outputs.width)) * view.per_pixel
                t = solid_depth(solid, wp.vec3(x, y, 1.0), x * x + y * y + 1.0)
                if t < outputs.depth_m[start + column]:
                    outputs.depth_m[start + column] = t
                    outputs.front[start + column] = k


@wp.func
def wall_depth(ground: Ground, view: View, d_north: float, d_east: float, climb: float) -> float:
    """Parameter of a ray at the walls' inner faces or tops, from inside the map; NEVER if it passes over them."""
    inner = ground.half_size_m
    to_north = (wp.where(d_north > 0.0, inner, -inner) - view.pos_ned[0]) / d_north
    to_east = (wp.where(d_east > 0.0, inner, -inner) - view.pos_ned[1]) / d_east
    if wp.abs(d_north) < _PARALLEL:
        to_north = NEVER
    if wp.abs(d_east) < _PARALLEL:
        to_east = NEVER
    t = wp.min(to_north, to_east)
    over = climb * t - view.pos_ned[2] - view.wall_top
    if over <= 0.0:
        return t
    across = wp.where(to_north < to_east, wp.abs(d_north), wp.abs(d_east))
    if over + climb * WALL_THICKNESS_M / across <= 0.0:
        return t - over / climb
    return NEVER


@wp.func
def solid_colour(paints: Paints, view: View, solid: Solid, ray: wp.vec3, t: float) -> wp.vec3:
    """Light sent back by the front of a solid."""
    from_foot = t * ray - solid.foot
    along = wp.dot(from_foot, solid.axis)
    normal = (from_foot - wp.clamp(along, 0.0, solid.length) * solid.axis) / solid.radius
    north = wp.dot(from_foot, view.north_rdf)
    east = wp.dot(from_foot, view.east_rdf)
    albedo = solid.albedo
    facing = wp.dot(normal, view.sun_rdf)
    up = 0.5 + 0.5 * wp.dot(normal, view.up_rdf)
    if solid.kind == CROWN:
        fade = wp.clamp(1.3 - 0.9 * t * view.per_pixel, 0.25, 1.0)
        x = 5.0 * solid.foot_along
        leaves = blended(paints.detail, 3.1 * (north + 0.7 * along) + x, 3.1 * (east - 0.6 * along))
        leaves = leaves + blended(paints.detail, 9.0 * (along + 0.4 * east), 9.0 * (north - 0.8 * east))
        depth = (along + solid.radius) / (solid.length + 2.0 * solid.radius)
        albedo = albedo * ((0.45 + 0.65 * depth) * wp.max(0.3, 1.0 + 1.1 * fade * leaves))
        facing = wp.max(0.22 * facing + 0.26, 0.9 * facing + 0.06)  # leaves let light through
    else:
        rough = blended(paints.detail, 30.0 * (north + east), 8.0 * along)
        albedo = albedo * (1.0 + solid.roughness * rough)
    light = wp.max(facing, 0.0) * SUN_LIGHT + up * SKY_LIGHT + (1.0 - up) * EARTH_LIGHT
    return 2.2 * wp.cw_mul(albedo, light)


@wp.func
def wall_colour(paints: Paints, north: float, east: float, height: float) -> wp.vec3:
    """Light sent back by a wall's inner face: poured concrete in panels of 4 m by 2 m."""
    is_northern = wp.abs(north) > wp.abs(east)
    along = wp.where(is_northern, east, north)
    facing = wp.where(is_northern, -wp.sign(north) * SUN_NED[0], -wp.sign(east) * SUN_NED[1])
    stain = blended(paints.detail, 3.0 * along, 3.0 * height)
    joint = wp.where(along * 0.25 - wp.floor(along * 0.25) < 0.012, 0.8, 1.0)
    albedo = _CONCRETE * ((1.0 + 0.25 * stain) * joint)
    return 2.2 * wp.cw_mul(albedo, wp.max(facing, 0.0) * SUN_LIGHT + 0.5 * SKY_LIGHT + 0.5 * EARTH_LIGHT)


@wp.func
def land_colour(paints: Paints, ground: Ground, view: View, north: float, east: float, footprint_m: float) -> wp.vec3:
    """Light sent back by the ground, with the pad at home."""
    per_m = ground.texels_per_m
    half = ground.half_size_m
    sun = sunlight(ground, view.texel_base, (north + half) * per_m, (east + half) * per_m, footprint_m)
    if north * north + east * east < 2.56:
        albedo = _PAD
        if landing_pad(north, east) > 0.5:
            albedo = _PAINT
        return 2.2 * wp.cw_mul(albedo, sun * SUN_LIGHT + SKY_LIGHT)
    return ground_colour(paints, north, east, sun, footprint_m)


@wp.func
def surface_colour(
    ground: Ground,
    paints: Paints,
    view: View,
    sights: Sights,
    i_solid: int,
    kind: int,
    ray: wp.vec3,
    ray_rdf: wp.vec3,
    t: float,
) -> wp.vec3:
    """Light sent back by what a ray meets."""
    north = view.pos_ned[0] + t * ray[0]
    east = view.pos_ned[1] + t * ray[1]
    if kind == GROUND:
        return land_colour(paints, ground, view, north, east, t * view.per_pixel)
    if kind == WALL:
        return wall_colour(paints, north, east, t * -ray[2] - view.pos_ned[2])
    return solid_colour(paints, view, sights.solids[i_solid], ray_rdf, t)


@wp.func
def store(outputs: Outputs, paints: Paints, view: View, i_pixel: int, t: float, kind: int, colour: wp.vec3) -> None:
    """Writes one pixel of all images."""
    outputs.depth_m[i_pixel] = t
    outputs.kind[i_pixel] = wp.uint8(kind)
    first = 3 * i_pixel
    outputs.rgb[first] = code(paints, colour[0] * view.gain[0])
    outputs.rgb[first + 1] = code(paints, colour[1] * view.gain[1])
    outputs.rgb[first + 2] = code(paints, colour[2] * view.gain[2])


@wp.kernel
def draw_rows(
    first_camera: int,
    ground: Ground,
    paints: Paints,
    views: wp.array[View],
    is_chosen: wp.array[wp.bool],
    columns: Columns,
    sights: Sights,
    range_m: float,
    outputs: Outputs,
) -> None:
    i_row, row = wp.tid()
    i_camera = first_camera + i_row
    if not is_chosen[i_camera]:
        return
    view = views[i_camera]
    splat(sights, outputs, view, i_camera, row)
    start = (i_camera * outputs.height + row) * outputs.width
    y = (float(row) + 0.5 - 0.5 * float(outputs.height)) * view.per_pixel
    middle = view.ahead + y * view.down
    per_range = 1.0 / (range_m * range_m)
    found = Found()
    found.plane = plane_at(ground, view.cell_base, view.eye[0], view.eye[1], view.eye)
    for column in range(outputs.width):
        x = (float(column) + 0.5 - 0.5 * float(outputs.width)) * view.per_pixel
        ray = middle + x * view.right
        ray_squared = x * x + y * y + 1.0
        i_solid = i_camera * sights.room + outputs.front[start + column]
        t = outputs.depth_m[start + column]
        kind = int(SKY)
        if t < NEVER:
            kind = sights.solids[i_solid].kind
        if view.has_wall:
            t_wall = wall_depth(ground, view, ray[0], ray[1], -ray[2])
            if t_wall < t:
                t = t_wall
                kind = WALL
        found = ground_depth(ground, columns, view, i_camera, level_ray(view, ground.cells_per_m, ray), found, t)
        if found.t < t:
            t = found.t
            kind = GROUND
        fraction = t * t * ray_squared * per_range
        if fraction >= 1.0:
            kind = SKY
        colour = wp.vec3(0.0, 0.0, 0.0)
        if view.inside != SKY:
            kind = view.inside
            t = 0.0
            colour = wp.vec3(0.02, 0.04, 0.01)
        elif kind == SKY:
            t = RAY_MAX_M
            colour = sky_light(paints, ray[0], ray[1], -ray[2], wp.sqrt(ray_squared))
        else:
            colour = surface_colour(ground, paints, view, sights, i_solid, kind, ray, wp.vec3(x, y, 1.0), t)
            fog = fraction * (0.3 + 0.7 * fraction)
            colour = colour + fog * (HAZE - colour)
        store(outputs, paints, view, start + column, t, kind, colour)
