"""Logged flights of a follower as episodes of FollowMe: of its tracked setting, or of that with images.

In: decisions, and the truth where the log has it. Out: rewards and ends by the task's own functions, on the truth, or
else on what the senses knew, which is in the frames of all followers' logs; what it struck by its accelerometers. A log
has no others about: room to them costs nothing here.
"""

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.warp_start import start_warp
from policies.datasets.decisions import DecisionRows, Rows, TruthRows, struck_on_the_way
from policies.datasets.follow_me_rows import action_rows, command_rows, follow_rows, sight_rows
from policies.datasets.goal_rows import navigate_action_rows
from policies.tasks.flight.flight_params import FLIGHT_PARAMS
from policies.tasks.flight.own_state import ACTIONS, Command
from policies.tasks.follow_me.follow_me_params import FollowParams
from policies.tasks.follow_me.owner_visibility import ROOM_MAX_M, Sight
from policies.tasks.follow_me.tracked.vector import REACH_M, SECTORS, TRACKED_ELEMENTS
from policies.tasks.layout import Layout
from policies.tasks.task import Task
from policies.tasks.task_params import typed_rows
from sim.truth import Truth
from sim.world.people import Person
from sim.world.world import World

SETTINGS = ("observation=tracked",)
_UNSEEN_AGE_S = 0.3  # by the senses: three images without the owner


class FollowMeJudge:
    """FollowMe's in the tracked setting, where an action goes on from the last command.

    Args:
        task: in the setting whose dataset is built.
    """

    def __init__(self, task: Task) -> None:
        start_warp()
        self.layout: Layout = task.layout
        self._decision_s = task.decision_s
        self._params = wp.array(task.param_table.typical(), dtype=float)
        self._scale = np.array([element.scale for element in TRACKED_ELEMENTS], np.float32)  # frames are always these
        self._at = {element.name: k for k, element in enumerate(TRACKED_ELEMENTS)}

    def actions(self, run: DecisionRows) -> Rows:
        """The pilot's, or where a guard or another flew what leads there; clipped to [-1, 1]."""
        n, q = len(run), wp.array(quats(run.yaw), dtype=wp.quat)
        shown = np.ascontiguousarray(run.frame[:, [self._at[f"last_{element.name}"] for element in ACTIONS]])
        gone_on_from = wp.zeros(n, dtype=Command)  # as flown last, or beside trunks what the guard let it go on from
        wp.launch(command_rows, n, [wp.array(shown, dtype=wp.vec4), q, gone_on_from])
        last = gone_on_from.numpy()
        last["vel_ned"][0] = (*run.vel_ned[0, :2], 0.0)
        last["yaw_rate"][0] = 0.0
        out = wp.zeros(n, dtype=wp.vec4)
        asked = wp.array(run.action.astype(np.float32), dtype=wp.vec4)
        flown = wp.array(command_rows_of(run.flown), dtype=Command)
        wp.launch(action_rows, n, [asked, q, wp.array(last, dtype=Command), flown, out])
        found: Rows = out.numpy()
        return found

    def judged(self, run: DecisionRows, actions: Rows, truth: TruthRows | None) -> tuple[Rows, Rows]:
        steps = len(run) - 1
        has_owner = truth is not None and truth.owner is not None
        sights = self._true_sights(truth) if truth is not None and has_owner else self._known_sights(run)
        touched = struck_on_the_way(run)
        if truth is not None:
            touched |= truth.is_on_ground.astype(np.int32)
        rewards, outcomes = wp.zeros(steps, dtype=float), wp.zeros(steps, dtype=int)
        unseen_s = self._unseen_s(sights["is_in_view"])
        params = typed_rows(self._params, FollowParams, first=len(FLIGHT_PARAMS))
        inputs = [
            params,
            wp.array(np.ascontiguousarray(sights[1:]), dtype=Sight),
            wp.array(np.ascontiguousarray(touched[1:]), dtype=int),
            wp.array(np.ascontiguousarray(unseen_s[1:]), dtype=float),
            wp.array(np.ascontiguousarray(actions[:steps]), dtype=wp.vec4),
        ]
        wp.launch(follow_rows, steps, [*inputs, rewards, outcomes])
        return rewards.numpy(), outcomes.numpy()

    def _true_sights(self, truth: TruthRows) -> Rows:
        n = len(truth.height_m)
        out = wp.zeros(n, dtype=Sight)
        params = typed_rows(self._params, FollowParams, first=len(FLIGHT_PARAMS))
        world = wp.array([truth.world], dtype=World)
        people = wp.array(truth.owner, dtype=Person)
        wp.launch(sight_rows, n, [world, wp.array(truth_rows(truth), dtype=Truth), params, people, out])
        found: Rows = out.numpy()
        return found

    def _known_sights(self, run: DecisionRows) -> Rows:
        """By what the senses knew."""
        values = run.frame * self._scale
        sights = np.zeros(len(run), _struct(Sight))
        pos = values[:, [self._at[f"seen_owner_pos_hfrd_{axis}"] for axis in "xyz"]]
        sights["position_hfrd"] = pos
        sights["distance_m"] = values[:, self._at["seen_distance"]]
        sights["bearing_rad"] = np.arctan2(pos[:, 1], pos[:, 0])
        sights["reach_m"] = np.hypot(pos[:, 0], pos[:, 1])
        nearness = run.frame[:, self._at["seen_nearness_0_deg"] :][:, :SECTORS]
        sights["room_m"] = np.minimum((1.0 - nearness.max(axis=1)) * float(REACH_M), float(ROOM_MAX_M))
        is_seen = (values[:, self._at["is_owner_seen"]] > 0.5) & (values[:, self._at["seen_age"]] < _UNSEEN_AGE_S)
        sights["is_in_view"] = sights["is_free"] = is_seen
        is_unknown = values[:, self._at["is_owner_seen"]] < 0.5  # all zeros: neither near nor struck
        sights["reach_m"][is_unknown] = sights["distance_m"][is_unknown] = float(self._far_m())
        return sights

    def _far_m(self) -> float:
        """A distance that is too far and not yet lost."""
        fields = typed_rows(self._params, FollowParams, first=len(FLIGHT_PARAMS)).numpy()
        return float(0.5 * (fields["far_m"][0] + fields["lost_m"][0]))

    def _unseen_s(self, is_in_view: Rows) -> NDArray[np.float32]:
        """Since the owner was in view, of every row; a run begins as if they had just been."""
        index = np.arange(len(is_in_view))
        seen = np.maximum.accumulate(np.where(is_in_view > 0, index, 0))
        return ((index - seen) * self._decision_s).astype(np.float32)


class ImageFollowMeJudge(FollowMeJudge):
    """FollowMe's in the setting with images, where an action is a velocity and a yaw rate by itself."""

    def actions(self, run: DecisionRows) -> Rows:
        """The pilot's, or where a guard or another flew what asks for that; clipped to [-1, 1]."""
        return asked_or_flown(run)


def asked_or_flown(run: DecisionRows) -> Rows:
    """Actions that ask for a velocity and a yaw rate: the pilot's, or if that was not flown what asks for what was."""
    out = wp.zeros(len(run), dtype=wp.vec4)
    asked = wp.array(run.action.astype(np.float32), dtype=wp.vec4)
    flown = wp.array(command_rows_of(run.flown), dtype=Command)
    wp.launch(navigate_action_rows, len(run), [asked, wp.array(quats(run.yaw), dtype=wp.quat), flown, out])
    found: Rows = out.numpy()
    return found


def _struct(kind: Any) -> Any:
    return kind.numpy_dtype()


def command_rows_of(flown: Rows) -> Rows:
    """Velocities and yaw rates as rows of `Command`."""
    rows = np.zeros(len(flown), _struct(Command))
    rows["vel_ned"], rows["yaw_rate"] = flown[:, :3], flown[:, 3]
    return rows


def quats(yaw: Rows) -> NDArray[np.float32]:
    """Level attitudes of headings [rad], shape (n, 4)."""
    out = np.zeros((len(yaw), 4), np.float32)
    out[:, 2], out[:, 3] = np.sin(0.5 * yaw), np.cos(0.5 * yaw)
    return out


def truth_rows(truth: TruthRows) -> Rows:
    """As rows of `Truth`, as far as a log has them."""
    rows = np.zeros(len(truth.height_m), _struct(Truth))
    rows["pos_ned"], rows["vel_ned"] = truth.pos_ned, truth.vel_ned
    rows["q_ned_from_frd"], rows["height_agl_m"] = truth.q_ned_from_frd, truth.height_m
    rows["is_on_ground"] = truth.is_on_ground
    return rows
