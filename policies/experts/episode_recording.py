"""Recording: whole episodes of a task, cut out of the batch while something drives it.

Around every step of the task: `note` before it (what was seen and done), `ended` after it (the episodes that it ended).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from policies.experts.expert import Expert
from policies.tasks.episode import Outcome
from policies.tasks.task import Task

MAX_ROWS = 256  # guess: enough to fill a launch; more would only lengthen the wait for each row's last episode
IMAGE_ROWS_MAX = 16  # of a task that shows images: FollowMe's 600 decisions of 16 KiB are 160 MB of that many
_PATIENCE = 20  # episodes tried per episode asked for before an expert is called unfit


class RecordingError(ValueError):
    """Nothing that could be recorded; the message is one sentence for the user."""


@dataclass(frozen=True, slots=True)
class Episode:
    """One episode as Minari keeps it: one observation more than actions."""

    observations: NDArray[np.float32]  # (steps + 1, elements)
    continuous: NDArray[np.float32]  # (steps, continuous actions)
    branches: NDArray[np.int64]  # (steps, branches)
    rewards: NDArray[np.float64]  # (steps,)
    outcome: Outcome
    is_truncated: bool  # cut by its step limit; a task may call that a success
    images: NDArray[np.uint8] | None = None  # (steps + 1, height, width, channels), of a task that shows them

    @property
    def is_success(self) -> bool:
        return self.outcome is Outcome.SUCCESS


@dataclass(slots=True)
class _Row:
    observations: list[Any] = field(default_factory=list)
    continuous: list[Any] = field(default_factory=list)
    branches: list[Any] = field(default_factory=list)
    rewards: list[Any] = field(default_factory=list)
    images: list[Any] = field(default_factory=list)


class Recorder:
    """The running episodes of a task's rows. A row that is begun anew from outside is to be given to `drop`."""

    def __init__(self, task: Task) -> None:
        self._task = task
        self._rows = [_Row() for _ in range(task.env_count)]

    def note(self) -> None:
        """Takes down what is seen and what will be done; to be called between acting and stepping."""
        buffers = self._task.buffers
        seen, pushed, chosen = (
            array.numpy().copy() for array in (buffers.observations, buffers.continuous, buffers.branches)
        )
        images = buffers.images.numpy() if self._task.layout.image is not None else None
        for i, row in enumerate(self._rows):
            if images is not None:
                row.images.append(images[i].copy())  # a view would keep those of all rows
            row.observations.append(seen[i])
            row.continuous.append(pushed[i])
            row.branches.append(chosen[i])

    def ended(self) -> list[tuple[int, Episode]]:
        """The rows whose episode ended with the last step, and those episodes; to be called after stepping."""
        buffers = self._task.buffers
        rewards, outcomes = buffers.rewards.numpy().copy(), buffers.outcomes.numpy()
        for i, row in enumerate(self._rows):
            row.rewards.append(rewards[i])
        if self._task.is_skipped is not None:
            for i_row in np.flatnonzero(self._task.is_skipped):
                self.drop(int(i_row))  # it stands between two episodes
        return [(int(i), self._taken(int(i), Outcome(int(outcomes[i])))) for i in np.flatnonzero(outcomes)]

    def drop(self, i_row: int) -> None:
        """Forgets what the row has done since its last end."""
        self._rows[i_row] = _Row()

    def _taken(self, i: int, outcome: Outcome) -> Episode:
        row = self._rows[i]
        self.drop(i)
        buffers = self._task.buffers
        final = buffers.final_observations.numpy()[i]
        images = np.stack([*row.images, buffers.final_images.numpy()[i]]) if row.images else None
        return Episode(
            observations=np.stack([*row.observations, final]).astype(np.float32),
            continuous=np.stack(row.continuous).astype(np.float32),
            branches=np.stack(row.branches).astype(np.int64),
            rewards=np.array(row.rewards, dtype=np.float64),
            outcome=outcome,
            is_truncated=bool(buffers.is_truncated.numpy()[i]),
            images=images,
        )


def record_episodes(
    task: Task,
    expert: Expert,
    count: int,
    seed: int,
    *,
    has_failures: bool = False,
    progress: Callable[[int], None] = lambda _recorded: None,
) -> list[Episode]:
    """Episodes that an expert drove, in the order of the task's rows.

    Every row gives its share, so that short episodes are not preferred for having ended first.

    Args:
        task: its rows work side by side; not more of them than episodes.
        expert: who drives.
        count: how many episodes are wanted.
        seed: of the task's draws.
        has_failures: whether episodes that did not succeed count as well.
        progress: told how many there are, after every step.

    Raises:
        RecordingError: hardly any episode succeeds, or the task shows images.
    """
    if task.layout.image is not None:
        raise RecordingError(f"{task.layout.task}: shows images as it is set, and demonstrations hold none")
    fractions = np.full(task.env_count, count // task.env_count)
    fractions[: count % task.env_count] += 1
    kept: list[list[Episode]] = [[] for _ in range(task.env_count)]
    tried = 0
    task.reset(seed)
    recorder = Recorder(task)
    while (recorded := sum(map(len, kept))) < count:
        if tried > _PATIENCE * (recorded + task.env_count):
            raise RecordingError(f"{task.layout.task}: only {recorded} of {tried} episodes succeeded")
        expert.act(task)
        recorder.note()
        task.step()
        for i, episode in recorder.ended():
            tried += 1
            if len(kept[i]) < fractions[i] and (episode.is_success or has_failures):
                kept[i].append(episode)
        progress(sum(map(len, kept)))
    return [episode for episodes in kept for episode in episodes]
