"""A rover's hull against ground and obstacles: springs with dampers and friction, at points of a box.

In: pose and motion, each 1 ms. Out: force and torque. The surroundings are looked up once a tick and treated as planes
for its four substeps: one for the ground, and one for each point of the outline that is near an obstacle. The outline
is ten balls round the box at the height of the hubs, so that corners, sides and ends are stopped and turned: a small
one at each corner, and six between that slide along their side to where the obstacle is nearest, each tick anew.
Left out: the weight and the drag of who stands on it.
"""

from typing import TYPE_CHECKING, Any, TypeAlias

import warp as wp

from sim.bodies.rover_model import RoverModel
from sim.world.neighbours import carries, neighbour_touched
from sim.world.world import World, obstacle_contact, surface_height

wp.set_module_options({"enable_backward": False})

POINTS = 10
_POINTS = wp.constant(POINTS)
Vec10: TypeAlias = Any if TYPE_CHECKING else wp.types.vector(length=POINTS, dtype=wp.float32)

_GROUND_MARGIN_M = wp.constant(0.05)  # lower within a tick than this it does not get
_MARGIN_M = wp.constant(0.2)  # an obstacle nearer than this is found before the substeps reach it
_FRICTION = wp.constant(0.4)  # guess: plastic on bark, steel on stone
_STICKING_M_S = wp.constant(0.05)  # speed below which friction falls to nothing
_CORNER_BALL = wp.constant(0.25)  # radius over the half width: how round a corner is
_SIDE_BALL = wp.constant(0.5)  # as deep may a blow go before its obstacle is taken to be on the other side


@wp.struct
class HullContact:
    """What is near a hull, valid for one tick."""

    is_near: int  # ground or an obstacle may be touched
    height_agl_m: float  # of the centre of gravity, vertically
    normal_ned: wp.vec3  # of the ground, pointing up
    ground_offset_m: float  # of the ground's plane along its normal
    is_near_ground: int
    is_near_obstacle: int
    normal_x: Vec10  # ned, from the obstacle to the ball
    normal_y: Vec10
    normal_z: Vec10
    offset_m: Vec10  # of each plane along its normal: a ball's centre below it touches
    slid_m: Vec10  # of each ball along its side, from where `outline_frd` has it
    other_vel_ned: wp.vec3  # [m/s] of another vehicle that is near
    other_shift_ned: wp.vec3  # [m] how far it has gone since it was looked up
    other_rigidity: float  # fraction of a rigid obstacle's push: less where the other hull yields too


@wp.struct
class HullForce:
    """Sum over all touching points."""

    force_frd: wp.vec3  # [N]
    torque_frd: wp.vec3  # [N m]
    impact_speed_m_s: float  # largest approach speed along a normal


@wp.func
def is_corner(point: int) -> bool:
    """Whether a ball of the outline is at a corner, where it stays."""
    return point < 6 and point % 3 != 1


@wp.func
def ball_radius(model: RoverModel, point: int) -> float:
    """Of a ball of the outline [m]."""
    return model.hull_half_width_m * wp.where(is_corner(point), _CORNER_BALL, _SIDE_BALL)


@wp.func
def outline_frd(model: RoverModel, point: int) -> wp.vec3:
    """The centre of a ball [m] before it slides: three at the front, three at the rear, two on either side between."""
    ball_m = ball_radius(model, point)
    half = model.hull_half_width_m - ball_m
    front = model.hull_front_m - ball_m
    rear = ball_m - model.hull_rear_m
    if point < 3:
        return wp.vec3(front, half * float(point - 1), model.hub_z)
    if point < 6:
        return wp.vec3(rear, half * float(point - 4), model.hub_z)
    x = rear + (front - rear) * wp.where(point % 2 == 1, 0.75, 0.25)
    return wp.vec3(x, wp.where(point < 8, half, -half), model.hub_z)


@wp.func
def slide_frd(point: int) -> wp.vec3:
    """The direction of the side along which a ball slides."""
    return wp.where(point < 6, wp.vec3(0.0, 1.0, 0.0), wp.vec3(1.0, 0.0, 0.0))


@wp.func
def most_slide(model: RoverModel, point: int) -> float:
    """How far a ball slides to either way at most [m]: over half of its side, or over all of the front or rear."""
    if is_corner(point):
        return 0.0
    ball_m = ball_radius(model, point)
    if point < 6:
        return model.hull_half_width_m - ball_m
    return 0.25 * (model.hull_front_m + model.hull_rear_m) - 0.5 * ball_m


@wp.func
def without_load(model: RoverModel, world: World, pos_ned: wp.vec3) -> World:
    """The world without other vehicles, while one stands on it: of that it feels nothing."""
    bare = world
    if world.neighbours.count > 0:
        if carries(world.neighbours, world.boxes.tick, pos_ned, model.hull_top_m, model.hull_reach_m):
            bare.neighbours.count = 0
    return bare


@wp.func
def is_near_obstacle(model: RoverModel, world: World, pos_ned: wp.vec3) -> int:
    """Whether a trunk, crown or wall may be reached within a tick."""
    touch = obstacle_contact(without_load(model, world, pos_ned), pos_ned, model.hull_reach_m + _MARGIN_M)
    if touch[3] > 0.0:
        return 1
    return 0


@wp.func
def look_at_hull(
    model: RoverModel,
    world: World,
    pos_ned: wp.vec3,
    q_ned_from_frd: wp.quat,
    normal_ned: wp.vec3,
    ground_offset_m: float,
    is_near: int,
) -> HullContact:
    """The ground's plane (its normal and its offset along it), and the nearest obstacle of each point of the outline.

    `is_near`: an obstacle may be touched.
    """
    hull = HullContact()
    bare = without_load(model, world, pos_ned)
    ground_m = surface_height(world, pos_ned)
    hull.height_agl_m = -pos_ned[2] - ground_m
    hull.normal_ned = normal_ned
    hull.ground_offset_m = ground_offset_m
    hull.is_near_obstacle = is_near
    up_frd = wp.quat_rotate_inv(q_ned_from_frd, normal_ned)
    low_m = wp.abs(up_frd[0]) * wp.max(model.hull_front_m, model.hull_rear_m)
    low_m += wp.abs(up_frd[1]) * model.hull_half_width_m
    low_m += wp.where(up_frd[2] < 0.0, -up_frd[2] * model.hull_bottom_m, up_frd[2] * model.hull_top_m)
    hull.is_near_ground = 0
    if wp.dot(normal_ned, pos_ned) - ground_offset_m < low_m + _GROUND_MARGIN_M:
        hull.is_near_ground = 1
    hull.is_near = wp.max(hull.is_near_ground, is_near)
    if is_near == 1:
        hull.other_rigidity = 1.0
        reach_m = model.hull_reach_m + _MARGIN_M
        other = neighbour_touched(bare.neighbours, world.boxes.tick, pos_ned, reach_m, 0.0)
        if other >= 0:  # whatever else is touched in this tick is taken to move and to yield as it does
            stiffness_n_m = bare.neighbours.rows[other].stiffness_n_m
            hull.other_vel_ned = bare.neighbours.rows[other].vel_ned
            hull.other_rigidity = stiffness_n_m / (stiffness_n_m + model.scrape_n_m)  # springs in series
        for point in range(int(_POINTS)):
            centre_ned = pos_ned + wp.quat_rotate(q_ned_from_frd, outline_frd(model, point))
            most_m = most_slide(model, point)
            seen_m = ball_radius(model, point) + _MARGIN_M
            touch = obstacle_contact(bare, centre_ned, seen_m + most_m)
            if touch[3] > 0.0 and most_m > 0.0:
                to_obstacle_ned = (touch[3] - seen_m - most_m) * wp.vec3(touch[0], touch[1], touch[2])
                along_ned = wp.quat_rotate(q_ned_from_frd, slide_frd(point))
                hull.slid_m[point] = wp.clamp(wp.dot(along_ned, to_obstacle_ned), -most_m, most_m)
                centre_ned += hull.slid_m[point] * along_ned
                touch = obstacle_contact(bare, centre_ned, seen_m)
            normal = wp.vec3(touch[0], touch[1], touch[2])
            hull.normal_x[point] = normal[0]
            hull.normal_y[point] = normal[1]
            hull.normal_z[point] = normal[2]
            hull.offset_m[point] = wp.dot(normal, centre_ned) + touch[3] - _MARGIN_M
    return hull


@wp.func
def add_point(
    model: RoverModel,
    total: HullForce,
    depth_m: float,
    arm_frd: wp.vec3,
    normal_frd: wp.vec3,
    vel_frd: wp.vec3,
    omega_frd: wp.vec3,
    rigidity: float,
) -> HullForce:
    """Adds the push and the friction at one point that lies `depth_m` deep."""
    vel_point = vel_frd + wp.cross(omega_frd, arm_frd)
    normal_speed = wp.dot(vel_point, normal_frd)
    push = rigidity * wp.max(model.scrape_n_m * depth_m - model.scrape_n_s_m * normal_speed, 0.0)
    slide = vel_point - normal_speed * normal_frd
    drag = _FRICTION * push / wp.max(wp.length(slide), _STICKING_M_S)
    force = push * normal_frd - drag * slide
    total.force_frd += force
    total.torque_frd += wp.cross(arm_frd, force)
    total.impact_speed_m_s = wp.max(total.impact_speed_m_s, -normal_speed)
    return total


@wp.func
def hull_contact(
    model: RoverModel, hull: HullContact, pos_ned: wp.vec3, vel_frd: wp.vec3, rot: wp.mat33, omega_frd: wp.vec3
) -> HullForce:
    """What ground and obstacles do to the hull."""
    total = HullForce()
    to_frd = wp.transpose(rot)
    height_m = wp.dot(hull.normal_ned, pos_ned) - hull.ground_offset_m
    if hull.is_near_ground == 1:
        normal_frd = to_frd * hull.normal_ned
        for corner in range(8):
            x = wp.where(corner % 2 == 0, model.hull_front_m, -model.hull_rear_m)
            y = wp.where((corner // 2) % 2 == 0, model.hull_half_width_m, -model.hull_half_width_m)
            z = wp.where(corner // 4 == 0, model.hull_bottom_m, -model.hull_top_m)
            arm_frd = wp.vec3(x, y, z)
            depth_m = -height_m - wp.dot(normal_frd, arm_frd)
            if depth_m > 0.0:
                total = add_point(model, total, depth_m, arm_frd, normal_frd, vel_frd, omega_frd, 1.0)
    if hull.is_near_obstacle == 1:
        past_frd = vel_frd - to_frd * hull.other_vel_ned
        for point in range(int(_POINTS)):
            normal_ned = wp.vec3(hull.normal_x[point], hull.normal_y[point], hull.normal_z[point])
            arm_frd = outline_frd(model, point) + hull.slid_m[point] * slide_frd(point)
            centre_ned = pos_ned + rot * arm_frd
            depth_m = hull.offset_m[point] - wp.dot(normal_ned, centre_ned - hull.other_shift_ned)
            if depth_m > 0.0 and wp.length_sq(normal_ned) > 0.5:
                normal_frd = to_frd * normal_ned
                arm_frd -= ball_radius(model, point) * normal_frd
                rigidity = hull.other_rigidity
                total = add_point(model, total, depth_m, arm_frd, normal_frd, past_frd, omega_frd, rigidity)
    return total
