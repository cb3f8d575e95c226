"""Hover's episodes of logs of any autopilot that keeps positions; a log in which none was kept is refused."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from mission.dataset.hover_logs import POSITION_SP, read_hover_log
from policies.datasets.episodes import DatasetError, EpisodeRows
from policies.datasets.hover import LEAST, STEP_US, HoverBuilder
from policies.tasks.task import Task


def hover_episodes(logs: Sequence[Path], task: Task) -> Iterator[EpisodeRows]:
    """The episodes of some logs.

    Raises:
        DatasetError: one cannot be read, lacks a topic, or kept no position.
    """
    builder = HoverBuilder(task)
    for path in logs:
        count = 0
        for episode in builder.episodes(read_hover_log(path)):
            count += 1
            yield episode
        if not count:
            raise DatasetError(
                f"{path}: {POSITION_SP}: no position was kept for {LEAST * STEP_US * 1e-6:g} s in the air"
            )
