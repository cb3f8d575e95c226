"""Where a goal or a start may be: cells of 1 m, split once and for all into three sets, and draws inside them.

Whether a cell belongs to the test set is decided by a fixed seed alone, so the sets are the same in every run, on a
storey of both levels: 20 % of the free cells never hold the centre of a goal in training. Of the others, 10 % are for
validation: by them one of several trained policies is chosen. Disjoint are the centres, not the pads: a pad reaches
into the cells around its own, and the nearest training goal may be a step across an edge away. A whole quarter of each
storey as the test set is farther away.
A place is drawn in a cell of the set and rejected as long as obstacles are in the way; with the sizes of these arenas
64 draws fail with a chance below 1e-9.
"""

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.rng import draw_key
from policies.tasks.parking.arena import (
    INNER_FACES,
    LEVEL1_START,
    LEVEL2_START,
    PORTAL_EXITS,
    PORTAL_POSITIONS,
    STOREY_X,
    STOREY_Z,
    WALL_X_HIGH,
    WALL_X_LOW,
    WALL_Z_HIGH,
    WALL_Z_LOW,
    position_of,
    storey_centre,
)
from policies.tasks.parking.car import box_distance
from policies.tasks.parking.scene import MAX_OBSTACLES, Scene, portal_half

wp.set_module_options({"enable_backward": False})

SPLIT_SEED = 527  # of the train and test sets; never to be changed
TEST_FRACTION = 0.2
VALIDATION_FRACTION = 0.1  # of what is not for tests
_PAD_REACH = float(np.hypot(2.5, 1.0) / 2)  # [m] 1.35, from the published pad's centre to its corners
_WALL_MARGIN = _PAD_REACH + 0.15  # [m] from a goal's centre to a wall
_START_MARGIN = 3.5  # [m] from a goal to the published start
_PORTAL_MARGIN = 3.5  # [m] from a goal to the middle of a portal or to where it leads

_GOAL_CLEARANCE = wp.constant(_PAD_REACH + 0.3)  # [m] from a goal's centre to an obstacle's surface
_START_CLEARANCE = wp.constant(1.8)  # [m] the same of a start: the car's box reaches 1.3 from its origin
_START_GOAL = wp.constant(3.2)  # [m] from a start to the goal
_PORTAL_CLEARANCE = wp.constant(2.0)  # [m] from a start to a portal's plate
_TRIES = wp.constant(64)
_BLOCK_RANGE = wp.constant(11.0)  # [m] how far out blocks stand, per axis: cars pass behind them, and at the start
_BLOCK_GAP = wp.constant(6.0)  # [m] between the middles of blocks: a car passes between any two


def cells(storey: int, level: int, split: str, quarter: int = 0) -> NDArray[np.float32]:
    """The lower corners of the cells of a split, shape (cells, 2), x and z [m].

    Args:
        storey: 0 or 1.
        level: 1 or 2: their published starts differ, and level 2 has portals.
        split: `train`, `validation` or `test`.
        quarter: of the storey, which is the test set; 0: cells all over it are.
    """
    x = np.arange(np.ceil(INNER_FACES[0] + _WALL_MARGIN), np.floor(INNER_FACES[1] - _WALL_MARGIN))
    z = np.arange(np.ceil(INNER_FACES[2] + _WALL_MARGIN), np.floor(INNER_FACES[3] - _WALL_MARGIN))
    corners = np.stack(np.meshgrid(x, z, indexing="ij"), axis=-1).reshape(-1, 2)
    if quarter:
        is_test = (corners[:, 0] >= 0.0) + 2 * (corners[:, 1] >= 0.0) == quarter - 1
    else:
        is_test = np.random.default_rng((SPLIT_SEED, storey)).random(len(corners)) < TEST_FRACTION
    is_validation = np.random.default_rng((SPLIT_SEED, storey, 1)).random(len(corners)) < VALIDATION_FRACTION
    is_validation &= ~is_test
    is_chosen = {"train": ~is_test & ~is_validation, "validation": is_validation, "test": is_test}[split]
    corners = corners + np.array((STOREY_X[storey], STOREY_Z[storey]))
    for position, margin in _kept_free(level):
        is_chosen &= np.hypot(*(corners + 0.5 - np.array(position)).T) > margin + np.sqrt(0.5)
    return np.asarray(corners[is_chosen], dtype=np.float32)


def _kept_free(level: int) -> list[tuple[tuple[float, float], float]]:
    if level == 1:
        return [(LEVEL1_START[:2], _START_MARGIN)]
    portals = [(position[0], position[1]) for position in (*PORTAL_POSITIONS, *PORTAL_EXITS)]
    return [(LEVEL2_START[:2], _START_MARGIN), *((position, _PORTAL_MARGIN) for position in portals)]


@wp.func
def clearance(scene: Scene, point: wp.vec2) -> float:
    """From a point to the nearest obstacle's surface [m]."""
    nearest = float(1.0e9)
    for k in range(MAX_OBSTACLES):
        if k < scene.obstacle_count:
            nearest = wp.min(nearest, box_distance(scene.obstacles[k], scene.obstacle_half, point))
    return nearest - scene.obstacle_radius


@wp.func
def draw_goal(free: wp.array(dtype=wp.vec2), scene: Scene, seed: int, i_env: int, episode: int, stream: int) -> wp.vec2:
    """A place in the cells, clear of obstacles [m]."""
    rng = draw_key(seed, i_env, episode, stream)
    goal = wp.vec2()
    is_found = int(0)
    for _try in range(_TRIES):
        if is_found == 0:
            goal = free[wp.randi(rng, 0, free.shape[0])] + wp.vec2(wp.randf(rng), wp.randf(rng))
            if clearance(scene, goal) > _GOAL_CLEARANCE:
                is_found = 1
    return goal


@wp.func
def draw_start(scene: Scene, storey: int, range_m: float, seed: int, i_env: int, episode: int, stream: int) -> wp.vec2:
    """A place on a storey, clear of walls, obstacles, portal and goal, within a range of the goal per axis [m]."""
    rng = draw_key(seed, i_env, episode, stream)
    centre = storey_centre(storey)
    goal = position_of(scene.goal)
    low_x = centre[0] + WALL_X_LOW + _START_CLEARANCE
    high_x = centre[0] + WALL_X_HIGH - _START_CLEARANCE
    low_z = centre[1] + WALL_Z_LOW + _START_CLEARANCE
    high_z = centre[1] + WALL_Z_HIGH - _START_CLEARANCE
    if scene.has_goal:
        low_x = wp.max(low_x, goal[0] - range_m)
        high_x = wp.min(high_x, goal[0] + range_m)
        low_z = wp.max(low_z, goal[1] - range_m)
        high_z = wp.min(high_z, goal[1] + range_m)
    start = wp.vec2()
    is_found = int(0)
    for _try in range(_TRIES):
        if is_found == 0:
            start = wp.vec2(wp.lerp(low_x, high_x, wp.randf(rng)), wp.lerp(low_z, high_z, wp.randf(rng)))
            is_free = clearance(scene, start) > _START_CLEARANCE
            if scene.has_goal and wp.length(start - goal) < _START_GOAL:
                is_free = False
            if scene.has_portal and box_distance(scene.portal, portal_half(), start) < _PORTAL_CLEARANCE:
                is_free = False
            if is_free:
                is_found = 1
    return start


@wp.func
def draw_block(others: Scene, seed: int, i_env: int, episode: int, stream: int) -> wp.vec4:
    """A pose for a block, far enough from the blocks that stand already."""
    rng = draw_key(seed, i_env, episode, stream)
    position = wp.vec2()
    is_found = int(0)
    for _try in range(_TRIES):
        if is_found == 0:
            position = wp.vec2(_BLOCK_RANGE * (2.0 * wp.randf(rng) - 1.0), _BLOCK_RANGE * (2.0 * wp.randf(rng) - 1.0))
            is_found = 1
            for k in range(MAX_OBSTACLES):
                if k < others.obstacle_count and wp.length(position_of(others.obstacles[k]) - position) < _BLOCK_GAP:
                    is_found = 0
    yaw_rad = wp.pi * (2.0 * wp.randf(rng) - 1.0)
    return wp.vec4(position[0], position[1], wp.sin(yaw_rad), wp.cos(yaw_rad))
