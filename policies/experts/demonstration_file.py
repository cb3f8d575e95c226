"""Demonstrations on disk: a folder that is a Minari dataset (HDF5), made whole or not at all.

    DIR/metadata.json     Minari's keys, and ours: honeyguide_layout, honeyguide_task, honeyguide_settings (JSON text),
                          honeyguide_expert, honeyguide_seed, honeyguide_successes
    DIR/main_data.hdf5    per episode: observations (steps + 1, elements) float32; actions as in the Gymnasium space:
                          (steps, continuous) float32, (steps,) or (steps, branches) int64; rewards; terminations;
                          truncations; attributes `success`, `outcome` and the sums Minari keeps

`minari.MinariDataset(DIR)` reads it. Minari itself is imported when it is needed (extra `learn`).
"""

import copy
import json
import os
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium

from common.files import part_path
from policies.experts.episode_recording import Episode
from policies.tasks.gym_arrays import action_space, observation_space
from policies.tasks.layout import Layout
from policies.tasks.task import TaskSettings

LAYOUT_KEY = "honeyguide_layout"
TASK_KEY = "honeyguide_task"
SETTINGS_KEY = "honeyguide_settings"
_EPISODE_BYTES = 16_000  # of an episode's groups and attributes in the HDF5 file: measured, 14,600


class DemonstrationFileError(ValueError):
    """Demonstrations that cannot be written; the message is one sentence for the user."""


@dataclass(frozen=True, slots=True)
class Origin:
    """Where demonstrations come from."""

    layout: Layout
    settings: TaskSettings
    expert: str  # "scripted" or "keyboard"
    seed: int


def check_is_free(folder: Path) -> None:
    """Makes sure that a dataset can be written there, before anything is recorded.

    Raises:
        DemonstrationFileError: something is there already, or its parent is missing.
        ModuleNotFoundError: Minari is not installed.
    """
    import minari  # noqa: F401, PLC0415  (extra `learn`)

    if folder.exists():
        raise DemonstrationFileError(f"{folder}: there is something of that name already")
    if not folder.parent.is_dir():
        raise DemonstrationFileError(f"{folder}: the folder it would lie in does not exist")


def write_demonstrations(folder: Path, origin: Origin, episodes: Sequence[Episode]) -> None:
    """Writes a new Minari dataset; the folder appears when it is complete.

    Raises:
        DemonstrationFileError: something is there already, or it cannot be written.
    """
    check_is_free(folder)
    part = part_path(folder).absolute()  # Minari joins a relative path to itself
    try:
        shutil.rmtree(part, ignore_errors=True)
        _require_space(part, episodes)
        _write(part, origin, episodes)
        part.replace(folder)
    except OSError as error:
        raise DemonstrationFileError(f"{folder}: cannot be written: {error.strerror or error}") from error
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _require_space(part: Path, episodes: Sequence[Episode]) -> None:
    """Takes as much of the disk as the dataset will need, and gives it back: HDF5 crashes where a disk is full.

    Raises:
        OSError: there is not so much.
    """
    arrays = sum(
        array.nbytes
        for episode in episodes
        for array in (episode.observations, episode.continuous, episode.branches, episode.rewards)
    )
    try:
        with part.open("wb") as file:
            os.posix_fallocate(file.fileno(), 0, 2 * arrays + _EPISODE_BYTES * (len(episodes) + 64))
    finally:
        part.unlink(missing_ok=True)


def _write(folder: Path, origin: Origin, episodes: Sequence[Episode]) -> None:
    from minari import __version__ as minari_version  # noqa: PLC0415  (extra `learn`)
    from minari.data_collector import EpisodeBuffer  # noqa: PLC0415
    from minari.dataset.minari_storage import MinariStorage  # noqa: PLC0415

    layout = origin.layout
    settings = origin.settings.model_dump(mode="json")
    spec = copy.deepcopy(gymnasium.registry.get(f"honeyguide/{layout.task}-v0"))  # the registry's own must stay
    if spec is not None:  # a task of the user's own has none
        spec.kwargs = {**spec.kwargs, **settings}
    storage = MinariStorage.new(folder, observation_space(layout), action_space(layout), spec)
    storage.update_episodes(
        EpisodeBuffer(
            id=k,
            observations=episode.observations,
            actions=_actions(layout, episode),
            rewards=episode.rewards,
            terminations=[False] * (len(episode.rewards) - 1) + [not episode.is_truncated],
            truncations=[False] * (len(episode.rewards) - 1) + [episode.is_truncated],
        )
        for k, episode in enumerate(episodes)
    )
    storage.update_episode_metadata([_attributes(episode) for episode in episodes])
    storage.update_metadata(
        {
            "dataset_id": f"honeyguide/{layout.task.lower()}/{origin.expert}-v0",
            "minari_version": minari_version,
            "algorithm_name": f"honeyguide, {origin.expert} expert",
            "description": f"{len(episodes)} episodes of {layout.task}",
            LAYOUT_KEY: json.dumps(layout.record()),
            TASK_KEY: layout.task,
            SETTINGS_KEY: json.dumps(settings),
            "honeyguide_expert": origin.expert,
            "honeyguide_seed": origin.seed,
            "honeyguide_successes": sum(episode.is_success for episode in episodes),
        }
    )


def _actions(layout: Layout, episode: Episode) -> Any:
    if not layout.branches:
        return episode.continuous
    return episode.branches[:, 0] if len(layout.branches) == 1 else episode.branches


def _attributes(episode: Episode) -> dict[str, Any]:
    rewards = episode.rewards
    return {
        "success": episode.is_success,
        "outcome": episode.outcome.name.lower(),
        "rewards_sum": float(rewards.sum()),
        "rewards_mean": float(rewards.mean()),
        "rewards_std": float(rewards.std()),
        "rewards_max": float(rewards.max()),
        "rewards_min": float(rewards.min()),
    }
