"""The frame of Parking2: what its elements are, and the function that writes them.

As documented it is six floats and the rays: 93, the size of the document's network input. Its text also says that the
vectors are stacked by three, which would be 105; `stack=3` stacks all. As coded it is 57 floats, stacked by three. Ours
gives what lies ahead on the route, the goal or the portal to it, and the movers of the own storey with their
velocities, as a tracking sensor would.
"""

import warp as wp

from policies.tasks.episode import StepBuffers, open_frame
from policies.tasks.layout import Element
from policies.tasks.parking.arena import (
    MOVER_HEIGHT,
    MOVER_POSITIONS,
    PORTAL_HEIGHTS,
    PORTAL_POSITIONS,
    STOREY_X,
    STOREY_Z,
    WALL_CENTRES,
    WALL_HEIGHT,
    forward_of,
)
from policies.tasks.parking.car import box_of_car
from policies.tasks.parking.drive import Motion
from policies.tasks.parking.movers import PER_STOREY
from policies.tasks.parking.observe_documents import (
    gap_to,
    seen_from,
    unit_elements,
    unit_to,
    world_elements,
    write_vector,
)
from policies.tasks.parking.observe_ranged import (
    goal_elements,
    surface_elements,
    velocity_elements,
    write_box,
    write_goal,
    write_obstacles,
    write_velocity,
    write_walls,
)
from policies.tasks.parking.parking_params import CarParams, Level2Params
from policies.tasks.parking.rays import ray_elements, write_rays
from policies.tasks.parking.scene import Scene, portal_half
from policies.tasks.parking.settings import AS_DOCUMENTED, RANGED, Choices, Rules

wp.set_module_options({"enable_backward": False})

GOAL_HEIGHT = wp.constant(0.0)  # [m] of the published goal of storey 2; taken for all goals of level 2
_MOVER_COUNT = wp.constant(len(MOVER_POSITIONS))
_AS_DOCUMENTED, _RANGED = wp.constant(AS_DOCUMENTED), wp.constant(RANGED)
_MOVER_HEIGHT, _WALL_HEIGHT = wp.constant(MOVER_HEIGHT), wp.constant(WALL_HEIGHT)
_PORTALS = wp.constant(  # x, y, z of each [m]
    wp.mat33(
        *(x for (px, pz, _), y in zip(PORTAL_POSITIONS, PORTAL_HEIGHTS, strict=True) for x in (px, y, pz)), 0, 0, 0
    )
)
_WALL_LOW_X, _WALL_HIGH_X, _WALL_LOW_Z, _WALL_HIGH_Z = (wp.constant(c) for c in WALL_CENTRES)
_STOREY_X_2, _STOREY_Z_2 = wp.constant(STOREY_X[1]), wp.constant(STOREY_Z[1])

STACKS = {"as-documented": 1, "as-coded": 3, "improved": 1}  # of the presets


def frame_of(choices: Choices, rules: Rules, tags: tuple[str, ...]) -> tuple[Element, ...]:
    """The elements of a frame, in order."""
    rays = ray_elements(rules, tags)
    walls = ("wall_x_low", "wall_x_high", "wall_z_low", "wall_z_high")
    if choices.observation == "ranged":
        pair = ("mover_z", "mover_x")
        return (
            *goal_elements(),
            Element("is_goal_here", "1", is_goal=True),
            *velocity_elements("vel_car"),
            *surface_elements(*pair, *walls, "portal"),
            *(element for mover in pair for element in velocity_elements(f"{mover}_vel_car")),
            *rays,
        )
    goal = (*world_elements("goal", is_goal=True), *unit_elements("goal", is_goal=True))
    if choices.observation == "as-documented":
        return (*goal, *rays)
    portals = [(*world_elements(f"portal_{k}"), *unit_elements(f"portal_{k}")) for k in (1, 2)]
    movers = tuple(f"mover_{k + 1}" for k in range(len(MOVER_POSITIONS)))
    storey_walls = tuple(f"storey_{storey}_{wall}" for storey in (1, 2) for wall in walls)
    units = tuple(element for name in (*movers, *storey_walls) for element in unit_elements(name))
    return (*portals[0], *portals[1], *goal, *units, *world_elements("vel", "m/s"), *rays)


@wp.func
def write_target(buffers: StepBuffers, i: int, at: int, car: wp.vec4, x: float, y: float, z: float) -> int:
    """World direction and car-frame unit vector to a point; returns the next column."""
    direction = wp.normalize(gap_to(car, x, y, z))
    next_at = write_vector(buffers, i, at, direction)
    return write_vector(buffers, i, next_at, seen_from(car, direction))


@wp.func
def write_storey_walls(buffers: StepBuffers, i: int, at: int, car: wp.vec4, x: float, z: float) -> int:
    """Unit vectors to the centres of four walls round a storey's centre; returns the next column."""
    next_at = write_vector(buffers, i, at, unit_to(car, x + _WALL_LOW_X, _WALL_HEIGHT, z))
    next_at = write_vector(buffers, i, next_at, unit_to(car, x + _WALL_HIGH_X, _WALL_HEIGHT, z))
    next_at = write_vector(buffers, i, next_at, unit_to(car, x, _WALL_HEIGHT, z + _WALL_LOW_Z))
    return write_vector(buffers, i, next_at, unit_to(car, x, _WALL_HEIGHT, z + _WALL_HIGH_Z))


@wp.func
def observe_coded(
    buffers: StepBuffers, i: int, at: int, motion: Motion, goal: wp.vec4, movers: wp.array2d(dtype=wp.vec4)
) -> int:
    """The 57 floats of the published code; returns the next column."""
    car = motion.pose
    next_at = at
    for k in range(2):
        next_at = write_target(buffers, i, next_at, car, _PORTALS[k, 0], _PORTALS[k, 1], _PORTALS[k, 2])
    next_at = write_target(buffers, i, next_at, car, goal[0], GOAL_HEIGHT, goal[1])
    for k in range(_MOVER_COUNT):
        mover = movers[i, k]
        next_at = write_vector(buffers, i, next_at, unit_to(car, mover[0], _MOVER_HEIGHT, mover[1]))
    next_at = write_storey_walls(buffers, i, next_at, car, 0.0, 0.0)
    next_at = write_storey_walls(buffers, i, next_at, car, _STOREY_X_2, _STOREY_Z_2)
    return write_vector(buffers, i, next_at, wp.vec3(motion.vel[0], 0.0, motion.vel[1]))


@wp.func
def observe_ranged(
    buffers: StepBuffers,
    i: int,
    at: int,
    motion: Motion,
    scene: Scene,
    params: CarParams,
    more: Level2Params,
) -> int:
    """What lies ahead on the route, and what is about; returns the next column."""
    box = box_of_car(motion.pose, params.box_ahead_m)
    next_at = int(0)
    if scene.has_goal:
        next_at = write_goal(buffers, i, at, box, scene.goal, scene.goal_half)
    else:  # the way leads through the portal
        next_at = write_goal(buffers, i, at, box, scene.portal, portal_half())
    buffers.observations[i, next_at] = wp.where(scene.has_goal, 1.0, 0.0)
    next_at = write_velocity(buffers, i, next_at + 1, box, motion.vel)
    next_at = write_obstacles(buffers, i, next_at, box, scene)
    next_at = write_walls(buffers, i, next_at, box)
    next_at = write_box(buffers, i, next_at, box, scene.portal, portal_half(), 0.0)
    for k in range(PER_STOREY):
        vel = forward_of(scene.obstacles[k]) * more.mover_speed_m_s
        next_at = write_velocity(buffers, i, next_at, box, vel)
    return next_at


@wp.func
def observe(
    buffers: StepBuffers,
    i: int,
    motion: Motion,
    movers: wp.array2d(dtype=wp.vec4),
    scene: Scene,
    rules: Rules,
    params: CarParams,
    more: Level2Params,
) -> None:
    """The newest frame."""
    at = open_frame(buffers, i)
    if rules.observation == _RANGED:
        at = observe_ranged(buffers, i, at, motion, scene, params, more)
    elif rules.observation == _AS_DOCUMENTED:
        at = write_target(buffers, i, at, motion.pose, scene.goal[0], GOAL_HEIGHT, scene.goal[1])
    else:
        at = observe_coded(buffers, i, at, motion, scene.goal, movers)
    if rules.ray_count >= 0:
        write_rays(buffers, i, at, motion.pose, scene, rules, params)
