"""The car of 'Park It Right': a box that is pushed along its nose and damped in all directions, turned at once.

One tick is one physics step of 20 ms. Frames are Unity's (see arena.py). Overlaps are planar: everything that can be
touched reaches from the floor to above the car's box.
"""

import warp as wp

from policies.tasks.parking.arena import (
    WALL_X_HIGH,
    WALL_X_LOW,
    WALL_Z_HIGH,
    WALL_Z_LOW,
    forward_of,
    into_frame,
    position_of,
    right_of,
    storey_centre,
    storey_of,
)

wp.set_module_options({"enable_backward": False})

TICK_S = 0.02
DT = wp.constant(TICK_S)


@wp.func
def damped_push(vel: wp.vec2, accel: wp.vec2, drag: float) -> wp.vec2:
    """Velocity one tick later, as Unity does it: the push is added first, then the whole is damped."""
    return (vel + accel * DT) * wp.max(0.0, 1.0 - drag * DT)


@wp.func
def box_of_car(car: wp.vec4, ahead_m: float) -> wp.vec4:
    """The pose of the car's box, whose centre is ahead of the car's origin."""
    return wp.vec4(car[0] + ahead_m * car[2], car[1] + ahead_m * car[3], car[2], car[3])


@wp.func
def boxes_overlap(a: wp.vec4, half_a: wp.vec2, b: wp.vec4, half_b: wp.vec2) -> bool:
    """Whether two boxes overlap: no axis of either separates them. Half sizes along their own x and z [m]."""
    gap = position_of(b) - position_of(a)
    reach = wp.length(half_a) + wp.length(half_b)
    if wp.dot(gap, gap) > reach * reach:
        return False
    along = wp.abs(a[3] * b[3] + a[2] * b[2])  # cosine and sine of the angle between them
    across = wp.abs(a[3] * b[2] - a[2] * b[3])
    return (
        wp.abs(wp.dot(gap, right_of(a))) <= half_a[0] + half_b[0] * along + half_b[1] * across
        and wp.abs(wp.dot(gap, forward_of(a))) <= half_a[1] + half_b[0] * across + half_b[1] * along
        and wp.abs(wp.dot(gap, right_of(b))) <= half_b[0] + half_a[0] * along + half_a[1] * across
        and wp.abs(wp.dot(gap, forward_of(b))) <= half_b[1] + half_a[0] * across + half_a[1] * along
    )


@wp.func
def is_at_wall(box: wp.vec4, half: wp.vec2) -> bool:
    """Whether a box reaches a wall of its storey."""
    centre = storey_centre(storey_of(box[0]))
    x = box[0] - centre[0]
    z = box[1] - centre[1]
    reach_x = half[0] * wp.abs(box[3]) + half[1] * wp.abs(box[2])
    reach_z = half[0] * wp.abs(box[2]) + half[1] * wp.abs(box[3])
    return (
        x - reach_x <= WALL_X_LOW
        or x + reach_x >= WALL_X_HIGH
        or z - reach_z <= WALL_Z_LOW
        or z + reach_z >= WALL_Z_HIGH
    )


@wp.func
def nearest_in_box(half: wp.vec2, point: wp.vec2) -> wp.vec2:
    """The point of a box that lies nearest to another, both in the box's frame."""
    return wp.vec2(wp.clamp(point[0], -half[0], half[0]), wp.clamp(point[1], -half[1], half[1]))


@wp.func
def box_distance(box: wp.vec4, half: wp.vec2, point: wp.vec2) -> float:
    """From a point to a box's surface; 0 inside [m]."""
    local = into_frame(box, point)
    return wp.length(local - nearest_in_box(half, local))


@wp.func
def nearest_on_line(a: wp.vec2, b: wp.vec2, point: wp.vec2) -> wp.vec2:
    """The point of the line from a to b that lies nearest to another."""
    along = b - a
    fraction = wp.dot(point - a, along) / wp.max(wp.dot(along, along), 1.0e-9)
    return a + along * wp.clamp(fraction, 0.0, 1.0)


@wp.func
def crosses_box(half: wp.vec2, a: wp.vec2, b: wp.vec2) -> bool:
    """Whether the line from a to b meets a box, all in the box's frame (separating axes)."""
    middle = 0.5 * (a + b)
    reach = 0.5 * (b - a)
    return (
        wp.abs(middle[0]) <= half[0] + wp.abs(reach[0])
        and wp.abs(middle[1]) <= half[1] + wp.abs(reach[1])
        and wp.abs(middle[0] * reach[1] - middle[1] * reach[0])
        <= half[0] * wp.abs(reach[1]) + half[1] * wp.abs(reach[0])
    )


@wp.func
def box_meets_capsule(box: wp.vec4, half: wp.vec2, a_world: wp.vec2, b_world: wp.vec2, radius: float) -> bool:
    """Whether a box overlaps all that lies within a radius of the line from a to b."""
    middle = 0.5 * (a_world + b_world) - position_of(box)
    reach = wp.length(half) + radius + 0.5 * wp.length(b_world - a_world)
    if wp.dot(middle, middle) > reach * reach:
        return False
    a = into_frame(box, a_world)
    b = into_frame(box, b_world)
    if crosses_box(half, a, b):
        return True
    gap = wp.min(wp.length(a - nearest_in_box(half, a)), wp.length(b - nearest_in_box(half, b)))
    for k in range(4):
        corner = wp.vec2(wp.where(k < 2, half[0], -half[0]), wp.where(k % 2 == 0, half[1], -half[1]))
        gap = wp.min(gap, wp.length(corner - nearest_on_line(a, b, corner)))
    return gap <= radius
