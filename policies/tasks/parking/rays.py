"""A ray sensor as ML-Agents encodes it: spheres cast over a fan of directions, each a one-hot tag, a miss, a fraction.

The order is forward, then right 1, left 1, right 2, left 2, ... The casts are planar and exact: a ray against a box or
a capsule that is widened, and rounded, by the sphere's radius. What a sphere overlaps from the start is hit at once
(Unity would leave it out), and heights are not looked at: pads and portals are hit as triggers are in Unity.
"""

import warp as wp

from policies.tasks.episode import StepBuffers
from policies.tasks.layout import Element
from policies.tasks.parking.arena import (
    WALL_X_HIGH,
    WALL_X_LOW,
    WALL_Z_HIGH,
    WALL_Z_LOW,
    forward_of,
    position_of,
    right_of,
    storey_centre,
    storey_of,
)
from policies.tasks.parking.parking_params import CarParams
from policies.tasks.parking.scene import MAX_OBSTACLES, Scene, portal_half
from policies.tasks.parking.settings import Rules

wp.set_module_options({"enable_backward": False})

FAR = wp.constant(1.0e9)  # [m] of what is not hit


def ray_elements(rules: Rules, tags: tuple[str, ...]) -> tuple[Element, ...]:
    """Tags, miss and fraction of each ray, in the sensor's order."""
    sides = [f"{side}_{k + 1}" for k in range(rules.ray_count) for side in ("right", "left")]
    return tuple(
        Element(f"ray_{ray}_{what}", "1")
        for ray in (("ahead", *sides) if rules.ray_count >= 0 else ())
        for what in (*tags, "miss", "fraction")
    )


@wp.func
def ray_to_walls(start: wp.vec2, ray: wp.vec2, radius: float) -> float:
    """How far a sphere goes until it reaches a wall of its storey [m]; the room is closed, so it always does."""
    from_centre = start - storey_centre(storey_of(start[0]))
    gap_x = wp.where(ray[0] > 0.0, WALL_X_HIGH - radius - from_centre[0], WALL_X_LOW + radius - from_centre[0])
    gap_z = wp.where(ray[1] > 0.0, WALL_Z_HIGH - radius - from_centre[1], WALL_Z_LOW + radius - from_centre[1])
    far_x = wp.where(wp.abs(ray[0]) > 1.0e-9, gap_x / ray[0], FAR)
    far_z = wp.where(wp.abs(ray[1]) > 1.0e-9, gap_z / ray[1], FAR)
    return wp.max(0.0, wp.min(far_x, far_z))


@wp.func
def ray_to_disc(start: wp.vec2, ray: wp.vec2, radius: float) -> float:
    """How far a point goes until it reaches a disc round the origin [m], or FAR."""
    towards = -wp.dot(start, ray)
    left = wp.dot(start, start) - radius * radius
    if left <= 0.0:
        return 0.0
    room = towards * towards - left
    return wp.where(towards > 0.0 and room >= 0.0, towards - wp.sqrt(wp.max(room, 0.0)), FAR)


@wp.func
def ray_to_rounded_box(start: wp.vec2, ray: wp.vec2, half: wp.vec2, radius: float) -> float:
    """How far a sphere goes until it reaches a box round the origin, in the box's frame [m], or FAR.

    The widened box is entered first; where that is beyond a corner, the corner's disc decides: who misses it misses
    the rounded box.
    """
    wide = half + wp.vec2(radius, radius)
    enter = float(0.0)
    leave = float(FAR)
    for k in range(2):
        if wp.abs(ray[k]) < 1.0e-9:
            if wp.abs(start[k]) > wide[k]:
                return FAR
        else:
            side = wp.where(ray[k] > 0.0, wide[k], -wide[k])
            enter = wp.max(enter, (-side - start[k]) / ray[k])
            leave = wp.min(leave, (side - start[k]) / ray[k])
    if enter > leave:
        return FAR
    at = start + ray * enter
    if wp.abs(at[0]) > half[0] and wp.abs(at[1]) > half[1]:
        corner = wp.vec2(wp.where(at[0] > 0.0, half[0], -half[0]), wp.where(at[1] > 0.0, half[1], -half[1]))
        return ray_to_disc(start - corner, ray, radius)
    return enter


@wp.func
def ray_to_box(start: wp.vec2, ray: wp.vec2, box: wp.vec4, half: wp.vec2, radius: float) -> float:
    """How far a sphere goes until it reaches a box that stands anywhere [m], or FAR."""
    gap = start - position_of(box)
    towards = -wp.dot(gap, ray)
    reach = wp.length(half) + radius
    aside = wp.dot(gap, gap) - towards * towards
    if aside > reach * reach or towards < -reach:  # passes by, or is behind
        return FAR
    right = right_of(box)
    forward = forward_of(box)
    start_box = wp.vec2(wp.dot(gap, right), wp.dot(gap, forward))
    return ray_to_rounded_box(start_box, wp.vec2(wp.dot(ray, right), wp.dot(ray, forward)), half, radius)


@wp.func
def turned(ray: wp.vec2, sine: float, cosine: float) -> wp.vec2:
    """A direction turned clockwise (to the right) by an angle."""
    return wp.vec2(ray[0] * cosine + ray[1] * sine, ray[1] * cosine - ray[0] * sine)


@wp.struct
class Cast:
    """What one ray met."""

    distance_m: float
    tag: int  # column of the one-hot, -1: none


@wp.func
def cast_ray(start: wp.vec2, ray: wp.vec2, scene: Scene, rules: Rules, radius: float) -> Cast:
    """The nearest of all that a ray meets."""
    cast = Cast()
    cast.distance_m = ray_to_walls(start, ray, radius)
    cast.tag = rules.wall_tag
    for k in range(MAX_OBSTACLES):
        if k < scene.obstacle_count:
            wide = radius + scene.obstacle_radius
            far = ray_to_box(start, ray, scene.obstacles[k], scene.obstacle_half, wide)
            if far < cast.distance_m:
                cast.distance_m = far
                cast.tag = rules.obstacle_tag
    if scene.has_goal:
        far = ray_to_box(start, ray, scene.goal, scene.goal_half, radius)
        if far < cast.distance_m:
            cast.distance_m = far
            cast.tag = rules.goal_tag
    if scene.has_portal:
        far = ray_to_box(start, ray, scene.portal, portal_half(), radius)
        if far < cast.distance_m:
            cast.distance_m = far
            cast.tag = rules.portal_tag
    return cast


@wp.func
def write_ray(buffers: StepBuffers, i: int, at: int, cast: Cast, length_m: float, rules: Rules) -> int:
    """One ray's floats; returns the next column."""
    is_miss = cast.distance_m > length_m
    for k in range(rules.tag_count):
        buffers.observations[i, at + k] = wp.where(k == cast.tag and not is_miss, 1.0, 0.0)
    buffers.observations[i, at + rules.tag_count] = wp.where(is_miss, 1.0, 0.0)
    buffers.observations[i, at + rules.tag_count + 1] = wp.where(is_miss, 1.0, cast.distance_m / length_m)
    return at + rules.tag_count + 2


@wp.func
def write_rays(
    buffers: StepBuffers, i: int, at: int, car: wp.vec4, scene: Scene, rules: Rules, params: CarParams
) -> int:
    """The whole sensor, from the car's origin; returns the next column."""
    start = position_of(car)
    radius = params.ray_radius_m
    length_m = params.ray_length_m
    right = forward_of(car)
    left = right
    next_at = write_ray(buffers, i, at, cast_ray(start, right, scene, rules, radius), length_m, rules)
    spacing_rad = wp.radians(params.ray_degrees) / float(wp.max(rules.ray_count, 1))
    sine = wp.sin(spacing_rad)
    cosine = wp.cos(spacing_rad)
    for _pair in range(rules.ray_count):
        right = turned(right, sine, cosine)
        left = turned(left, -sine, cosine)
        next_at = write_ray(buffers, i, next_at, cast_ray(start, right, scene, rules, radius), length_m, rules)
        next_at = write_ray(buffers, i, next_at, cast_ray(start, left, scene, rules, radius), length_m, rules)
    return next_at
