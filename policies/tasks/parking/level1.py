"""Parking1: three blocks, four walls, one spot. One decision is one launch; the order of things is that of `step`.

Left out of the published code: only the first contact of a rendered frame counted there, and an untagged trigger in the
middle of the pad could swallow the reward of parking. Both depend on the frame rate of the computer.
"""

from typing import Any, ClassVar

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.rng import draw_key
from policies.tasks.episode import RUNNING, SUCCESS, Border, begin_episode, close_step, open_frame
from policies.tasks.layout import Element, Layout
from policies.tasks.numbers import Sampler, typed_rows
from policies.tasks.parking.arena import (
    BLOCK_HALF_X,
    BLOCK_HALF_Z,
    BLOCK_HEIGHT,
    BLOCK_PLACES,
    LEVEL1_MARKER,
    LEVEL1_SPOTS,
    LEVEL1_START,
    SPOT_HEIGHT,
    WALL_CENTRE_X_HIGH,
    WALL_CENTRE_X_LOW,
    WALL_CENTRE_Z_HIGH,
    WALL_CENTRE_Z_LOW,
    WALL_HEIGHT,
    WALL_X_HIGH,
    WALL_X_LOW,
    WALL_Z_HIGH,
    WALL_Z_LOW,
    place_of,
    pose,
    pose_at,
)
from policies.tasks.parking.car import TICK_S, box_distance, box_of_car
from policies.tasks.parking.drive import BRANCHES, Motion, command_of, moved
from policies.tasks.parking.numbers import CAR_NUMBERS, CarNumbers, reward_defaults
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
from policies.tasks.parking.parked import capped, end_reward, outcome_of, progress_reward, way_of
from policies.tasks.parking.picture import picture_of
from policies.tasks.parking.rays import ray_elements, write_rays
from policies.tasks.parking.rewards import approach_rows, near_row
from policies.tasks.parking.scene import Scene, contact_of
from policies.tasks.parking.settings import (
    AS_CODED,
    AS_DOCUMENTED,
    PROGRESS,
    RANGED,
    Choices,
    ParkingSettings,
    Rules,
    chosen,
    rules_of,
)
from policies.tasks.parking.spots import cells, draw_block, draw_goal, draw_start
from policies.tasks.task import Task

wp.set_module_options({"enable_backward": False})

_BLOCK_COUNT = wp.constant(3)
_AS_DOCUMENTED, _AS_CODED = wp.constant(AS_DOCUMENTED), wp.constant(AS_CODED)
_RANGED, _PROGRESS = wp.constant(RANGED), wp.constant(PROGRESS)
_SPOT_HEIGHT, _BLOCK_HEIGHT, _WALL_HEIGHT = (wp.constant(h) for h in (SPOT_HEIGHT, BLOCK_HEIGHT, WALL_HEIGHT))
_SPOT_COUNT = wp.constant(len(LEVEL1_SPOTS))
_GOAL_STREAM, _START_STREAM, _YAW_STREAM, _BLOCK_STREAM = (wp.constant(stream) for stream in (1, 2, 3, 4))

PRESETS = {
    "as-documented": Choices(
        "as-documented",
        "as-documented",
        "published",
        "published",
        "published",
        "touch",
        "steer",
        "once",
        "clean",
        3,
        -1,
    ),
    "as-coded": Choices(
        "as-coded",
        "as-coded",
        "published",
        "published",
        "published",
        "touch",
        "push-or-turn",
        "once",
        "as-coded",
        3,
        -1,
    ),
    "improved": Choices(
        "ranged", "progress", "anywhere", "anywhere", "anywhere", "pose", "steer-and-shift", "once", "clean", 3, -1
    ),
}
_PRESET_NUMBERS: dict[str, dict[str, float | Sampler]] = {
    "as-documented": {"push_n": 400.0},
    "as-coded": {},
    "improved": {"goal_yaw_deg": Sampler(intervals=((-180.0, 180.0),)), "step_limit": 1000.0},
}


@wp.struct
class Level1State:
    """One row per environment."""

    pos: wp.array(dtype=wp.vec2)  # [m] of the car's origin
    vel: wp.array(dtype=wp.vec2)  # [m/s]
    yaw: wp.array(dtype=float)  # [rad]
    goal: wp.array(dtype=wp.vec4)  # pose of the pad
    blocks: wp.array2d(dtype=wp.vec4)  # poses
    best_m: wp.array(dtype=float)  # shortest distance of this episode
    last_m: wp.array(dtype=float)  # distance at the last applied action
    way_m: wp.array(dtype=float)  # what was left to go at the last decision
    numbers: wp.array(dtype=CarNumbers)


@wp.struct
class Level1Places:
    """What is the same for all environments."""

    start: wp.vec4
    start_yaw: float  # [rad]
    blocks: wp.mat44  # a pose per row
    marker: wp.vec2  # the goal before the first park, as coded
    spots: wp.array(dtype=wp.vec2)
    cells: wp.array(dtype=wp.vec2)  # of the chosen split


@wp.func
def scene_of(state: Level1State, i: int) -> Scene:
    """The arena."""
    scene = Scene()
    for k in range(_BLOCK_COUNT):
        scene.obstacles[k] = state.blocks[i, k]
    scene.obstacle_count = _BLOCK_COUNT
    scene.obstacle_half = wp.vec2(BLOCK_HALF_X, BLOCK_HALF_Z)
    scene.goal = state.goal[i]
    scene.has_goal = True
    return scene


@wp.func
def motion_of(state: Level1State, i: int) -> Motion:
    """The car."""
    motion = Motion()
    motion.pos = state.pos[i]
    motion.vel = state.vel[i]
    motion.yaw = state.yaw[i]
    motion.pose = pose_at(motion.pos, motion.yaw)
    return motion


@wp.func
def observe_units(border: Border, i: int, at: int, car: wp.vec4, scene: Scene, is_documented: bool) -> int:
    """The documents' 27 floats."""
    goal = scene.goal
    next_at = at
    if is_documented:
        next_at = write_vector(border, i, next_at, wp.normalize(gap_to(car, goal[0], _SPOT_HEIGHT, goal[1])))
    next_at = write_vector(border, i, next_at, unit_to(car, goal[0], _SPOT_HEIGHT, goal[1]))
    for k in range(_BLOCK_COUNT):
        block = scene.obstacles[k]
        next_at = write_vector(border, i, next_at, unit_to(car, block[0], _BLOCK_HEIGHT, block[1]))
    next_at = write_vector(border, i, next_at, unit_to(car, WALL_CENTRE_X_LOW, _WALL_HEIGHT, 0.0))
    next_at = write_vector(border, i, next_at, unit_to(car, WALL_CENTRE_X_HIGH, _WALL_HEIGHT, 0.0))
    next_at = write_vector(border, i, next_at, unit_to(car, 0.0, _WALL_HEIGHT, WALL_CENTRE_Z_LOW))
    next_at = write_vector(border, i, next_at, unit_to(car, 0.0, _WALL_HEIGHT, WALL_CENTRE_Z_HIGH))
    if not is_documented:
        next_at = write_vector(border, i, next_at, wp.vec3(0.0, 0.0, 0.0))  # ML-Agents pads what is too short
    return next_at


@wp.func
def observe(border: Border, i: int, motion: Motion, scene: Scene, rules: Rules, numbers: CarNumbers) -> None:
    """The newest frame."""
    at = open_frame(border, i)
    if rules.observation == _RANGED:
        box = box_of_car(motion.pose, numbers.box_ahead_m)
        at = write_goal(border, i, at, box, scene.goal, rules)
        at = write_velocity(border, i, at, box, motion.vel)
        at = write_obstacles(border, i, at, box, scene)
        at = write_walls(border, i, at, box)
    else:
        at = observe_units(border, i, at, motion.pose, scene, rules.observation == _AS_DOCUMENTED)
    if rules.ray_count >= 0:
        write_rays(border, i, at, motion.pose, scene, rules, numbers)


@wp.func
def nearness_rows(car: wp.vec4, scene: Scene, numbers: CarNumbers, is_coded: bool) -> float:
    """Rows 8 and 9: to surfaces, or as coded to centres."""
    reward = float(0.0)
    near = numbers.wall_near_m
    pay = numbers.wall_reward
    if is_coded:
        reward += near_row(wp.length(gap_to(car, WALL_CENTRE_X_LOW, _WALL_HEIGHT, 0.0)), near, pay)
        reward += near_row(wp.length(gap_to(car, WALL_CENTRE_X_HIGH, _WALL_HEIGHT, 0.0)), near, pay)
        reward += near_row(wp.length(gap_to(car, 0.0, _WALL_HEIGHT, WALL_CENTRE_Z_LOW)), near, pay)
        reward += near_row(wp.length(gap_to(car, 0.0, _WALL_HEIGHT, WALL_CENTRE_Z_HIGH)), near, pay)
    else:
        reward += near_row(car[0] - WALL_X_LOW, near, pay) + near_row(WALL_X_HIGH - car[0], near, pay)
        reward += near_row(car[1] - WALL_Z_LOW, near, pay) + near_row(WALL_Z_HIGH - car[1], near, pay)
    for k in range(_BLOCK_COUNT):
        block = scene.obstacles[k]
        distance = box_distance(block, scene.obstacle_half, place_of(car))
        if is_coded:
            distance = wp.length(gap_to(car, block[0], _BLOCK_HEIGHT, block[1]))
        reward += near_row(distance, numbers.obstacle_near_m, numbers.obstacle_reward)
    return reward


@wp.func
def table_reward(state: Level1State, i: int, car: wp.vec4, scene: Scene, rules: Rules, numbers: CarNumbers) -> float:
    """Rows 4 to 9, for one applied action."""
    is_coded = rules.reward == _AS_CODED
    distance = wp.length(gap_to(car, scene.goal[0], _SPOT_HEIGHT, scene.goal[1]))
    rows = approach_rows(distance, state.best_m[i], state.last_m[i], numbers, is_coded)
    state.best_m[i] = rows.best_m
    state.last_m[i] = rows.last_m
    return rows.reward + nearness_rows(car, scene, numbers, is_coded)


@wp.func
def way_left(motion: Motion, scene: Scene, rules: Rules, numbers: CarNumbers) -> float:
    """From the car's box to the pad [m]."""
    box = box_of_car(motion.pose, numbers.box_ahead_m)
    return way_of(box, scene.goal, wp.length(place_of(scene.goal) - place_of(box)), rules, numbers)


@wp.func
def place_blocks(border: Border, rules: Rules, places: Level1Places, state: Level1State, i: int, episode: int) -> None:
    """The blocks of an episode."""
    if rules.are_obstacles_anywhere:
        others = Scene()
        for k in range(_BLOCK_COUNT):
            others.obstacle_count = k
            others.obstacles[k] = draw_block(others, border.seed[0], i, episode, _BLOCK_STREAM + k)
        for k in range(_BLOCK_COUNT):
            state.blocks[i, k] = others.obstacles[k]
    else:
        for k in range(_BLOCK_COUNT):
            state.blocks[i, k] = places.blocks[k]


@wp.func
def place_goal(border: Border, rules: Rules, places: Level1Places, state: Level1State, i: int, episode: int) -> None:
    """A new goal."""
    scene = scene_of(state, i)
    place = wp.vec2()
    if rules.are_goals_anywhere:
        place = draw_goal(places.cells, scene, border.seed[0], i, episode, _GOAL_STREAM)
    elif rules.is_reset_coded and episode == 0:
        place = places.marker
    else:
        rng = draw_key(border.seed[0], i, episode, _GOAL_STREAM)
        place = places.spots[wp.randi(rng, 0, _SPOT_COUNT)]
    state.goal[i] = pose_at(place, wp.radians(state.numbers[i].goal_yaw_deg))


@wp.func
def place_car(border: Border, rules: Rules, places: Level1Places, state: Level1State, i: int, episode: int) -> None:
    """The start pose; the velocity is not touched."""
    if rules.are_starts_anywhere:
        range_m = state.numbers[i].start_range_m
        state.pos[i] = draw_start(scene_of(state, i), 0, range_m, border.seed[0], i, episode, _START_STREAM)
        rng = draw_key(border.seed[0], i, episode, _YAW_STREAM)
        state.yaw[i] = wp.pi * (2.0 * wp.randf(rng) - 1.0)
    else:
        state.pos[i] = place_of(places.start)
        state.yaw[i] = places.start_yaw


@wp.func
def begin_row(border: Border, rules: Rules, places: Level1Places, state: Level1State, i: int, outcome: int) -> None:
    """Begins an episode after an outcome. As coded, only a park gives a new car and a new goal."""
    episode = begin_episode(border, i)
    is_new = episode == 0 or outcome == SUCCESS or not rules.is_reset_coded
    if is_new:
        place_blocks(border, rules, places, state, i, episode)
        place_goal(border, rules, places, state, i, episode)
        state.vel[i] = wp.vec2(0.0, 0.0)
        state.last_m[i] = 0.0  # a field of a new car
    place_car(border, rules, places, state, i, episode)
    numbers = state.numbers[i]
    motion = motion_of(state, i)
    scene = scene_of(state, i)
    state.best_m[i] = numbers.best_start_m
    if rules.reward == _AS_DOCUMENTED:
        state.last_m[i] = wp.length(gap_to(motion.pose, scene.goal[0], _SPOT_HEIGHT, scene.goal[1]))
    state.way_m[i] = way_left(motion, scene, rules, numbers)
    observe(border, i, motion, scene, rules, numbers)


@wp.kernel(enable_backward=False)
def begin(
    border: Border, is_chosen: wp.array(dtype=wp.bool), rules: Rules, places: Level1Places, state: Level1State
) -> None:
    """Starts an episode in the chosen rows."""
    i = wp.tid()
    if is_chosen[i]:
        begin_row(border, rules, places, state, i, RUNNING)


@wp.kernel(enable_backward=False)
def step(border: Border, rules: Rules, places: Level1Places, state: Level1State) -> None:
    """One decision of every row."""
    i = wp.tid()
    numbers = state.numbers[i]
    scene = scene_of(state, i)
    motion = motion_of(state, i)
    command = command_of(border, i, rules)
    outcome = int(RUNNING)
    reward = float(0.0)
    for tick in range(rules.tick_count):
        if outcome == RUNNING:
            is_applied = rules.is_held or tick == 0
            if is_applied and rules.reward != _PROGRESS:
                reward += table_reward(state, i, motion.pose, scene, rules, numbers)
            motion = moved(motion, command, is_applied, numbers)
            outcome = outcome_of(contact_of(motion.pose, scene, numbers), motion, scene.goal, rules, numbers)
    outcome = capped(outcome, border.steps[i], numbers)
    reward += end_reward(outcome, numbers)
    if rules.reward == _PROGRESS:
        way_m = way_left(motion, scene, rules, numbers)
        reward += progress_reward(state.way_m[i], way_m, outcome, numbers)
        state.way_m[i] = way_m
    state.pos[i] = motion.pos
    state.vel[i] = motion.vel
    state.yaw[i] = motion.yaw
    observe(border, i, motion, scene, rules, numbers)
    if close_step(border, i, reward, outcome):
        begin_row(border, rules, places, state, i, outcome)


def _frame(choices: Choices, rules: Rules, tags: tuple[str, ...]) -> tuple[Element, ...]:
    blocks = tuple(f"block_{k + 1}" for k in range(len(BLOCK_PLACES)))
    walls = ("wall_x_low", "wall_x_high", "wall_z_low", "wall_z_high")
    rays = ray_elements(rules, tags)
    if choices.observation == "ranged":
        return (
            *goal_elements(choices.success == "pose"),
            *velocity_elements("vel_car"),
            *surface_elements(*blocks, *walls),
            *rays,
        )
    units = (*unit_elements("goal", is_goal=True), *(e for name in (*blocks, *walls) for e in unit_elements(name)))
    if choices.observation == "as-documented":
        return (*world_elements("goal", is_goal=True), *units, *rays)
    return (*units, *(Element(f"padding_{k}", "1") for k in range(3)), *rays)


class Parking1(Task):
    """The task. Layout version 1."""

    numbers: ClassVar = CAR_NUMBERS

    def __init__(self, settings: ParkingSettings, env_count: int, device: str = "cpu") -> None:
        choices = chosen(settings, PRESETS[settings.preset])
        rules = rules_of(choices, settings.ray_tags)
        tags = tuple(settings.ray_tags.split("+")) if settings.ray_tags else ()
        self.decision_s = choices.decision_period * TICK_S
        layout = Layout(
            "Parking1", 1, _frame(choices, rules, tags), branches=BRANCHES[choices.actions], stack=settings.stack or 1
        )
        defaults = {**reward_defaults(choices, 1), **_PRESET_NUMBERS[settings.preset]}
        super().__init__(layout, env_count, number_defaults=defaults, device=device)
        self.rules = rules
        self.world = self._world(env_count)
        self._record(begin, step, [rules, self._places(settings.split), self.world])

    def _world(self, env_count: int) -> Any:
        state = Level1State()
        state.pos = self._zeros("pos", env_count, wp.vec2)
        state.vel = self._zeros("vel", env_count, wp.vec2)
        state.yaw = self._zeros("yaw", env_count, float)
        state.goal = self._zeros("goal", env_count, wp.vec4)
        state.blocks = self._zeros("blocks", (env_count, len(BLOCK_PLACES)), wp.vec4)
        state.best_m = self._zeros("best_m", env_count, float)
        state.last_m = self._zeros("last_m", env_count, float)
        state.way_m = self._zeros("way_m", env_count, float)
        state.numbers = typed_rows(self.border.numbers, CarNumbers)
        return state

    def _places(self, split: str) -> Any:
        places = Level1Places()
        places.start = wp.vec4(*pose(LEVEL1_START))
        places.start_yaw = float(np.radians(LEVEL1_START[2]))
        poses = [pose(place) for place in BLOCK_PLACES]
        places.blocks = wp.mat44(*np.vstack([*poses, np.zeros(4)]).ravel())
        places.marker = wp.vec2(*LEVEL1_MARKER)
        places.spots = wp.array(np.array(LEVEL1_SPOTS, dtype=np.float32), dtype=wp.vec2, device=self.device)
        places.cells = wp.array(cells(0, 1, split), dtype=wp.vec2, device=self.device)
        return places

    def picture(self, i_env: int, height_px: int = 480) -> NDArray[np.uint8]:
        """Arena, blocks, pad, car and, where it has them, rays, from above."""
        return picture_of(self, i_env, height_px)
