"""ReachTarget, the task of "Learning to Drive": a car on a platform without walls drives to one target after another.

Presets: `as-documented`, `as-coded` (variants 0 to 4, the article's five agents) and `improved` (start and goal pose
anywhere; position, heading and speed count). Frames are Unity's: x right, y up, z forward, yaw clockwise from above.
An episode counts as SUCCESS when it ends at its target; where reaching does not end it (`as-documented`), when at least
one target was reached before it was cut by its step limit. A car that falls off has failed, whatever it reached before.
"""

from typing import Any, ClassVar

import numpy as np
import warp as wp
from numpy.typing import NDArray

from policies.tasks.goals import PositionGoal
from policies.tasks.layout import Element, Layout
from policies.tasks.reach_target.car_model import STEP_S
from policies.tasks.reach_target.kernel import (
    NEAR_M,
    OBSERVATIONS,
    RANGE_M,
    REWARDS,
    SPEED_M_S,
    STEPS,
    SUCCESSES,
    ReachRules,
    ReachState,
    begin,
    step,
)
from policies.tasks.reach_target.reach_target_params import PARAMS, ReachParams
from policies.tasks.reach_target.settings import ReachSettings
from policies.tasks.task import SPLITS, Task
from policies.tasks.task_params import typed_rows
from policies.tasks.top_view import GOAL, GOOD, INK, OBSTACLE, VEHICLE, Canvas

_AXES = ("x", "y", "z")
_EGO = (
    Element("goal_bearing_sin", "1", is_goal=True),
    Element("goal_bearing_cos", "1", is_goal=True),
    Element("goal_distance", "m", RANGE_M, is_goal=True),
    Element("goal_distance_near", "m", NEAR_M, is_goal=True),
    Element("vel_car_z", "m/s", SPEED_M_S),
    Element("vel_car_x", "m/s", SPEED_M_S),
    Element("yaw_rate", "rad/s"),
    Element("goal_heading_sin", "1", is_goal=True),
    Element("goal_heading_cos", "1", is_goal=True),
    Element("steering", "1"),
    Element("edge_ahead", "m", RANGE_M),
    Element("edge_right", "m", RANGE_M),
    Element("edge_behind", "m", RANGE_M),
    Element("edge_left", "m", RANGE_M),
)
_INSET_M = 8.0  # half of what the small image around the car shows
_ACTIONS = (Element("steering", "1"), Element("throttle", "1"), Element("brake", "1"))


class ReachTarget(Task):
    """The task. Layout version 1."""

    params: ClassVar = PARAMS
    settings_class: ClassVar = ReachSettings
    decision_s = STEPS * STEP_S

    def __init__(self, settings: ReachSettings, env_count: int, device: str = "cpu") -> None:
        settings = settings.resolved()
        layout = Layout("ReachTarget", 1, _frame(settings), continuous=_ACTIONS, stack=settings.stack or 1)
        super().__init__(layout, env_count, number_defaults={}, device=device)
        self.settings = settings
        if (settings.observation, settings.reward, settings.success) == ("world", "sparse", "reach"):
            self.goal = PositionGoal(goal=(0, 1, 2), achieved=(3, 4, 5), radius="reach_m", reward=1.0)
        state = ReachState()
        state.pos = self._zeros("pos", env_count, wp.vec3)
        state.q = self._zeros("q", env_count, wp.quat)
        state.vel = self._zeros("vel", env_count, wp.vec3)
        state.omega_car = self._zeros("omega_car", env_count, wp.vec3)
        state.spin = self._zeros("spin", env_count, wp.vec4)
        state.steer = self._zeros("steer", env_count, float)
        state.target = self._zeros("target", env_count, wp.vec3)
        state.target_yaw = self._zeros("target_yaw", env_count, float)
        state.reaches = self._zeros("reaches", env_count, int)
        state.params = typed_rows(self.buffers.params, ReachParams)
        self.world = state
        self._record(begin, step, [state, _rules(settings)])

    def top_view(self, i_env: int, height_px: int = 480) -> NDArray[np.uint8]:
        """Platform, car and target from above, z upwards; beside it what is close to the car."""
        half = 1.1 * float(self._row(i_env)["half_platform_m"])
        canvas = Canvas((-half, 1.6 * half), (-half, half), height_px)
        self._draw(canvas, i_env)
        world: Any = self.world
        x, _, z = (float(value) for value in world.pos.numpy()[i_env])
        near = Canvas((x - _INSET_M, x + _INSET_M), (z - _INSET_M, z + _INSET_M), height_px // 4)
        self._draw(near, i_env)
        height, width = near.pixels.shape[:2]
        canvas.pixels[:height, -width:] = near.pixels
        speed = float(np.linalg.norm(world.vel.numpy()[i_env]))
        canvas.text(f"{float(self.buffers.steps.numpy()[i_env]) * self.decision_s:4.1f} s  {speed:4.1f} m/s")
        return canvas.pixels

    def _row(self, i_env: int) -> dict[str, float]:
        return dict(zip(self.param_table.names, self.buffers.params.numpy()[i_env].tolist(), strict=True))

    def _draw(self, canvas: Canvas, i_env: int) -> None:
        world: Any = self.world
        row = self._row(i_env)
        side = 2.0 * row["half_platform_m"]
        canvas.box((0.0, 0.0), (side, side), 0.0, (255, 255, 255))
        canvas.grid(10.0)
        _draw_target(canvas, world.target.numpy()[i_env], float(world.target_yaw.numpy()[i_env]), row)
        yaw = _yaw(world.q.numpy()[i_env])
        _draw_car(canvas, world.pos.numpy()[i_env], yaw, float(world.steer.numpy()[i_env]), row)


def _frame(settings: ReachSettings) -> tuple[Element, ...]:
    if settings.observation == "ego":
        return _EGO
    if settings.observation == "car":
        return (
            *(Element(f"target_pos_car_{axis}", "m", is_goal=True) for axis in _AXES),
            *(Element(f"vel_car_{axis}", "m/s") for axis in _AXES),
            *(Element(f"target_direction_car_{axis}", "1", is_goal=True) for axis in _AXES),
        )
    frame = (
        *(Element(f"target_pos_{axis}", "m", is_goal=True) for axis in _AXES),
        *(Element(f"pos_{axis}", "m") for axis in _AXES),
        *(Element(f"vel_{axis}", "m/s") for axis in _AXES),
    )
    if settings.observation == "world":
        return frame
    return (
        *frame,
        *(Element(f"target_direction_{axis}", "1", is_goal=True) for axis in _AXES),
        *(Element(f"forward_{axis}", "1") for axis in _AXES),
    )


def _rules(settings: ReachSettings) -> ReachRules:
    rules = ReachRules()
    rules.observation = OBSERVATIONS.index(settings.observation)
    rules.reward = REWARDS.index(settings.reward)
    rules.success = SUCCESSES.index(settings.success)
    rules.is_start_anywhere = int(settings.start == "anywhere")
    rules.is_split = int(settings.goals == "split")
    rules.split = SPLITS.index(settings.split)
    rules.is_stacked = int(settings.heights == "stacked")
    rules.does_contact_end = int(settings.preset != "as-documented")  # the article names falling only
    return rules


def _yaw(q: Any) -> float:
    x, y, z, w = (float(value) for value in q)
    return float(np.arctan2(2.0 * (x * z + w * y), 1.0 - 2.0 * (x * x + y * y)))


def _draw_target(canvas: Canvas, target: Any, yaw: float, row: dict[str, float]) -> None:
    centre = (float(target[0]), float(target[2]))
    canvas.box(centre, (3.0, 5.0), -yaw, GOAL)  # the published block: to be seen, not to be touched
    canvas.disc(centre, row["reach_m"], GOOD)
    tip = (centre[0] + 4.0 * np.sin(yaw), centre[1] + 4.0 * np.cos(yaw))
    canvas.line([centre, tip], GOAL, 2)


def _draw_car(canvas: Canvas, pos: Any, yaw: float, steer: float, row: dict[str, float]) -> None:
    sin, cos = np.sin(yaw), np.cos(yaw)
    for side in (-1.0, 1.0):
        for axle in (-1.0, 1.0):
            x, z = side * row["track_m"] / 2.0, axle * row["wheelbase_m"] / 2.0
            centre = (float(pos[0]) + cos * x + sin * z, float(pos[2]) - sin * x + cos * z)
            turn = np.radians(row["steer_max_deg"]) * steer if axle > 0.0 else 0.0
            canvas.box(centre, (0.4, 2.0 * row["wheel_radius_m"]), -(yaw + turn), INK)
    centre = (float(pos[0]), float(pos[2]))
    canvas.box(centre, (row["chassis_width_m"], row["chassis_length_m"]), -yaw, VEHICLE)
    nose = 0.5 * row["chassis_length_m"]
    canvas.line([centre, (centre[0] + (nose + 2.0) * sin, centre[1] + (nose + 2.0) * cos)], OBSTACLE, 2)
