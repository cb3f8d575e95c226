"""What an expert did, read from Minari datasets, as one flat batch of transitions for GAIL and behavioural cloning.

A path is ML-Agents' `demo_path`: a dataset's folder, a file in it, a folder of several datasets, or the id of a
dataset under Minari's root on this machine. Nothing is downloaded. A dataset says in its metadata which layout it was
recorded with; another task or preset is refused.
"""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from policies.experts.demonstration_file import LAYOUT_KEY, SETTINGS_KEY
from policies.learn.signals.signal import Transitions
from policies.tasks.layout import Layout
from policies.tasks.settings_difference import settings_difference

_METADATA_FILE = "metadata.json"


class DemonstrationError(ValueError):
    """Demonstrations that cannot be read; the message is one sentence for the user."""


def load_demonstrations(demo_path: str, layout: Layout) -> Transitions:
    """All transitions of all episodes at a path, in the order they were recorded.

    Args:
        demo_path: a dataset's folder, a file in it, a folder of datasets, or the id of a local dataset.
        layout: of the policy that is to learn from them.

    Returns:
        Transitions, (decisions,), at least one.

    Raises:
        DemonstrationError: nothing there, no episode in it, or not readable.
        LayoutError: recorded with another task or preset.
    """
    datasets = [_read_dataset(folder, layout) for folder in data_folders(demo_path)]
    episodes = [episode for dataset in datasets for episode in dataset]
    if not episodes:
        raise DemonstrationError(f"{demo_path}: has no episodes")
    columns = [np.concatenate(column) for column in zip(*episodes, strict=True)]
    return Transitions(*(torch.from_numpy(column) for column in columns))


def check_demonstrations(demo_path: str, layout: Layout) -> None:
    """Makes sure that there are demonstrations at a path, of this task and preset; episodes are not read.

    Raises:
        DemonstrationError: nothing there, or not readable.
        LayoutError: recorded with another task or preset.
    """
    for folder in data_folders(demo_path):
        layout.require(recorded_layout(folder), str(folder))


def data_folders(demo_path: str) -> list[Path]:
    """The folders with a metadata.json that a path means.

    Raises:
        DemonstrationError: there is none.
    """
    path = Path(demo_path)
    if path.is_file():
        path = path.parent
    elif not path.exists():
        root = Path(os.environ.get("MINARI_DATASETS_PATH") or Path.home() / ".minari" / "datasets")
        path = root / demo_path
        if not path.is_dir():
            raise DemonstrationError(f"{demo_path}: no such file or folder, and no dataset of this name in {root}")
    folders = sorted(file.parent for file in path.rglob(_METADATA_FILE) if file.parent.suffix != ".part")
    if not folders:
        raise DemonstrationError(f"{demo_path}: no Minari dataset there ({_METADATA_FILE} is missing)")
    return folders


def check_settings(demo_path: str, task: str, settings: Mapping[str, Any]) -> None:
    """Makes sure that what was recorded at a path saw, did and was paid for the same as under these settings.

    Args:
        demo_path: of demonstrations that are there, of the task.
        task: its name.
        settings: of it, as JSON.

    Raises:
        DemonstrationError: recorded under others.
    """
    for folder in data_folders(demo_path):
        difference = settings_difference(task, settings, recorded_settings(folder))
        if difference:
            raise DemonstrationError(f"{folder}: recorded with other settings: {difference}")


_Episode = tuple[NDArray[Any], ...]


def recorded_layout(folder: Path) -> Layout:
    """The layout that a dataset was recorded with.

    Raises:
        DemonstrationError: its metadata cannot be read, or is not ours.
    """
    try:
        record = json.loads((folder / _METADATA_FILE).read_text(encoding="utf-8")).get(LAYOUT_KEY)
        recorded = Layout.from_record(json.loads(record)) if record else None
    except (OSError, AttributeError, KeyError, ValueError, TypeError) as error:
        raise DemonstrationError(
            f"{folder}: not a readable Minari dataset: {_METADATA_FILE}: {_first_line(error)}"
        ) from error
    if recorded is None:
        raise DemonstrationError(f"{folder}: was not recorded by honeyguide (no {LAYOUT_KEY} in {_METADATA_FILE})")
    return recorded


def recorded_settings(folder: Path) -> dict[str, Any]:
    """The settings of the task that a dataset was recorded with, as JSON; none: it does not say.

    Raises:
        DemonstrationError: its metadata cannot be read.
    """
    try:
        record = json.loads((folder / _METADATA_FILE).read_text(encoding="utf-8")).get(SETTINGS_KEY)
        return dict(json.loads(record)) if record else {}
    except (OSError, AttributeError, ValueError, TypeError) as error:
        raise DemonstrationError(
            f"{folder}: not a readable Minari dataset: {_METADATA_FILE}: {_first_line(error)}"
        ) from error


def _read_dataset(folder: Path, layout: Layout) -> list[_Episode]:
    """The episodes of one dataset as columns in the order of `Transitions`."""
    from minari.dataset.minari_storage import MinariStorage  # noqa: PLC0415  (only who has demonstrations pays for it)

    layout.require(recorded_layout(folder), str(folder))
    if layout.image is not None:
        raise DemonstrationError(f"{folder}: holds images, and demonstrations are read without")
    try:
        storage = MinariStorage.read(folder)
        count = int(storage.total_episodes)
        episodes = list(storage.get_episodes(range(count))) if count else []  # an empty dataset has an empty file
    except (OSError, KeyError, ValueError, TypeError, AssertionError) as error:
        raise DemonstrationError(f"{folder}: not a readable Minari dataset: {_first_line(error)}") from error
    return [_columns(episode, layout, f"{folder}: episode {k}") for k, episode in enumerate(episodes)]


def _first_line(error: Exception) -> str:
    return (str(error) or type(error).__name__).splitlines()[0]


def _columns(episode: dict[str, Any], layout: Layout, source: str) -> _Episode:
    observations = np.asarray(episode["observations"], np.float32)
    actions = np.asarray(episode["actions"])
    rewards = np.asarray(episode["rewards"], np.float32)
    count = len(rewards)
    is_ended = np.asarray(episode["terminations"], np.bool_) | np.asarray(episode["truncations"], np.bool_)
    if observations.shape != (count + 1, layout.observation_size):
        raise DemonstrationError(
            f"{source}: {count} rewards need observations of shape {(count + 1, layout.observation_size)}, "
            f"not {observations.shape}"
        )
    width = len(layout.branches) or len(layout.continuous)
    if actions.size != count * width:
        raise DemonstrationError(f"{source}: {count} rewards need {count * width} actions, not {actions.size}")
    actions = actions.reshape(count, width)
    if not (np.isfinite(observations).all() and np.isfinite(actions).all() and np.isfinite(rewards).all()):
        raise DemonstrationError(f"{source}: holds a value that is not finite")
    if layout.branches:
        continuous, branches = np.zeros((count, 0), np.float32), actions.astype(np.int64)
        if (branches < 0).any() or (branches >= np.array(layout.branch_sizes)).any():
            raise DemonstrationError(f"{source}: holds a choice that no branch has")
    else:
        continuous, branches = actions.astype(np.float32).clip(-1.0, 1.0), np.zeros((count, 0), np.int64)
    return observations[:-1], observations[1:], continuous, branches, rewards, is_ended
