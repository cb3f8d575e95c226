"""What a car can meet on its storey, in one form for both levels: obstacles, pad, portal; and what it touches.

Obstacles are rounded boxes: blocks have no rounding, moving capsules no width but their radius.
"""

import warp as wp

from policies.tasks.parking.arena import PORTAL_HALF_X, PORTAL_HALF_Z, forward_of
from policies.tasks.parking.car import box_meets_capsule, box_of_car, boxes_overlap, is_at_wall
from policies.tasks.parking.parking_params import CarParams

wp.set_module_options({"enable_backward": False})

MAX_OBSTACLES = wp.constant(3)
CLEAR = wp.constant(0)  # what a car touches, in the order of precedence
WALL = wp.constant(1)
OBSTACLE = wp.constant(2)
PORTAL = wp.constant(3)
PAD = wp.constant(4)


@wp.struct
class Scene:
    """One storey."""

    obstacles: wp.mat44  # a pose per row
    obstacle_count: int
    obstacle_half: wp.vec2  # [m]
    obstacle_radius: float  # [m]
    goal: wp.vec4  # the pad
    goal_half: wp.vec2  # [m]
    has_goal: wp.bool
    portal: wp.vec4
    has_portal: wp.bool


@wp.func
def half_of_car(params: CarParams) -> wp.vec2:
    """Half sizes of the car's box [m]."""
    return wp.vec2(0.5 * params.car_width_m, 0.5 * params.car_length_m)


@wp.func
def half_of_pad(params: CarParams) -> wp.vec2:
    """Half sizes of the pad [m]."""
    return wp.vec2(0.5 * params.pad_width_m, 0.5 * params.pad_length_m)


@wp.func
def portal_half() -> wp.vec2:
    """Half sizes of a portal's plate [m]."""
    return wp.vec2(PORTAL_HALF_X, PORTAL_HALF_Z)


@wp.func
def touches_obstacle(box: wp.vec4, half: wp.vec2, obstacle: wp.vec4, scene: Scene) -> bool:
    """Whether the car's box overlaps one obstacle."""
    if scene.obstacle_radius > 0.0:
        middle = wp.vec2(obstacle[0], obstacle[1])
        reach = forward_of(obstacle) * scene.obstacle_half[1]
        return box_meets_capsule(box, half, middle - reach, middle + reach, scene.obstacle_radius)
    return boxes_overlap(box, half, obstacle, scene.obstacle_half)


@wp.func
def contact_of(car: wp.vec4, scene: Scene, params: CarParams) -> int:
    """What the car touches: a crash comes before all else."""
    box = box_of_car(car, params.box_ahead_m)
    half = half_of_car(params)
    if is_at_wall(box, half):
        return WALL
    for k in range(MAX_OBSTACLES):
        if k < scene.obstacle_count and touches_obstacle(box, half, scene.obstacles[k], scene):
            return OBSTACLE
    if scene.has_portal and boxes_overlap(box, half, scene.portal, portal_half()):
        return PORTAL
    if scene.has_goal and boxes_overlap(box, half, scene.goal, scene.goal_half):
        return PAD
    return CLEAR
