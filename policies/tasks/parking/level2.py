"""Parking2: two storeys, four capsules that run to and fro, two portals, one spot. One decision is one launch.

Portals put the car at their exit with a yaw; its velocity stays as it is in the world (the code sets the place alone).
Storeys are taken as far apart as they are: what is on one is neither touched nor seen by rays from the other.
"""

from typing import Any, ClassVar

import numpy as np
import warp as wp

from common.rng import draw_key
from policies.tasks.episode import RUNNING, SUCCESS, StepBuffers, begin_episode, close_step
from policies.tasks.layout import Layout
from policies.tasks.parking.arena import (
    LEVEL2_SPOT,
    LEVEL2_SPOTS_BELOW,
    LEVEL2_START,
    MOVER_HEIGHT,
    MOVER_MOVES,
    MOVER_POSITIONS,
    PORTAL_EXITS,
    PORTAL_POSITIONS,
    pose,
    pose_at,
    position_of,
    storey_of,
)
from policies.tasks.parking.car import TICK_S, box_of_car
from policies.tasks.parking.decision_rows import table_reward
from policies.tasks.parking.drive import BRANCHES, Motion, command_of, moved
from policies.tasks.parking.episode_end import capped, end_reward, outcome_of, progress_reward, way_of
from policies.tasks.parking.movers import PER_STOREY, draw_mover, half_line, run_movers
from policies.tasks.parking.observe_documents import gap_to
from policies.tasks.parking.observe_level2 import GOAL_HEIGHT, STACKS, frame_of, observe
from policies.tasks.parking.parking_params import (
    CAR_PARAMS,
    LEVEL2_PARAMS,
    CarParams,
    Level2Params,
    reward_defaults,
)
from policies.tasks.parking.scene import PORTAL, Scene, contact_of, half_of_pad
from policies.tasks.parking.settings import AS_DOCUMENTED, PROGRESS, Choices, Parking2Settings, Rules, chosen, rules_of
from policies.tasks.parking.spots import cells, draw_goal, draw_start
from policies.tasks.parking.world import CarState, ParkingTask, keep_motion, motion_of
from policies.tasks.task_params import Sampler, typed_rows

wp.set_module_options({"enable_backward": False})

_MOVER_COUNT = wp.constant(len(MOVER_POSITIONS))
_AS_DOCUMENTED, _PROGRESS = wp.constant(AS_DOCUMENTED), wp.constant(PROGRESS)
_MOVER_HEIGHT = wp.constant(MOVER_HEIGHT)
_GOAL_STREAM, _START_STREAM, _YAW_STREAM = wp.constant(1), wp.constant(2), wp.constant(3)
_STOREY_STREAM, _START_STOREY_STREAM, _MOVER_STREAM = wp.constant(4), wp.constant(5), wp.constant(6)

PRESETS = {
    "as-documented": Choices(
        observation="as-documented",
        reward="as-documented-gail",
        starts="published",
        goals="published",
        obstacles="published",
        success="touch",
        actions="steer-and-drive",
        repeat="held",
        resets="clean",
        decision_period=1,
        rays=14,
    ),
    "as-coded": Choices(
        observation="as-coded",
        reward="as-coded",
        starts="published",
        goals="published",
        obstacles="published",
        success="touch",
        actions="steer-and-drive",
        repeat="once",
        resets="as-coded",
        decision_period=1,
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
    "as-documented": {"goal_yaw_deg": 6.1},
    "as-coded": {"goal_yaw_deg": 6.1, "step_limit": 50000.0},
    "improved": {"goal_yaw_deg": Sampler(intervals=((-180.0, 180.0),)), "step_limit": 2000.0},
}
_STOREY_2_FRACTIONS = {"1": 0.0, "2": 1.0, "both": 0.5}


@wp.struct
class Movers:
    """The capsules; one row per environment."""

    poses: wp.array2d(dtype=wp.vec4)  # first storey 1's, then storey 2's
    touching: wp.array2d(dtype=int)  # whether a storey's two touch
    params: wp.array(dtype=Level2Params)


@wp.struct
class Level2Positions:
    """What is the same for all environments."""

    start: wp.vec4
    start_yaw: float  # [rad]
    movers: wp.mat44  # a pose per row
    portals: wp.mat44  # a pose per row
    exits: wp.mat33  # x, z [m], yaw [rad] of the way out of who went into the portal of the row
    spots_1: wp.array(dtype=wp.vec2)  # published goals by storey
    spots_2: wp.array(dtype=wp.vec2)
    cells_1: wp.array(dtype=wp.vec2)  # of the chosen split, by storey
    cells_2: wp.array(dtype=wp.vec2)


@wp.func
def scene_of(cars: CarState, movers: Movers, positions: Level2Positions, i: int, storey: int) -> Scene:
    """What is on a storey."""
    params = movers.params[i]
    scene = Scene()
    for k in range(PER_STOREY):
        scene.obstacles[k] = movers.poses[i, PER_STOREY * storey + k]
    scene.obstacle_count = PER_STOREY
    scene.obstacle_half = wp.vec2(0.0, half_line(params))
    scene.obstacle_radius = params.mover_radius_m
    scene.goal = cars.goal[i]
    scene.goal_half = half_of_pad(cars.params[i])
    scene.has_goal = storey_of(scene.goal[0]) == storey
    scene.portal = positions.portals[storey]
    scene.has_portal = True
    return scene


@wp.func
def route_left(motion: Motion, goal: wp.vec4, positions: Level2Positions, rules: Rules, params: CarParams) -> float:
    """From the car's box to the pad, through the portal where it is on the other storey [m]."""
    box = box_of_car(motion.pose, params.box_ahead_m)
    storey = storey_of(motion.pos[0])
    if storey_of(goal[0]) == storey:
        return way_of(box, goal, wp.length(position_of(goal) - position_of(box)), rules, params)
    to_portal = wp.length(position_of(positions.portals[storey]) - position_of(box))
    way_out = wp.vec2(positions.exits[storey, 0], positions.exits[storey, 1])
    return to_portal + wp.length(position_of(goal) - way_out)


@wp.func
def through_portal(motion: Motion, positions: Level2Positions) -> Motion:
    """The car at the exit of its storey's portal."""
    storey = storey_of(motion.pos[0])
    out = motion
    out.pos = wp.vec2(positions.exits[storey, 0], positions.exits[storey, 1])
    out.yaw = positions.exits[storey, 2]
    out.pose = pose_at(out.pos, out.yaw)
    return out


@wp.func
def portal_row(storey_before: int, goal: wp.vec4, more: Level2Params) -> float:
    """Rows 10 and 11."""
    return wp.where(storey_before != storey_of(goal[0]), more.portal_reward, more.wrong_portal_reward)


@wp.func
def place_movers(
    buffers: StepBuffers, rules: Rules, positions: Level2Positions, movers: Movers, i: int, episode: int
) -> None:
    """The capsules of a new world: on storey 1 the first along z, as published; anywhere, one along each axis."""
    for k in range(_MOVER_COUNT):
        mover = positions.movers[k]
        if rules.are_obstacles_anywhere:
            mover = draw_mover(k // PER_STOREY, k % 2 == 1, buffers.seed[i], i, episode, _MOVER_STREAM + k)
        movers.poses[i, k] = mover
    for storey in range(2):
        movers.touching[i, storey] = 0


@wp.func
def place_goal(
    buffers: StepBuffers, rules: Rules, positions: Level2Positions, cars: CarState, movers: Movers, i: int, episode: int
) -> None:
    """A new goal, on storey 2 with its chance."""
    seed = buffers.seed[i]
    fraction = movers.params[i].storey_2_share
    storey = wp.where(wp.randf(draw_key(seed, i, episode, _STOREY_STREAM)) < fraction, 1, 0)
    position = wp.vec2()
    if rules.are_goals_anywhere:
        nothing = Scene()  # movers come and go
        if storey == 1:
            position = draw_goal(positions.cells_2, nothing, seed, i, episode, _GOAL_STREAM)
        else:
            position = draw_goal(positions.cells_1, nothing, seed, i, episode, _GOAL_STREAM)
    else:
        rng = draw_key(seed, i, episode, _GOAL_STREAM)
        if storey == 1:
            position = positions.spots_2[wp.randi(rng, 0, positions.spots_2.shape[0])]
        else:
            position = positions.spots_1[wp.randi(rng, 0, positions.spots_1.shape[0])]
    cars.goal[i] = pose_at(position, wp.radians(cars.params[i].goal_yaw_deg))


@wp.func
def place_car(
    buffers: StepBuffers, rules: Rules, positions: Level2Positions, cars: CarState, movers: Movers, i: int, episode: int
) -> None:
    """The start pose; the velocity is not touched."""
    if rules.are_starts_anywhere:
        seed = buffers.seed[i]
        storey = storey_of(cars.goal[i][0])
        if wp.randf(draw_key(seed, i, episode, _START_STOREY_STREAM)) < movers.params[i].start_elsewhere_share:
            storey = 1 - storey
        scene = scene_of(cars, movers, positions, i, storey)
        cars.pos[i] = draw_start(scene, storey, cars.params[i].start_range_m, seed, i, episode, _START_STREAM)
        cars.yaw[i] = wp.pi * (2.0 * wp.randf(draw_key(seed, i, episode, _YAW_STREAM)) - 1.0)
    else:
        cars.pos[i] = position_of(positions.start)
        cars.yaw[i] = positions.start_yaw


@wp.func
def begin_row(
    buffers: StepBuffers, rules: Rules, positions: Level2Positions, cars: CarState, movers: Movers, i: int, outcome: int
) -> None:
    """Begins an episode after an outcome. The capsules run on unless they are to be anywhere."""
    episode = begin_episode(buffers, i)
    if episode == 0 or rules.are_obstacles_anywhere:
        place_movers(buffers, rules, positions, movers, i, episode)
    if episode == 0 or outcome == SUCCESS or not rules.is_reset_coded:
        place_goal(buffers, rules, positions, cars, movers, i, episode)
        cars.vel[i] = wp.vec2(0.0, 0.0)
        cars.last_m[i] = 0.0  # a field of a new car
    place_car(buffers, rules, positions, cars, movers, i, episode)
    params = cars.params[i]
    motion = motion_of(cars, i)
    scene = scene_of(cars, movers, positions, i, storey_of(motion.pos[0]))
    cars.best_m[i] = params.best_start_m
    if rules.reward == _AS_DOCUMENTED:
        cars.last_m[i] = wp.length(gap_to(motion.pose, scene.goal[0], GOAL_HEIGHT, scene.goal[1]))
    cars.way_m[i] = route_left(motion, scene.goal, positions, rules, params)
    observe(buffers, i, motion, movers.poses, scene, rules, params, movers.params[i])


@wp.kernel(enable_backward=False)
def begin(
    buffers: StepBuffers,
    is_chosen: wp.array(dtype=wp.bool),
    rules: Rules,
    positions: Level2Positions,
    cars: CarState,
    movers: Movers,
) -> None:
    """Starts an episode in the chosen rows."""
    i = wp.tid()
    if is_chosen[i]:
        begin_row(buffers, rules, positions, cars, movers, i, RUNNING)


@wp.kernel(enable_backward=False)
def step(buffers: StepBuffers, rules: Rules, positions: Level2Positions, cars: CarState, movers: Movers) -> None:
    """One decision of every row."""
    i = wp.tid()
    params = cars.params[i]
    more = movers.params[i]
    goal = cars.goal[i]
    motion = motion_of(cars, i)
    command = command_of(buffers, i, rules)
    outcome = int(RUNNING)
    reward = float(0.0)
    for tick in range(rules.tick_count):
        if outcome == RUNNING:
            is_applied = rules.is_held or tick == 0
            storey = storey_of(motion.pos[0])
            if is_applied and rules.reward != _PROGRESS:
                scene = scene_of(cars, movers, positions, i, storey)
                reward += table_reward(cars, i, motion.pose, scene, GOAL_HEIGHT, _MOVER_HEIGHT, rules, params)
            run_movers(movers.poses, movers.touching, i, more)
            motion = moved(motion, command, is_applied, params)
            contact = contact_of(motion.pose, scene_of(cars, movers, positions, i, storey), params)
            if contact == PORTAL:
                reward += portal_row(storey, goal, more)
                motion = through_portal(motion, positions)
            outcome = outcome_of(contact, motion, goal, rules, params)
    outcome = capped(outcome, buffers.steps[i], params)
    reward += end_reward(outcome, params)
    if rules.reward == _PROGRESS:
        way_m = route_left(motion, goal, positions, rules, params)
        reward += progress_reward(cars.way_m[i], way_m, outcome, params)
        cars.way_m[i] = way_m
    keep_motion(cars, i, motion)
    scene = scene_of(cars, movers, positions, i, storey_of(motion.pos[0]))
    observe(buffers, i, motion, movers.poses, scene, rules, params, more)
    if close_step(buffers, i, reward, outcome):
        begin_row(buffers, rules, positions, cars, movers, i, outcome)


class Parking2(ParkingTask):
    """The task. Layout version 1."""

    params: ClassVar = (*CAR_PARAMS, *LEVEL2_PARAMS)
    settings_class: ClassVar = Parking2Settings

    def __init__(self, settings: Parking2Settings, env_count: int, device: str = "cpu") -> None:
        choices = chosen(settings, PRESETS[settings.preset])
        rules = rules_of(choices, settings.ray_tags)
        tags = tuple(settings.ray_tags.split("+")) if settings.ray_tags else ()
        self.decision_s = choices.decision_period * TICK_S
        layout = Layout(
            "Parking2",
            1,
            frame_of(choices, rules, tags),
            branches=BRANCHES[choices.actions],
            stack=settings.stack or STACKS[settings.preset],
        )
        storey = settings.storey or ("both" if choices.goals == "anywhere" else "2")
        defaults = {
            **reward_defaults(choices, 2),
            **_PRESET_PARAMS[settings.preset],
            "storey_2_share": _STOREY_2_FRACTIONS[storey],
        }
        super().__init__(layout, env_count, number_defaults=defaults, device=device)
        self.rules = rules
        self.world = self._car_state()
        self.movers = self._zeros("movers", (env_count, len(MOVER_POSITIONS)), wp.vec4)
        movers = Movers()
        movers.poses = self.movers
        movers.touching = self._zeros("touching", (env_count, 2), int)
        movers.params = typed_rows(self.buffers.params, Level2Params, first=len(CAR_PARAMS))
        self._record(begin, step, [rules, self._positions(settings), self.world, movers])

    def _positions(self, settings: Parking2Settings) -> Any:
        def points(of: Any) -> Any:
            return wp.array(np.array(of, dtype=np.float32), dtype=wp.vec2, device=self.device)

        positions = Level2Positions()
        positions.start = wp.vec4(*pose(LEVEL2_START))
        positions.start_yaw = float(np.radians(LEVEL2_START[2]))
        movers = [(*position, *move) for position, move in zip(MOVER_POSITIONS, MOVER_MOVES, strict=True)]
        positions.movers = wp.mat44(*np.ravel(movers))
        positions.portals = wp.mat44(
            *np.vstack([*(pose(position) for position in PORTAL_POSITIONS), np.zeros((2, 4))]).ravel()
        )
        exits = [(x, z, np.radians(yaw_deg)) for x, z, yaw_deg in PORTAL_EXITS]
        positions.exits = wp.mat33(*np.ravel([*exits, (0.0, 0.0, 0.0)]))
        below = LEVEL2_SPOTS_BELOW[:1] if settings.goals == "one" else LEVEL2_SPOTS_BELOW
        positions.spots_1, positions.spots_2 = points(below), points([LEVEL2_SPOT])
        positions.cells_1, positions.cells_2 = (
            points(cells(storey, 2, settings.split, settings.quarter)) for storey in (0, 1)
        )
        return positions
