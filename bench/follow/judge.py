"""A policy judged in batch: held-out worlds of each tree density, owners of each class of speed.

In: a policy and settings of FollowMe. Out: a scorecard of each cell, and of each speed over all densities.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import torch

from bench.follow.result import Judged
from bench.follow.stages import CELLS, OWNER_SPEEDS, Cell
from policies.learn.networks.policy import Policy
from policies.learn.rollout.task_tensors import TaskTensors
from policies.tasks.follow_me.follow_me import FollowMe
from policies.tasks.follow_me.scorecard import scorecard
from policies.tasks.follow_me.settings import FollowSettings
from policies.tasks.follow_me.track import Track
from policies.tasks.follow_me.track_recording import Recording
from policies.tasks.task_params import Sampler

EPISODES = 64  # of each cell
HELD_OUT_SEED = 1_000_003  # no training run is given it


def judge_in_batch(policy: Policy, settings: FollowSettings, cells: Sequence[Cell] = CELLS) -> list[Judged]:
    """Scorecards on the test split, the estimator in the loop."""
    held_out = settings.model_copy(update={"split": "test", "has_estimator": True, "terrain": "fresh"})
    task = FollowMe(held_out, EPISODES)
    tracks, returns = {}, {}
    for cell in cells:
        trees, speed = cell.trees_per_ha, cell.owner_speed_max
        flown, returns[cell] = first_episodes(policy, task, {"trees_per_ha": trees, "owner_speed_max": speed})
        tracks[cell] = [replace(track, trees_per_ha=trees, owner_speed_max=speed) for track in flown]
    return scorecards(tracks, returns)


def scorecards(
    tracks: dict[Cell, list[Track]], returns: dict[Cell, float] | None = None, *, is_flown: bool = False
) -> list[Judged]:
    """Of each cell, and of each speed over all densities."""
    judged = [
        Judged(is_flown, cell.trees_per_ha, cell.owner_speed_max, (returns or {}).get(cell), scorecard(flown))
        for cell, flown in tracks.items()
    ]
    for speed in OWNER_SPEEDS:
        pooled = [track for cell, flown in tracks.items() if cell.owner_speed_max == speed for track in flown]
        if pooled:
            judged.append(Judged(is_flown, None, speed, None, scorecard(pooled)))
    return judged


def first_episodes(policy: Policy, task: FollowMe, numbers: Mapping[str, float | Sampler]) -> tuple[list[Track], float]:
    """The first episode of every environment, by the most probable actions; their tracks and mean reward."""
    task.set_params(numbers)
    task.reset(HELD_OUT_SEED)
    tensors, recording = TaskTensors(task), Recording(task)
    memory = policy.start_memory(task.env_count)
    with torch.inference_mode():
        while not recording.is_complete:
            actions, memory = policy.act(tensors.observation, memory)
            tensors.step(policy.bounded(actions), actions.branches)
            recording.record()
            is_over = tensors.is_terminated | tensors.is_truncated
            memory = memory.masked_fill(is_over[:, None], 0.0) if memory.shape[1] else memory
    return recording.tracks(), float(np.mean(recording.returns))
