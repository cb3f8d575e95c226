"""What is the same for all pixels of a camera: its axes, the columns it needs, the solids it may see.

Runs once per image, before its columns and rows.
"""

import warp as wp

from sim.sensors.camera import Lens
from sim.sensors.fast_camera.camera_view import View, face_length, level_direction, pseudo_angle
from sim.sensors.fast_camera.columns import Columns
from sim.sensors.fast_camera.figure import list_person
from sim.sensors.fast_camera.ground import Ground, surface
from sim.sensors.fast_camera.solids import NEVER, Sights, list_forest, list_neighbours
from sim.sensors.ray import SKY
from sim.sensors.shading import SUN_NED
from sim.world.clothes import Clothes
from sim.world.people import Person
from sim.world.world import World

wp.set_module_options({"enable_backward": False})

_FAR_M = wp.constant(1.0e5)  # no camera is so far out; not true of NaN either
_MARGIN = wp.constant(1.02)  # on the steepest slope
_GENTLE = wp.constant(0.01)  # level ground counts as this steep, squared
_FIRST_MIN_M = wp.constant(0.25)


@wp.func
def with_axes(view: View, lens: Lens, width: int) -> View:
    """The camera with its pose, axes and optics; far up in the sky if its pose is not a number."""
    q = wp.normalize(lens.q_ned_from_rdf)
    pos_ned = lens.pos_ned
    is_turned = wp.dot(lens.q_ned_from_rdf, lens.q_ned_from_rdf) > 0.0
    if not (wp.abs(pos_ned[0]) + wp.abs(pos_ned[1]) + wp.abs(pos_ned[2]) < _FAR_M and is_turned):
        q = wp.quat(0.5, 0.5, 0.5, 0.5)
        pos_ned = wp.vec3(0.0, 0.0, -_FAR_M)
    view.pos_ned = pos_ned
    view.right = wp.quat_rotate(q, wp.vec3(1.0, 0.0, 0.0))
    view.down = wp.quat_rotate(q, wp.vec3(0.0, 1.0, 0.0))
    view.ahead = wp.quat_rotate(q, wp.vec3(0.0, 0.0, 1.0))
    view.sun_rdf = wp.vec3(wp.dot(SUN_NED, view.right), wp.dot(SUN_NED, view.down), wp.dot(SUN_NED, view.ahead))
    view.north_rdf = wp.vec3(view.right[0], view.down[0], view.ahead[0])
    view.east_rdf = wp.vec3(view.right[1], view.down[1], view.ahead[1])
    view.up_rdf = -wp.vec3(view.right[2], view.down[2], view.ahead[2])
    level = wp.sqrt(view.ahead[0] * view.ahead[0] + view.ahead[1] * view.ahead[1])
    view.heading = wp.vec2(1.0, 0.0)
    if level > 1.0e-4:
        view.heading = wp.vec2(view.ahead[0] / level, view.ahead[1] / level)
    view.per_pixel = 2.0 * lens.half_width / float(width)
    view.gain = lens.exposure * lens.balance
    return view


@wp.func
def level_ned(view: View, ahead: float, right: float) -> wp.vec2:
    """North and east of a level direction that is counted from the heading."""
    return wp.vec2(ahead * view.heading[0] - right * view.heading[1], ahead * view.heading[1] + right * view.heading[0])


@wp.func
def with_columns(view: View, width: int, height: int, room: int) -> View:
    """The camera with the range of level directions in its image: all of them if straight up or down is in it."""
    half_x = 0.5 * float(width) * view.per_pixel
    half_y = 0.5 * float(height) * view.per_pixel
    low = float(NEVER)
    high = float(-NEVER)
    falling = int(0)
    climbing = int(0)
    for i in range(4):
        x = wp.where(i % 2 == 0, -half_x, half_x)
        y = wp.where(i < 2, -half_y, half_y)
        ray = view.ahead + x * view.right + y * view.down
        ahead = ray[0] * view.heading[0] + ray[1] * view.heading[1]
        right = ray[1] * view.heading[0] - ray[0] * view.heading[1]
        angle = pseudo_angle(ahead, right, 1.0 / face_length(ahead, right))
        low = wp.min(low, angle)
        high = wp.max(high, angle)
        if ray[2] * ray[2] > view.steep_squared * (ahead * ahead + right * right):
            falling = falling + wp.where(ray[2] > 0.0, 1, 0)
            climbing = climbing + wp.where(ray[2] < 0.0, 1, 0)
    depth = wp.max(wp.abs(view.up_rdf[2]), 1.0e-6)  # where straight up or down is in the image
    is_upright = wp.abs(view.up_rdf[0]) <= half_x * depth and wp.abs(view.up_rdf[1]) <= half_y * depth
    if is_upright or high - low > 4.0:
        low = -4.0
        high = 4.0
    else:
        left_way = level_direction(low)
        right_way = level_direction(high)
        view.left_edge = wp.normalize(level_ned(view, -left_way[1], left_way[0]))
        view.right_edge = wp.normalize(level_ned(view, right_way[1], -right_way[0]))
    view.angle_low = low
    view.columns = wp.clamp(int((high - low) / (2.0 * view.per_pixel)) + 2, 8, room)
    view.columns_per_angle = float(view.columns - 1) / wp.max(high - low, 1.0e-3)
    if falling == 4 or climbing == 4:  # so are all rays between
        view.columns = 0
    return view


@wp.func
def steepest(ground: Ground, world: int) -> float:
    """Square of a slope that no ground of a world has."""
    squared = float(_GENTLE)
    for i in range(ground.side):
        squared = wp.max(squared, _MARGIN * ground.steepness[world * ground.side + i])
    return squared


@wp.kernel
def prepare_views(
    first_camera: int,
    worlds: wp.array[World],
    i_world: wp.array[int],
    lenses: wp.array[Lens],
    people: wp.array2d(dtype=Person),
    clothes: wp.array2d(dtype=Clothes),
    is_chosen: wp.array[wp.bool],
    ground: Ground,
    range_m: float,
    size: wp.vec2i,
    views: wp.array[View],
    columns: Columns,
    sights: Sights,
) -> None:
    i_camera = first_camera + wp.tid()
    if not is_chosen[i_camera]:
        return
    world = i_world[i_camera]
    w = worlds[world]
    view = with_axes(View(), lenses[i_camera], size[0])
    view.cell_base = world * ground.side * ground.side
    view.texel_base = world * ground.texels * ground.texels
    view.inside = SKY
    u = (view.pos_ned[0] + ground.half_size_m) * ground.cells_per_m
    v = (view.pos_ned[1] + ground.half_size_m) * ground.cells_per_m
    view.eye = wp.vec3(u, v, -view.pos_ned[2])
    view.above_ground = wp.max(-view.pos_ned[2] - surface(ground, view.cell_base, u, v)[0], 0.02)
    view.steep_squared = steepest(ground, world)
    # no ray that needs a column meets the ground nearer, even where both slopes are the steepest
    near = 0.5 * view.above_ground / wp.sqrt(view.steep_squared)
    view.first_m = wp.clamp(near, _FIRST_MIN_M, 0.25 * range_m)
    growth = wp.pow(range_m / view.first_m, 1.0 / float(columns.samples - 1))
    distance = view.first_m
    for k in range(columns.samples):
        columns.distances[i_camera * columns.samples + k] = distance
        distance = distance * growth
    view = with_columns(view, size[0], size[1], columns.room)
    out_most = wp.max(wp.abs(view.pos_ned[0]), wp.abs(view.pos_ned[1]))
    view.wall_top = w.walls.top_m
    view.has_wall = w.walls.is_built != 0 and out_most < ground.half_size_m and out_most + range_m > ground.half_size_m
    for k in range(people.shape[1]):
        view = list_person(sights, i_camera, view, people[i_camera, k], clothes[i_camera, k], size[0], size[1])
    view = list_neighbours(sights, i_camera, view, w.neighbours, size[0], size[1])
    view = list_forest(sights, i_camera, view, w.forest, range_m, size[0], size[1])
    views[i_camera] = view
