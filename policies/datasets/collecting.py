"""Episodes of the batch simulator as datasets: whoever drives, as well as it does, or with noise on its actions.

An expert's set is collected without noise; a medium one with a half-trained policy or with noise; a replay by many
policies of a run, merged.
"""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from policies.datasets.episodes import EpisodeRows
from policies.experts.episode_recording import Episode, Recorder
from policies.experts.expert import Expert
from policies.tasks.layout import Layout
from policies.tasks.task import Task


class NoisyDriver:
    """Another's actions with noise: gaussian on numbers, clipped to [-1, 1]; choices are drawn anew this often.

    Args:
        driver: whose actions.
        noise: standard deviation, or the probability of another choice.
        seed: of the noise.
    """

    def __init__(self, driver: Expert, noise: float, seed: int) -> None:
        self._driver, self._noise = driver, noise
        self._rng = np.random.default_rng((seed, 0x6E6F))

    def act(self, task: Task) -> None:
        """Writes the actions of every row."""
        self._driver.act(task)
        if self._noise <= 0.0:
            return
        buffers = task.buffers
        if task.layout.continuous:
            wanted = buffers.continuous.numpy()
            noise = self._rng.normal(0.0, self._noise, wanted.shape)
            buffers.continuous.assign(np.clip(wanted + noise, -1.0, 1.0).astype(np.float32))
        if task.layout.branches:
            choices = buffers.branches.numpy().copy()
            is_other = self._rng.random(choices.shape) < self._noise
            drawn = self._rng.integers(np.array(task.layout.branch_sizes), size=choices.shape)
            buffers.branches.assign(np.where(is_other, drawn, choices).astype(np.int32))


def collected(
    task: Task, driver: Expert, count: int, seed: int, progress: Callable[[int], None] = lambda _: None
) -> Iterator[EpisodeRows]:
    """Whole episodes, in the order in which they end; of rows that have given their part no more are taken.

    Every row gives its part, so that short episodes are not preferred for having ended first.

    Args:
        task: its rows work side by side; not more of them than episodes.
        driver: who drives.
        count: how many episodes.
        seed: of the task's draws.
        progress: told how many there are, after every step.
    """
    left = np.full(task.env_count, count // task.env_count)
    left[: count % task.env_count] += 1
    task.reset(seed)
    recorder = Recorder(task)
    while left.any():
        driver.act(task)
        recorder.note()
        task.step()
        for i, episode in recorder.ended():
            if left[i]:
                left[i] -= 1
                yield rows_of(episode, task.layout)
        progress(count - int(left.sum()))


def rows_of(episode: Episode, layout: Layout) -> EpisodeRows:
    """A recorded episode as a dataset holds it."""
    actions: NDArray[Any] = episode.continuous
    if layout.branches:
        actions = episode.branches[:, 0] if len(layout.branches) == 1 else episode.branches
    return EpisodeRows(
        observations=episode.observations,
        actions=actions,
        rewards=episode.rewards,
        is_terminated=not episode.is_truncated,
        outcome=episode.outcome.name.lower(),
        images=episode.images,
    )
