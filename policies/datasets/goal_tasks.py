"""Logged flights to goals as episodes of Navigate, and drives into poses as episodes of Drive.

In: decisions, and the truth where the log has it. Out: rewards and ends by the tasks' own functions; where the vehicle
is by the truth or else by its estimate, the room round it by its ranges, which are in the observation, and what it
struck by its accelerometers.
"""

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.range_sectors import RANGE_M, RANGES
from common.warp_start import start_warp
from policies.datasets.decisions import DecisionRows, Rows, TruthRows, struck_on_the_way
from policies.datasets.episodes import DatasetError
from policies.datasets.follow_me import asked_or_flown, quats, truth_rows
from policies.datasets.goal_rows import drive_action_rows, drive_rows, navigate_rows
from policies.tasks.drive import observe as drive
from policies.tasks.drive.drive_params import DriveParams
from policies.tasks.flight.flight_params import FLIGHT_PARAMS
from policies.tasks.flight.own_state import OWN_ELEMENTS
from policies.tasks.layout import Layout
from policies.tasks.navigate.navigate_params import NavigateParams
from policies.tasks.task import Task
from policies.tasks.task_params import typed_rows
from sim.truth import Truth

_ROOM_MAX_M = 2.0  # as Navigate measures it
_HULL_M = 0.3  # from a rover's middle, where its ranges begin, to its nose
_HEIGHT = next(k for k, element in enumerate(OWN_ELEMENTS) if element.name == "height")


class _GoalJudge:
    def __init__(self, task: Task) -> None:
        start_warp()
        self.layout: Layout = task.layout
        self._step_s = task.decision_s
        self._params = wp.array(task.param_table.typical(), dtype=float)

    def _where(self, run: DecisionRows, truth: TruthRows | None, height_m: Rows) -> Rows:
        """Rows of `Truth`: the truth, or the estimate in its place.

        Raises:
            DatasetError: there was no goal.
        """
        if not np.isfinite(run.goal).all():
            raise DatasetError(f"{run.source}: policy_decision: decisions without a goal")
        if truth is not None:
            return truth_rows(truth)
        known = TruthRows(run.pos_ned, run.vel_ned, quats(run.yaw), height_m, np.zeros(len(run), np.int32))
        return truth_rows(known)


class NavigateJudge(_GoalJudge):
    """Navigate's, and NavigateRover's.

    Args:
        task: with ranges.
    """

    def actions(self, run: DecisionRows) -> Rows:
        """The pilot's, or where a guard, the brake before a goal or another flew what asks for that."""
        return asked_or_flown(run)

    def judged(self, run: DecisionRows, actions: Rows, truth: TruthRows | None) -> tuple[Rows, Rows]:
        height = run.frame[:, _HEIGHT] * OWN_ELEMENTS[_HEIGHT].scale
        where = self._where(run, truth, height)
        ranges_m = (1.0 - run.frame[:, -RANGES:]) * RANGE_M
        rooms = np.minimum(ranges_m.min(axis=1), _ROOM_MAX_M)
        drives = self.layout.task == "NavigateRover"
        touched = struck_on_the_way(run)
        if not drives:
            touched |= where["is_on_ground"]
        steps = len(run) - 1
        rewards, outcomes = wp.zeros(steps, dtype=float), wp.zeros(steps, dtype=int)
        inputs = [
            typed_rows(self._params, NavigateParams, first=len(FLIGHT_PARAMS)),
            wp.array(where, dtype=Truth),
            wp.array(_floats(run.goal), dtype=wp.vec3),
            wp.array(_floats(rooms), dtype=float),
            wp.array(touched, dtype=int),
            wp.array(_floats(actions[:steps]), dtype=wp.vec4),
            self._step_s,
        ]
        wp.launch(navigate_rows, steps, [*inputs, rewards, outcomes])
        return rewards.numpy(), outcomes.numpy()


class DriveJudge(_GoalJudge):
    """Drive's.

    Args:
        task: to reach a pose or to park.
    """

    def actions(self, run: DecisionRows) -> Rows:
        """The pilot's, or where a guard or another drove what asks for that."""
        out = wp.zeros(len(run), dtype=wp.vec2)
        asked = wp.array(run.action.astype(np.float32), dtype=wp.vec2)
        wp.launch(drive_action_rows, len(run), [asked, wp.array(np.nan_to_num(_floats(run.flown)), dtype=float), out])
        found: Rows = out.numpy()
        return found

    def judged(self, run: DecisionRows, actions: Rows, truth: TruthRows | None) -> tuple[Rows, Rows]:
        where = self._where(run, truth, np.zeros(len(run), np.float32))
        off = run.goal[:, :2] - where["pos_ned"][:, :2]
        heading = run.yaw if truth is None else _yaw(where["q_ned_from_frd"])
        turns = (run.goal[:, 2] - heading + np.pi) % (2.0 * np.pi) - np.pi
        nearness = run.frame[:, -drive.DIRECTIONS :]
        ranges_m = float(drive.RANGE_M) * (1.0 - nearness) ** 2
        rooms = np.clip(ranges_m.min(axis=1) - _HULL_M, 0.0, 1.0)
        steps = len(run) - 1
        rewards, outcomes = wp.zeros(steps, dtype=float), wp.zeros(steps, dtype=int)
        inputs = [
            typed_rows(self._params, DriveParams, first=len(FLIGHT_PARAMS)),
            wp.array(where, dtype=Truth),
            wp.array(_floats(np.hypot(off[:, 0], off[:, 1])), dtype=float),
            wp.array(_floats(turns), dtype=float),
            wp.array(_floats(rooms), dtype=float),
            wp.array(struck_on_the_way(run), dtype=int),
            wp.array(_floats(actions[:steps]), dtype=wp.vec2),
        ]
        wp.launch(drive_rows, steps, [*inputs, rewards, outcomes])
        return rewards.numpy(), outcomes.numpy()


def _floats(rows: Rows) -> NDArray[np.float32]:
    return np.ascontiguousarray(rows, np.float32)


def _yaw(q: Rows) -> Rows:
    """Headings [rad] of attitudes (x, y, z, w)."""
    x, y, z, w = q.T
    found: Rows = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return found
