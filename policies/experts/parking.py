"""The experts of Parking1 and Parking2: a distance field per episode and storey, and a plan for each decision.

They look at the task's world: where the car, the spot, the obstacles and the portals are, and how they move. How they
plan is told in parking_planner.py.
"""

from typing import Any

import numpy as np
import warp as wp

from policies.experts.expert import NewEpisodes
from policies.experts.parking_field import NODES, Target, fill_field
from policies.experts.parking_planner import Memory, Situation, next_command, write_command
from policies.tasks.parking import level1, level2
from policies.tasks.parking.arena import PORTAL_POSITIONS, STOREY_2_FROM_X, forward_of, pose, position_of, storey_of
from policies.tasks.parking.parking_params import CAR_PARAMS, CarParams, Level1Params, Level2Params
from policies.tasks.parking.scene import Scene, portal_half
from policies.tasks.parking.settings import Rules
from policies.tasks.parking.world import CarState, motion_of
from policies.tasks.task import Task
from policies.tasks.task_params import typed_rows

wp.set_module_options({"enable_backward": False})

_ANGLES_DEG = (0.0, 3.0, 6.0, 12.0, 21.0, 33.0, 48.0, 66.0, 90.0, 120.0, 150.0, 180.0)  # guess: finer where near ahead


@wp.struct
class Fields:
    """What a parking expert keeps, by row."""

    way: wp.array3d(dtype=float)  # [m]
    cost: wp.array3d(dtype=float)
    memories: wp.array(dtype=Memory)
    angles_rad: wp.array(dtype=float)


@wp.func
def parking_target(scene: Scene, rules: Rules, params: CarParams) -> Target:
    """The pad, to be touched; or the position of the car's origin from which it turns into the pose on the spot."""
    target = Target()
    target.pose = scene.goal
    target.half = scene.goal_half
    if rules.needs_pose:
        position = position_of(scene.goal) - forward_of(scene.goal) * params.box_ahead_m
        target.pose = wp.vec4(position[0], position[1], scene.goal[2], scene.goal[3])
        target.half = wp.vec2(0.0, 0.0)
    return target


@wp.func
def forget(memories: wp.array(dtype=Memory), i: int) -> None:
    """Drops the plans of the episode before."""
    memory = Memory()
    memory.shot = -1
    memories[i] = memory


@wp.kernel(enable_backward=False)
def fill_level1(rows: wp.array(dtype=int), cars: CarState, blocks: level1.Blocks, rules: Rules, fields: Fields) -> None:
    """The fields of the rows that have begun another episode."""
    i = rows[wp.tid()]
    scene = level1.scene_of(cars, blocks, i)
    forget(fields.memories, i)
    fill_field(fields.way, fields.cost, i, 0, scene, parking_target(scene, rules, cars.params[i]))


@wp.kernel(enable_backward=False)
def act_level1(
    branches: wp.array2d(dtype=int), cars: CarState, blocks: level1.Blocks, rules: Rules, fields: Fields
) -> None:
    """The next action of every row."""
    i = wp.tid()
    params = cars.params[i]
    now = Situation()
    now.scene = level1.scene_of(cars, blocks, i)
    now.target = parking_target(now.scene, rules, params)
    now.needs_pose = rules.needs_pose
    motion = motion_of(cars, i)
    command = next_command(fields.angles_rad, fields.way, fields.memories, i, motion, now, rules, params)
    write_command(branches, i, command, rules)


@wp.func
def situation_of(
    cars: CarState, movers: level2.Movers, positions: level2.Level2Positions, rules: Rules, i: int
) -> Situation:
    """Level 2: the pad, or the portal if the pad is on the other storey."""
    now = Situation()
    now.storey = storey_of(cars.pos[i][0])
    now.scene = level2.scene_of(cars, movers, positions, i, now.storey)
    now.has_movers = True
    now.more = movers.params[i]
    now.through_portal = not now.scene.has_goal
    if now.through_portal:
        now.target.pose = now.scene.portal
        now.target.half = portal_half()
    else:
        now.target = parking_target(now.scene, rules, cars.params[i])
        now.needs_pose = rules.needs_pose
    return now


@wp.kernel(enable_backward=False)
def fill_level2(
    rows: wp.array(dtype=int),
    cars: CarState,
    movers: level2.Movers,
    positions: level2.Level2Positions,
    rules: Rules,
    fields: Fields,
) -> None:
    """The fields of the rows that are in another episode or on another storey."""
    i = rows[wp.tid()]
    now = situation_of(cars, movers, positions, rules, i)
    standing = now.scene
    standing.obstacle_count = 0
    standing.has_portal = not now.through_portal
    forget(fields.memories, i)
    fill_field(fields.way, fields.cost, i, now.storey, standing, now.target)


@wp.kernel(enable_backward=False)
def act_level2(
    branches: wp.array2d(dtype=int),
    cars: CarState,
    movers: level2.Movers,
    positions: level2.Level2Positions,
    rules: Rules,
    fields: Fields,
) -> None:
    """The next action of every row."""
    i = wp.tid()
    now = situation_of(cars, movers, positions, rules, i)
    motion = motion_of(cars, i)
    command = next_command(fields.angles_rad, fields.way, fields.memories, i, motion, now, rules, cars.params[i])
    write_command(branches, i, command, rules)


def _fields(task: Task) -> Any:
    fields = Fields()
    shape = (task.env_count, NODES, NODES)
    fields.way = wp.zeros(shape, dtype=float, device=task.device)
    fields.cost = wp.zeros(shape, dtype=float, device=task.device)
    fields.memories = wp.zeros(task.env_count, dtype=Memory, device=task.device)
    both_ways = [angle for size in _ANGLES_DEG for angle in ((size, -size) if size else (size,))]
    fields.angles_rad = wp.array(np.radians(both_ways), dtype=float, device=task.device)
    return fields


class Parking1Expert:
    """Drives Parking1 in all presets."""

    def __init__(self) -> None:
        self._new_episodes = NewEpisodes()
        self._fields: Any = None

    def act(self, task: Task) -> None:
        """Writes the actions of every row of a `level1.Parking1`."""
        if not isinstance(task, level1.Parking1):
            raise TypeError(f"{task.layout.task} is not Parking1")
        self._fields = self._fields or _fields(task)
        inputs = [task.world, _blocks(task), task.rules, self._fields]
        _launch(task, fill_level1, act_level1, self._new_episodes.rows(task), inputs)


class Parking2Expert:
    """Drives Parking2 in all presets."""

    def __init__(self) -> None:
        self._new_episodes = NewEpisodes()
        self._fields: Any = None
        self._inputs: list[Any] = []
        self._storeys = np.zeros(0, dtype=np.bool_)

    def act(self, task: Task) -> None:
        """Writes the actions of every row of a `level2.Parking2`."""
        if not isinstance(task, level2.Parking2):
            raise TypeError(f"{task.layout.task} is not Parking2")
        if not self._inputs:
            self._inputs = [task.world, *_movers_and_positions(task), task.rules, _fields(task)]
        storeys = task.world.pos.numpy()[:, 0] > float(STOREY_2_FROM_X)
        rows = self._new_episodes.rows(task)
        if len(self._storeys) == len(storeys):
            rows = np.union1d(rows, np.flatnonzero(storeys != self._storeys))
        self._storeys = storeys
        _launch(task, fill_level2, act_level2, rows, self._inputs)


def _blocks(task: level1.Parking1) -> Any:
    blocks = level1.Blocks()
    blocks.poses = task.blocks
    blocks.params = typed_rows(task.buffers.params, Level1Params, first=len(CAR_PARAMS))
    return blocks


def _movers_and_positions(task: level2.Parking2) -> tuple[Any, Any]:
    movers = level2.Movers()
    movers.poses = task.movers
    movers.touching = wp.zeros((task.env_count, 2), dtype=int, device=task.device)  # not looked at by `scene_of`
    movers.params = typed_rows(task.buffers.params, Level2Params, first=len(CAR_PARAMS))
    positions = level2.Level2Positions()
    positions.portals = wp.mat44(
        *np.vstack([*(pose(position) for position in PORTAL_POSITIONS), np.zeros((2, 4))]).ravel()
    )
    return movers, positions


def _launch(task: Task, fill: Any, act: Any, rows: Any, inputs: list[Any]) -> None:
    if len(rows):
        wp.launch(fill, len(rows), [wp.array(rows, dtype=int, device=task.device), *inputs], device=task.device)
    wp.launch(act, task.env_count, [task.buffers.branches, *inputs], device=task.device)
