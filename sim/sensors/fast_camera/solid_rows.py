"""The solids of world files in the images: each pixel's ray asks the world's triangles, as every other ray does.

Launched after the rows, and only where there are solids. Lit by sun and sky, with their own shadows on themselves. Not
compiled with the fast camera's flags: mesh queries test for infinity. Left out: their shadows on ground and trees.
"""

import warp as wp

from sim.sensors.fast_camera.camera_view import View
from sim.sensors.fast_camera.colours import Paints, code
from sim.sensors.fast_camera.rows import Outputs
from sim.sensors.fast_camera.solids import NEVER
from sim.sensors.ray import SKY, SOLID
from sim.sensors.shading import EARTH_LIGHT, HAZE, SKY_LIGHT, SUN_LIGHT, SUN_NED
from sim.sensors.solid_paint import SolidPaint, solid_albedo
from sim.world.custom.solids import solids_hit
from sim.world.world import World

wp.set_module_options({"enable_backward": False})

_SHADOW_M = wp.constant(150.0)
_OFF_M = wp.constant(0.02)  # from a surface, where its shadow's ray begins


@wp.kernel
def draw_solids(
    first_camera: int,
    worlds: wp.array[World],
    i_world: wp.array[int],
    paint: SolidPaint,
    paints: Paints,
    views: wp.array[View],
    is_chosen: wp.array[wp.bool],
    range_m: float,
    outputs: Outputs,
) -> None:
    i_row, row = wp.tid()
    i_camera = first_camera + i_row
    view = views[i_camera]
    if not is_chosen[i_camera] or view.inside != SKY:
        return
    solids = worlds[i_world[i_camera]].solids
    start = (i_camera * outputs.height + row) * outputs.width
    y = (float(row) + 0.5 - 0.5 * float(outputs.height)) * view.per_pixel
    for column in range(outputs.width):
        x = (float(column) + 0.5 - 0.5 * float(outputs.width)) * view.per_pixel
        ray = view.ahead + y * view.down + x * view.right
        length = wp.length(ray)
        dir_ned = ray / length
        i_pixel = start + column
        far_m = wp.min(length * wp.min(outputs.depth_m[i_pixel], NEVER), range_m)
        hit = solids_hit(solids, view.pos_ned, dir_ned, far_m)
        if hit.face < 0:
            continue
        light = wp.max(wp.dot(hit.normal_ned, SUN_NED), 0.0)
        if light > 0.0:
            point = view.pos_ned + hit.t * dir_ned + _OFF_M * hit.normal_ned
            if solids_hit(solids, point, SUN_NED, _SHADOW_M).face >= 0:
                light = 0.0
        up = 0.5 - 0.5 * hit.normal_ned[2]
        sent = light * SUN_LIGHT + up * SKY_LIGHT + (1.0 - up) * EARTH_LIGHT
        colour = 2.2 * wp.cw_mul(solid_albedo(paint, hit.face, hit.u, hit.v), sent)
        fraction = hit.t * hit.t / (range_m * range_m)
        colour += (fraction * (0.3 + 0.7 * fraction)) * (HAZE - colour)
        outputs.depth_m[i_pixel] = hit.t / length
        outputs.kind[i_pixel] = wp.uint8(SOLID)
        for k in range(3):
            outputs.rgb[3 * i_pixel + k] = code(paints, colour[k] * view.gain[k])
