"""What our car sees: what is where in the frame of its box, with ranges; nothing a real vehicle could not know.

A surface is two floats: the direction to its nearest point times 1 / (1 + distance / 1 m), so that what is near is
large and what is far fades. The goal is a direction, a distance and a nearness, its heading, and its nearest edge.
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
    into_frame,
    position_of,
    right_of,
    storey_centre,
    storey_of,
)
from policies.tasks.parking.car import nearest_in_box
from policies.tasks.parking.scene import MAX_OBSTACLES, Scene

wp.set_module_options({"enable_backward": False})

RANGE_SCALE_M = 30.0
SPEED_SCALE_M_S = 10.0
_PER_RANGE = wp.constant(1.0 / RANGE_SCALE_M)
_PER_SPEED = wp.constant(1.0 / SPEED_SCALE_M_S)


def goal_elements() -> tuple[Element, ...]:
    """Eight: where its centre is, how it is turned, and where its nearest edge is."""
    return (
        Element("goal_direction_right", "1", is_goal=True),
        Element("goal_direction_forward", "1", is_goal=True),
        Element("goal_distance", "m", RANGE_SCALE_M, is_goal=True),
        Element("goal_nearness", "1", is_goal=True),
        Element("goal_heading_right", "1", is_goal=True),
        Element("goal_heading_forward", "1", is_goal=True),
        Element("goal_edge_right", "1", is_goal=True),
        Element("goal_edge_forward", "1", is_goal=True),
    )


def velocity_elements(name: str) -> tuple[Element, ...]:
    """Two."""
    return Element(f"{name}_right", "m/s", SPEED_SCALE_M_S), Element(f"{name}_forward", "m/s", SPEED_SCALE_M_S)


def surface_elements(*names: str) -> tuple[Element, ...]:
    """Two of each surface."""
    return tuple(Element(f"{name}_nearness_{axis}", "1") for name in names for axis in ("right", "forward"))


@wp.func
def write_pair(buffers: StepBuffers, i: int, at: int, pair: wp.vec2) -> int:
    """Writes two floats; returns the next column."""
    buffers.observations[i, at] = pair[0]
    buffers.observations[i, at + 1] = pair[1]
    return at + 2


@wp.func
def faded(gap: wp.vec2, radius: float) -> wp.vec2:
    """Direction times nearness of a surface that begins a radius before the end of `gap` [m]."""
    length = wp.max(wp.length(gap), 1.0e-6)
    return gap / (length * (1.0 + wp.max(length - radius, 0.0)))


@wp.func
def write_velocity(buffers: StepBuffers, i: int, at: int, box: wp.vec4, vel: wp.vec2) -> int:
    """A velocity in the car's frame; returns the next column."""
    seen = wp.vec2(wp.dot(vel, right_of(box)), wp.dot(vel, forward_of(box)))
    return write_pair(buffers, i, at, seen * _PER_SPEED)


@wp.func
def write_box(buffers: StepBuffers, i: int, at: int, box: wp.vec4, other: wp.vec4, half: wp.vec2, radius: float) -> int:
    """The nearest surface of a rounded box; returns the next column."""
    local = into_frame(other, position_of(box))
    gap = nearest_in_box(half, local) - local
    world = gap[0] * right_of(other) + gap[1] * forward_of(other)
    seen = wp.vec2(wp.dot(world, right_of(box)), wp.dot(world, forward_of(box)))
    return write_pair(buffers, i, at, faded(seen, radius))


@wp.func
def write_goal(buffers: StepBuffers, i: int, at: int, box: wp.vec4, goal: wp.vec4, half: wp.vec2) -> int:
    """The goal elements of what is to be driven to, with its half sizes; returns the next column."""
    gap = into_frame(box, position_of(goal))
    distance = wp.length(gap)
    nose = forward_of(goal)
    next_at = write_pair(buffers, i, at, gap / wp.max(distance, 1.0e-6))
    next_at = write_pair(buffers, i, next_at, wp.vec2(distance * _PER_RANGE, 1.0 / (1.0 + distance)))
    next_at = write_pair(buffers, i, next_at, wp.vec2(wp.dot(nose, right_of(box)), wp.dot(nose, forward_of(box))))
    return write_box(buffers, i, next_at, box, goal, half, 0.0)


@wp.func
def write_walls(buffers: StepBuffers, i: int, at: int, box: wp.vec4) -> int:
    """The four walls of the storey; returns the next column."""
    position = position_of(box) - storey_centre(storey_of(box[0]))
    x = wp.vec2(box[3], box[2])  # the world's axes in the car's frame
    z = wp.vec2(-box[2], box[3])
    next_at = write_pair(buffers, i, at, faded((WALL_X_LOW - position[0]) * x, 0.0))
    next_at = write_pair(buffers, i, next_at, faded((WALL_X_HIGH - position[0]) * x, 0.0))
    next_at = write_pair(buffers, i, next_at, faded((WALL_Z_LOW - position[1]) * z, 0.0))
    return write_pair(buffers, i, next_at, faded((WALL_Z_HIGH - position[1]) * z, 0.0))


@wp.func
def write_obstacles(buffers: StepBuffers, i: int, at: int, box: wp.vec4, scene: Scene) -> int:
    """The nearest surfaces of the scene's obstacles; returns the next column."""
    next_at = at
    for k in range(MAX_OBSTACLES):
        if k < scene.obstacle_count:
            next_at = write_box(
                buffers, i, next_at, box, scene.obstacles[k], scene.obstacle_half, scene.obstacle_radius
            )
    return next_at
