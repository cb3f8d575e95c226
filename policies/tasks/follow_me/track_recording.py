"""Tracks of the first episode of every environment, while somebody flies a batch of FollowMe.

In: the truth that the task writes with each decision. Out: what a scorecard is made of. Whoever flies calls `record`
after each step until `is_complete`; no episode is favoured for being short.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from policies.tasks.episode import RUNNING
from policies.tasks.follow_me.follow_me import FollowMe
from policies.tasks.follow_me.follow_me_kernels import MEASURES
from policies.tasks.follow_me.track import Track

_COLUMNS = [MEASURES.index(name) for name in ("distance_m", "bearing_rad", "is_in_view", "is_collided")]


class Recording:
    """Of one batch, from its reset on."""

    def __init__(self, task: FollowMe) -> None:
        self._task = task
        self._measures: list[NDArray[np.float32]] = []  # (envs, 4) of each decision
        self._lengths = np.zeros(task.env_count, dtype=np.int64)  # decisions of the first episodes; 0: still running
        self.returns = np.zeros(task.env_count)  # rewards of the first episodes, so far

    @property
    def is_complete(self) -> bool:
        """Whether every first episode has ended."""
        return bool(self._lengths.all())

    def record(self) -> None:
        """Notes the decision that was just made."""
        is_running = self._lengths == 0
        self._measures.append(self._task.measures.numpy()[:, _COLUMNS])
        self.returns += np.where(is_running, self._task.buffers.rewards.numpy(), 0.0)
        has_ended = self._task.buffers.outcomes.numpy() != int(RUNNING)
        self._lengths[is_running & has_ended] = len(self._measures)

    def tracks(self) -> list[Track]:
        """One per environment, in their order; of an episode that still runs, what there is of it."""
        names: Sequence[str] = self._task.param_table.names
        params = self._task.buffers.params.numpy()
        planned_s = params[:, names.index("decision_limit")] * self._task.decision_s
        whole = np.stack(self._measures)
        time_s = self._task.decision_s * np.arange(1, len(whole) + 1, dtype=np.float64)
        tracks = []
        for i, length in enumerate(np.where(self._lengths > 0, self._lengths, len(whole))):
            distance, bearing, is_in_view, is_collided = whole[:length, i].T.astype(np.float64)
            tracks.append(
                Track(time_s[:length], distance, bearing, is_in_view > 0.5, is_collided > 0.5, float(planned_s[i]))
            )
        return tracks
