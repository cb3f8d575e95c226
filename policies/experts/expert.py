"""What drives a task without having learned it: a scripted expert, a person at a keyboard, or chance.

An expert writes the next actions of all rows into the task's buffers. It is a teacher: it may look at the task's world
(`task.world`, the numbers of each row), not only at what a policy observes. What it plans for an episode it keeps by
row, and drops when `buffers.episodes` shows that the row has begun another.
"""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from policies.tasks.task import Task


class Expert(Protocol):
    """Whoever chooses the actions."""

    def act(self, task: Task) -> None:
        """Writes the actions of every row into `task.buffers.continuous` or `task.buffers.branches`."""


class RandomDriver:
    """Actions drawn evenly: what a task looks like before anything is known about it."""

    def __init__(self, seed: int = 0) -> None:
        self._rng = np.random.default_rng(seed)

    def act(self, task: Task) -> None:
        if task.layout.continuous:
            task.buffers.continuous.assign(self._rng.uniform(-1.0, 1.0, task.buffers.continuous.shape))
        for k, size in enumerate(task.layout.branch_sizes):
            choices = task.buffers.branches.numpy()
            choices[:, k] = self._rng.integers(size, size=task.env_count)
            task.buffers.branches.assign(choices)


class NewEpisodes:
    """Tells which rows have begun another episode since the last look."""

    def __init__(self) -> None:
        self._seen: NDArray[Any] = np.zeros(0, dtype=np.int32)
        self._seeds: NDArray[Any] = np.zeros(0, dtype=np.int32)

    def rows(self, task: Task) -> NDArray[np.intp]:
        """The rows that are in another episode than at the last call; at the first, all of them."""
        episodes: NDArray[Any] = task.buffers.episodes.numpy()
        seeds: NDArray[Any] = task.buffers.seed.numpy()
        is_other = not np.array_equal(seeds, self._seeds)
        rows = np.arange(len(episodes)) if is_other else np.flatnonzero(episodes != self._seen)
        self._seen, self._seeds = episodes.copy(), seeds.copy()
        return rows
