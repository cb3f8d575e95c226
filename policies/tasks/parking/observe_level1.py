"""The frame of Parking1: what its elements are, and the function that writes them."""

import warp as wp

from policies.tasks.episode import StepBuffers, open_frame
from policies.tasks.layout import Element
from policies.tasks.parking.arena import (
    BLOCK_HEIGHT,
    BLOCK_POSITIONS,
    SPOT_HEIGHT,
    WALL_CENTRE_X_HIGH,
    WALL_CENTRE_X_LOW,
    WALL_CENTRE_Z_HIGH,
    WALL_CENTRE_Z_LOW,
    WALL_HEIGHT,
)
from policies.tasks.parking.car import box_of_car
from policies.tasks.parking.drive import Motion
from policies.tasks.parking.observe_documents import gap_to, unit_elements, unit_to, world_elements, write_vector
from policies.tasks.parking.observe_ranged import (
    goal_elements,
    surface_elements,
    velocity_elements,
    write_goal,
    write_obstacles,
    write_velocity,
    write_walls,
)
from policies.tasks.parking.parking_params import CarParams
from policies.tasks.parking.rays import ray_elements, write_rays
from policies.tasks.parking.scene import Scene
from policies.tasks.parking.settings import AS_DOCUMENTED, RANGED, Choices, Rules

wp.set_module_options({"enable_backward": False})

BLOCK_COUNT = wp.constant(len(BLOCK_POSITIONS))
_AS_DOCUMENTED, _RANGED = wp.constant(AS_DOCUMENTED), wp.constant(RANGED)
_SPOT_HEIGHT, _BLOCK_HEIGHT, _WALL_HEIGHT = (wp.constant(h) for h in (SPOT_HEIGHT, BLOCK_HEIGHT, WALL_HEIGHT))


def frame_of(choices: Choices, rules: Rules, tags: tuple[str, ...]) -> tuple[Element, ...]:
    """The elements of a frame, in order."""
    blocks = tuple(f"block_{k + 1}" for k in range(len(BLOCK_POSITIONS)))
    walls = ("wall_x_low", "wall_x_high", "wall_z_low", "wall_z_high")
    rays = ray_elements(rules, tags)
    if choices.observation == "ranged":
        return (
            *goal_elements(),
            *velocity_elements("vel_car"),
            *surface_elements(*blocks, *walls),
            *rays,
        )
    units = (*unit_elements("goal", is_goal=True), *(e for name in (*blocks, *walls) for e in unit_elements(name)))
    if choices.observation == "as-documented":
        return (*world_elements("goal", is_goal=True), *units, *rays)
    return (*units, *(Element(f"padding_{k}", "1") for k in range(3)), *rays)


@wp.func
def observe_units(buffers: StepBuffers, i: int, at: int, car: wp.vec4, scene: Scene, is_documented: bool) -> int:
    """The documents' 27 floats."""
    goal = scene.goal
    next_at = at
    if is_documented:
        next_at = write_vector(buffers, i, next_at, wp.normalize(gap_to(car, goal[0], _SPOT_HEIGHT, goal[1])))
    next_at = write_vector(buffers, i, next_at, unit_to(car, goal[0], _SPOT_HEIGHT, goal[1]))
    for k in range(BLOCK_COUNT):
        block = scene.obstacles[k]
        next_at = write_vector(buffers, i, next_at, unit_to(car, block[0], _BLOCK_HEIGHT, block[1]))
    next_at = write_vector(buffers, i, next_at, unit_to(car, WALL_CENTRE_X_LOW, _WALL_HEIGHT, 0.0))
    next_at = write_vector(buffers, i, next_at, unit_to(car, WALL_CENTRE_X_HIGH, _WALL_HEIGHT, 0.0))
    next_at = write_vector(buffers, i, next_at, unit_to(car, 0.0, _WALL_HEIGHT, WALL_CENTRE_Z_LOW))
    next_at = write_vector(buffers, i, next_at, unit_to(car, 0.0, _WALL_HEIGHT, WALL_CENTRE_Z_HIGH))
    if not is_documented:
        next_at = write_vector(buffers, i, next_at, wp.vec3(0.0, 0.0, 0.0))  # ML-Agents pads what is too short
    return next_at


@wp.func
def observe(buffers: StepBuffers, i: int, motion: Motion, scene: Scene, rules: Rules, params: CarParams) -> None:
    """The newest frame."""
    at = open_frame(buffers, i)
    if rules.observation == _RANGED:
        box = box_of_car(motion.pose, params.box_ahead_m)
        at = write_goal(buffers, i, at, box, scene.goal, scene.goal_half)
        at = write_velocity(buffers, i, at, box, motion.vel)
        at = write_obstacles(buffers, i, at, box, scene)
        at = write_walls(buffers, i, at, box)
    else:
        at = observe_units(buffers, i, at, motion.pose, scene, rules.observation == _AS_DOCUMENTED)
    if rules.ray_count >= 0:
        write_rays(buffers, i, at, motion.pose, scene, rules, params)
