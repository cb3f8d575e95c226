"""Datasets of different quality, recorded from an expert whose actions are disturbed: expert, medium, replay."""

from pathlib import Path
from typing import Any

import numpy as np

from policies.experts.catalogue import build_expert
from policies.experts.demonstration_file import Origin, write_demonstrations
from policies.experts.episode_recording import Episode, record_episodes
from policies.experts.expert import Expert
from policies.tasks.catalogue import build_task, settings_of
from policies.tasks.task import Task

QUALITIES: dict[str, tuple[float, ...]] = {"expert": (0.1,), "medium": (0.7,), "replay": (1.0, 0.8, 0.6, 0.4, 0.2)}
"""By name: how much of each action is noise, in parts of equal numbers of episodes."""


class DisturbedExpert:
    """An expert whose continuous actions are mixed with a slowly changing noise."""

    def __init__(self, expert: Expert, noise: float, seed: int) -> None:
        """An expert, and the fraction of each action that is noise: at 1 the expert has no part in it."""
        self._expert, self._noise = expert, noise
        self._rng = np.random.default_rng(seed)
        self._walk: Any = None

    def act(self, task: Task) -> None:
        """Writes the actions."""
        if self._noise < 1.0:
            self._expert.act(task)
        actions = task.buffers.continuous.numpy()
        drawn = self._rng.uniform(-1.0, 1.0, actions.shape)
        self._walk = drawn if self._walk is None else 0.7 * self._walk + 0.7 * drawn  # 0.7^2 + 0.7^2 is about 1
        mixed = (1.0 - self._noise) * actions + self._noise * self._walk.clip(-1.0, 1.0)
        task.buffers.continuous.assign(mixed.astype(np.float32))


def record(folder: Path, name: str, arguments: list[str], quality: str, episode_count: int, seed: int = 1) -> None:
    """Writes a dataset of a task that has a scripted expert and continuous actions."""
    settings = settings_of(name, arguments)
    parts = QUALITIES[quality]
    episodes: list[Episode] = []
    count = episode_count // len(parts)
    for k, noise in enumerate(parts):
        task = build_task(name, min(count, 64), settings)
        driver = DisturbedExpert(build_expert(name), noise, seed + k)
        episodes += record_episodes(task, driver, count, seed + k, has_failures=True)
    write_demonstrations(folder, Origin(task.layout, settings, "scripted", seed), episodes)
