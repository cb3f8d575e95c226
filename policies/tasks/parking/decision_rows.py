"""Rows 4 to 9 of the documents' table for one applied action, of either level."""

import warp as wp

from policies.tasks.parking.arena import (
    WALL_CENTRE_X_HIGH,
    WALL_CENTRE_X_LOW,
    WALL_CENTRE_Z_HIGH,
    WALL_CENTRE_Z_LOW,
    WALL_HEIGHT,
    WALL_X_HIGH,
    WALL_X_LOW,
    WALL_Z_HIGH,
    WALL_Z_LOW,
    position_of,
    storey_centre,
    storey_of,
)
from policies.tasks.parking.car import box_distance
from policies.tasks.parking.observe_documents import gap_to
from policies.tasks.parking.parking_params import CarParams
from policies.tasks.parking.rewards import approach_rows, near_row
from policies.tasks.parking.scene import MAX_OBSTACLES, Scene
from policies.tasks.parking.settings import AS_CODED, Rules
from policies.tasks.parking.world import CarState

wp.set_module_options({"enable_backward": False})

_AS_CODED = wp.constant(AS_CODED)
_WALL_HEIGHT = wp.constant(WALL_HEIGHT)


@wp.func
def wall_rows(car: wp.vec4, params: CarParams, is_coded: bool) -> float:
    """Row 8 of the storey's four walls: to their surfaces, or as coded to their centres."""
    centre = storey_centre(storey_of(car[0]))
    near = params.wall_near_m
    pay = params.wall_reward
    x = car[0] - centre[0]
    z = car[1] - centre[1]
    if is_coded:
        local = wp.vec4(x, z, 0.0, 1.0)
        return (
            near_row(wp.length(gap_to(local, WALL_CENTRE_X_LOW, _WALL_HEIGHT, 0.0)), near, pay)
            + near_row(wp.length(gap_to(local, WALL_CENTRE_X_HIGH, _WALL_HEIGHT, 0.0)), near, pay)
            + near_row(wp.length(gap_to(local, 0.0, _WALL_HEIGHT, WALL_CENTRE_Z_LOW)), near, pay)
            + near_row(wp.length(gap_to(local, 0.0, _WALL_HEIGHT, WALL_CENTRE_Z_HIGH)), near, pay)
        )
    across = near_row(x - WALL_X_LOW, near, pay) + near_row(WALL_X_HIGH - x, near, pay)
    return across + near_row(z - WALL_Z_LOW, near, pay) + near_row(WALL_Z_HIGH - z, near, pay)


@wp.func
def obstacle_rows(car: wp.vec4, scene: Scene, height_m: float, params: CarParams, is_coded: bool) -> float:
    """Row 9 of the storey's obstacles: to their surfaces, or as coded to their centres, which lie at a height."""
    reward = float(0.0)
    for k in range(MAX_OBSTACLES):
        if k < scene.obstacle_count:
            obstacle = scene.obstacles[k]
            distance = box_distance(obstacle, scene.obstacle_half, position_of(car)) - scene.obstacle_radius
            if is_coded:
                distance = wp.length(gap_to(car, obstacle[0], height_m, obstacle[1]))
            reward += near_row(distance, params.obstacle_near_m, params.obstacle_reward)
    return reward


@wp.func
def table_reward(
    cars: CarState,
    i: int,
    car: wp.vec4,
    scene: Scene,
    goal_height_m: float,
    obstacle_height_m: float,
    rules: Rules,
    params: CarParams,
) -> float:
    """Rows 4 to 9. The distance to the goal is straight, also where it is on the other storey."""
    is_coded = rules.reward == _AS_CODED
    distance = wp.length(gap_to(car, scene.goal[0], goal_height_m, scene.goal[1]))
    rows = approach_rows(distance, cars.best_m[i], cars.last_m[i], params, is_coded)
    cars.best_m[i] = rows.best_m
    cars.last_m[i] = rows.last_m
    near_obstacles = obstacle_rows(car, scene, obstacle_height_m, params, is_coded)
    return rows.reward + wall_rows(car, params, is_coded) + near_obstacles
