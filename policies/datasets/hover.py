"""Any flight that keeps a position as episodes of Hover: what an estimator and a controller logged, at 50 Hz.

In: the estimate, the position that was to be kept, and the rates and thrust that were asked for, whoever's autopilot it
was. Out: episodes about each position that stayed the same, paid by the task's own function on the estimate.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from autopilot.ports import Estimate
from common.warp_start import start_warp
from policies.datasets.decisions import Rows
from policies.datasets.episodes import EpisodeRows
from policies.datasets.hover_rows import frame_rows, hover_rows
from policies.tasks.episode import Outcome
from policies.tasks.flight.flight_params import FLIGHT_PARAMS
from policies.tasks.hover.hover_kernels import RATE_MAX, HoverParams
from policies.tasks.task import Task
from policies.tasks.task_params import typed_rows

STEP_US = 20_000
MOVED_M = 0.1  # a position that moves by more is another one
LEAST = 100  # decisions of an episode: 2 s
_NEAR = 0.9  # of the ball, in which an episode begins


@dataclass(frozen=True, slots=True, eq=False)
class HoverLog:
    """What a log tells, at each 20 ms."""

    source: str
    time_us: Rows  # (n,)
    pos_ned: Rows  # (n, 3), estimated, as the next
    vel_ned: Rows
    q_ned_from_frd: Rows  # (n, 4)
    omega_frd: Rows
    pos_ned_sp: Rows  # (n, 3), NaN: none was to be kept
    omega_frd_sp: Rows
    thrust: Rows  # (n,) of the greatest
    is_airborne: Rows
    is_fresh: Rows  # no topic is older than it may be
    context: Mapping[str, str | float] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.time_us)


class HoverBuilder:
    """Builds episodes.

    Args:
        task: Hover.
    """

    def __init__(self, task: Task) -> None:
        start_warp()
        self._layout = task.layout
        self._params = wp.array(task.param_table.typical(), dtype=float)
        values = typed_rows(self._params, HoverParams, first=len(FLIGHT_PARAMS)).numpy()
        self._ball_m, self._limit = float(values["ball_m"][0]), int(values["step_limit"][0])

    def episodes(self, log: HoverLog) -> Iterator[EpisodeRows]:
        """The episodes of a log, in order; none if it kept no position for two seconds."""
        for begin, end in self._stays(log):
            at = begin
            while end - at > LEAST:
                episode = self._episode(log, slice(at, min(at + self._limit + 1, end)))
                yield episode
                at += len(episode)

    def _stays(self, log: HoverLog) -> Iterator[tuple[int, int]]:
        """Where the same position was kept: first row, and the one after the last."""
        distance_m = np.linalg.norm(log.pos_ned - log.pos_ned_sp, axis=1)
        values = (log.pos_ned, log.vel_ned, log.q_ned_from_frd, log.omega_frd, log.omega_frd_sp, log.thrust[:, None])
        is_finite = np.all([np.isfinite(value).all(axis=1) for value in values], axis=0)
        is_good = log.is_airborne & log.is_fresh & is_finite & np.isfinite(distance_m)
        begin: int | None = None
        for k in range(len(log)):
            moved = begin is not None and np.linalg.norm(log.pos_ned_sp[k] - log.pos_ned_sp[begin]) > MOVED_M
            if begin is not None and (not is_good[k] or moved):
                yield begin, k
                begin = None
            if begin is None and is_good[k] and distance_m[k] < _NEAR * self._ball_m:
                begin = k
        if begin is not None:
            yield begin, len(log)

    def _episode(self, log: HoverLog, chosen: slice) -> EpisodeRows:
        n = chosen.stop - chosen.start
        estimates = np.zeros(n, _struct(Estimate))
        for name in ("pos_ned", "vel_ned", "q_ned_from_frd", "omega_frd"):
            estimates[name] = getattr(log, name)[chosen]
        actions = _actions(log.omega_frd_sp[chosen], log.thrust[chosen])
        known = wp.array(estimates, dtype=Estimate)
        points = wp.array(np.ascontiguousarray(log.pos_ned_sp[chosen], np.float32), dtype=wp.vec3)
        frames = wp.zeros((n, self._layout.frame_size), dtype=float)
        wp.launch(frame_rows, n, [known, points, wp.array(actions, dtype=wp.vec4), frames])
        rewards, outcomes = wp.zeros(n - 1, dtype=float), wp.zeros(n - 1, dtype=int)
        params = typed_rows(self._params, HoverParams, first=len(FLIGHT_PARAMS))
        touched = wp.zeros(n, dtype=int)  # a stay ends before it lands
        wp.launch(hover_rows, n - 1, [params, known, points, touched, rewards, outcomes])
        ended = np.flatnonzero(outcomes.numpy())
        steps = int(ended[0]) + 1 if len(ended) else n - 1
        outcome = Outcome(int(outcomes.numpy()[steps - 1]))
        return EpisodeRows(
            observations=frames.numpy()[: steps + 1],
            actions=actions[:steps],
            rewards=rewards.numpy()[:steps].astype(np.float64),
            is_terminated=outcome is Outcome.LOST,
            outcome="timeout" if outcome is Outcome.RUNNING else outcome.name.lower(),
            context={"source": log.source, "start_us": float(log.time_us[chosen.start]), **log.context},
        )


def _struct(kind: Any) -> Any:
    return kind.numpy_dtype()


def _actions(omega_frd_sp: Rows, thrust: Rows) -> NDArray[np.float32]:
    """Body rates and thrust as actions in [-1, 1], shape (n, 4)."""
    rates = omega_frd_sp / np.array([float(RATE_MAX[k]) for k in range(3)])
    out = np.concatenate([rates, 2.0 * thrust[:, None] - 1.0], axis=1)
    return np.clip(out, -1.0, 1.0).astype(np.float32)
