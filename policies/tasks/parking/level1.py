"""Parking1: three blocks, four walls, one spot. One decision is one launch; the order of things is that of `step`.

Left out of the published code: only the first contact of a rendered frame counted there, and an untagged trigger in the
middle of the pad could swallow the reward of parking. Both depend on the frame rate of the computer.
"""

from typing import Any, ClassVar

import numpy as np
import warp as wp

from common.rng import draw_key
from policies.tasks.episode import RUNNING, SUCCESS, StepBuffers, begin_episode, close_step
from policies.tasks.layout import Layout
from policies.tasks.parking.arena import (
    BLOCK_HEIGHT,
    BLOCK_POSITIONS,
    LEVEL1_MARKER,
    LEVEL1_SPOTS,
    LEVEL1_START,
    SPOT_HEIGHT,
    pose,
    pose_at,
    position_of,
)
from policies.tasks.parking.car import TICK_S, box_of_car
from policies.tasks.parking.decision_rows import table_reward
from policies.tasks.parking.drive import BRANCHES, Motion, command_of, moved
from policies.tasks.parking.episode_end import capped, end_reward, outcome_of, progress_reward, way_of
from policies.tasks.parking.observe_documents import gap_to
from policies.tasks.parking.observe_level1 import BLOCK_COUNT, frame_of, observe
from policies.tasks.parking.parking_params import (
    CAR_PARAMS,
    LEVEL1_PARAMS,
    CarParams,
    Level1Params,
    reward_defaults,
)
from policies.tasks.parking.scene import Scene, contact_of, half_of_pad
from policies.tasks.parking.settings import (
    AS_DOCUMENTED,
    PROGRESS,
    Choices,
    Parking1Settings,
    ParkingSettings,
    Rules,
    chosen,
    rules_of,
)
from policies.tasks.parking.spots import cells, draw_block, draw_goal, draw_start
from policies.tasks.parking.world import CarState, ParkingTask, keep_motion, motion_of
from policies.tasks.task_params import Sampler, typed_rows

wp.set_module_options({"enable_backward": False})

_AS_DOCUMENTED, _PROGRESS = wp.constant(AS_DOCUMENTED), wp.constant(PROGRESS)
_SPOT_HEIGHT, _BLOCK_HEIGHT = wp.constant(SPOT_HEIGHT), wp.constant(BLOCK_HEIGHT)
_GOAL_STREAM, _START_STREAM, _YAW_STREAM, _BLOCK_STREAM = (wp.constant(stream) for stream in (1, 2, 3, 4))
_SIDE_STREAM = wp.constant(4 + len(BLOCK_POSITIONS))  # blocks have one each

PRESETS = {
    "as-documented": Choices(
        observation="as-documented",
        reward="as-documented",
        starts="published",
        goals="published",
        obstacles="published",
        success="touch",
        actions="steer",
        repeat="held",  # not stated: the default of ML-Agents' decision requester
        resets="clean",
        decision_period=3,
        rays=-1,
    ),
    "as-coded": Choices(
        observation="as-coded",
        reward="as-coded",
        starts="published",
        goals="published",
        obstacles="published",
        success="touch",
        actions="push-or-turn",
        repeat="once",
        resets="as-coded",
        decision_period=3,
        rays=-1,
    ),
    "improved": Choices(
        observation="ranged",
        reward="progress",
        starts="anywhere",
        goals="anywhere",
        obstacles="anywhere",
        success="pose",
        actions="steer-and-shift",
        repeat="once",
        resets="clean",
        decision_period=3,
        rays=-1,
    ),
}
_PRESET_PARAMS: dict[str, dict[str, float | Sampler]] = {
    "as-documented": {"push_n": 400.0},
    "as-coded": {},
    "improved": {"goal_yaw_deg": Sampler(intervals=((-180.0, 180.0),)), "step_limit": 1000.0},
}


@wp.struct
class Blocks:
    """The blocks; one row per environment."""

    poses: wp.array2d(dtype=wp.vec4)
    params: wp.array(dtype=Level1Params)


@wp.struct
class Level1Positions:
    """What is the same for all environments."""

    start: wp.vec4
    start_yaw: float  # [rad]
    blocks: wp.mat44  # a pose per row
    marker: wp.vec2  # the goal before the first park, as coded
    spots: wp.array(dtype=wp.vec2)
    cells: wp.array(dtype=wp.vec2)  # of the chosen split


@wp.func
def scene_of(cars: CarState, blocks: Blocks, i: int) -> Scene:
    """The arena."""
    params = blocks.params[i]
    scene = Scene()
    for k in range(BLOCK_COUNT):
        scene.obstacles[k] = blocks.poses[i, k]
    scene.obstacle_count = BLOCK_COUNT
    scene.obstacle_half = wp.vec2(0.5 * params.block_width_m, 0.5 * params.block_length_m)
    scene.goal = cars.goal[i]
    scene.goal_half = half_of_pad(cars.params[i])
    scene.has_goal = True
    return scene


@wp.func
def side_of(rules: Rules, seed: int, i: int, episode: int) -> float:
    """What the published x are multiplied by: -1 where they are mirrored."""
    if not rules.is_mirrored:
        return 1.0
    rng = draw_key(seed, i, wp.where(rules.is_reset_coded, 0, episode), _SIDE_STREAM)
    return wp.where(wp.randf(rng) < 0.5, -1.0, 1.0)


@wp.func
def way_left(motion: Motion, scene: Scene, rules: Rules, params: CarParams) -> float:
    """From the car's box to the pad [m]."""
    box = box_of_car(motion.pose, params.box_ahead_m)
    return way_of(box, scene.goal, wp.length(position_of(scene.goal) - position_of(box)), rules, params)


@wp.func
def place_blocks(
    buffers: StepBuffers,
    rules: Rules,
    positions: Level1Positions,
    blocks: Blocks,
    i: int,
    episode: int,
) -> None:
    """The blocks of an episode."""
    if rules.are_obstacles_anywhere:
        others = Scene()
        for k in range(BLOCK_COUNT):
            others.obstacle_count = k
            others.obstacles[k] = draw_block(others, buffers.seed[i], i, episode, _BLOCK_STREAM + k)
        for k in range(BLOCK_COUNT):
            blocks.poses[i, k] = others.obstacles[k]
    else:
        side = side_of(rules, buffers.seed[i], i, episode)
        for k in range(BLOCK_COUNT):
            block = positions.blocks[k]
            blocks.poses[i, k] = wp.vec4(side * block[0], block[1], side * block[2], block[3])


@wp.func
def place_goal(
    buffers: StepBuffers,
    rules: Rules,
    positions: Level1Positions,
    cars: CarState,
    blocks: Blocks,
    i: int,
    episode: int,
) -> None:
    """A new goal."""
    scene = scene_of(cars, blocks, i)
    side = side_of(rules, buffers.seed[i], i, episode)
    position = wp.vec2()
    if rules.are_goals_anywhere:
        position = draw_goal(positions.cells, scene, buffers.seed[i], i, episode, _GOAL_STREAM)
    elif rules.is_reset_coded and episode == 0:
        position = positions.marker
    else:
        rng = draw_key(buffers.seed[i], i, episode, _GOAL_STREAM)
        spot = positions.spots[wp.randi(rng, 0, positions.spots.shape[0])]
        position = wp.vec2(side * spot[0], spot[1])
    cars.goal[i] = pose_at(position, side * wp.radians(cars.params[i].goal_yaw_deg))


@wp.func
def place_car(
    buffers: StepBuffers,
    rules: Rules,
    positions: Level1Positions,
    cars: CarState,
    blocks: Blocks,
    i: int,
    episode: int,
) -> None:
    """The start pose; the velocity is not touched."""
    if rules.are_starts_anywhere:
        range_m = cars.params[i].start_range_m
        cars.pos[i] = draw_start(scene_of(cars, blocks, i), 0, range_m, buffers.seed[i], i, episode, _START_STREAM)
        rng = draw_key(buffers.seed[i], i, episode, _YAW_STREAM)
        cars.yaw[i] = wp.pi * (2.0 * wp.randf(rng) - 1.0)
    else:
        side = side_of(rules, buffers.seed[i], i, episode)
        cars.pos[i] = wp.vec2(side * positions.start[0], positions.start[1])
        cars.yaw[i] = side * positions.start_yaw


@wp.func
def begin_row(
    buffers: StepBuffers,
    rules: Rules,
    positions: Level1Positions,
    cars: CarState,
    blocks: Blocks,
    i: int,
    outcome: int,
) -> None:
    """Begins an episode after an outcome. As coded, only a park gives a new car and a new goal."""
    episode = begin_episode(buffers, i)
    is_new = episode == 0 or outcome == SUCCESS or not rules.is_reset_coded
    if is_new:
        place_blocks(buffers, rules, positions, blocks, i, episode)
        place_goal(buffers, rules, positions, cars, blocks, i, episode)
        cars.vel[i] = wp.vec2(0.0, 0.0)
        cars.last_m[i] = 0.0  # a field of a new car
    place_car(buffers, rules, positions, cars, blocks, i, episode)
    params = cars.params[i]
    motion = motion_of(cars, i)
    scene = scene_of(cars, blocks, i)
    cars.best_m[i] = params.best_start_m
    if rules.reward == _AS_DOCUMENTED:
        cars.last_m[i] = wp.length(gap_to(motion.pose, scene.goal[0], _SPOT_HEIGHT, scene.goal[1]))
    cars.way_m[i] = way_left(motion, scene, rules, params)
    observe(buffers, i, motion, scene, rules, params)


@wp.kernel(enable_backward=False)
def begin(
    buffers: StepBuffers,
    is_chosen: wp.array(dtype=wp.bool),
    rules: Rules,
    positions: Level1Positions,
    cars: CarState,
    blocks: Blocks,
) -> None:
    """Starts an episode in the chosen rows."""
    i = wp.tid()
    if is_chosen[i]:
        begin_row(buffers, rules, positions, cars, blocks, i, RUNNING)


@wp.kernel(enable_backward=False)
def step(buffers: StepBuffers, rules: Rules, positions: Level1Positions, cars: CarState, blocks: Blocks) -> None:
    """One decision of every row."""
    i = wp.tid()
    params = cars.params[i]
    scene = scene_of(cars, blocks, i)
    motion = motion_of(cars, i)
    command = command_of(buffers, i, rules)
    outcome = int(RUNNING)
    reward = float(0.0)
    for tick in range(rules.tick_count):
        if outcome == RUNNING:
            is_applied = rules.is_held or tick == 0
            if is_applied and rules.reward != _PROGRESS:
                reward += table_reward(cars, i, motion.pose, scene, _SPOT_HEIGHT, _BLOCK_HEIGHT, rules, params)
            motion = moved(motion, command, is_applied, params)
            outcome = outcome_of(contact_of(motion.pose, scene, params), motion, scene.goal, rules, params)
    outcome = capped(outcome, buffers.steps[i], params)
    reward += end_reward(outcome, params)
    if rules.reward == _PROGRESS:
        way_m = way_left(motion, scene, rules, params)
        reward += progress_reward(cars.way_m[i], way_m, outcome, params)
        cars.way_m[i] = way_m
    keep_motion(cars, i, motion)
    observe(buffers, i, motion, scene, rules, params)
    if close_step(buffers, i, reward, outcome):
        begin_row(buffers, rules, positions, cars, blocks, i, outcome)


class Parking1(ParkingTask):
    """The task. Layout version 1."""

    params: ClassVar = (*CAR_PARAMS, *LEVEL1_PARAMS)
    settings_class: ClassVar = Parking1Settings

    def __init__(self, settings: Parking1Settings, env_count: int, device: str = "cpu") -> None:
        choices = chosen(settings, PRESETS[settings.preset])
        rules = rules_of(choices, settings.ray_tags)
        rules.is_mirrored = settings.mirrored
        tags = tuple(settings.ray_tags.split("+")) if settings.ray_tags else ()
        self.decision_s = choices.decision_period * TICK_S
        layout = Layout(
            "Parking1", 1, frame_of(choices, rules, tags), branches=BRANCHES[choices.actions], stack=settings.stack or 1
        )
        defaults = {**reward_defaults(choices, 1), **_PRESET_PARAMS[settings.preset]}
        super().__init__(layout, env_count, number_defaults=defaults, device=device)
        self.rules = rules
        self.world = self._car_state()
        self.blocks = self._zeros("blocks", (env_count, len(BLOCK_POSITIONS)), wp.vec4)
        blocks = Blocks()
        blocks.poses = self.blocks
        blocks.params = typed_rows(self.buffers.params, Level1Params, first=len(CAR_PARAMS))
        self._record(begin, step, [rules, self._positions(settings), self.world, blocks])

    def _positions(self, settings: ParkingSettings) -> Any:
        positions = Level1Positions()
        positions.start = wp.vec4(*pose(LEVEL1_START))
        positions.start_yaw = float(np.radians(LEVEL1_START[2]))
        poses = [pose(position) for position in BLOCK_POSITIONS]
        positions.blocks = wp.mat44(*np.vstack([*poses, np.zeros(4)]).ravel())
        positions.marker = wp.vec2(*LEVEL1_MARKER)
        spots = LEVEL1_SPOTS[1:2] if settings.goals == "one" else LEVEL1_SPOTS  # where the scene's marker stands
        positions.spots = wp.array(np.array(spots, dtype=np.float32), dtype=wp.vec2, device=self.device)
        positions.cells = wp.array(cells(0, 1, settings.split, settings.quarter), dtype=wp.vec2, device=self.device)
        return positions
