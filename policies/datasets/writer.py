"""A dataset written episode by episode, in the format of demonstrations (`policies.experts.demonstration_file`).

In: episodes. Out: a Minari folder that appears when it is complete; never more of it in memory than one episode. The
same episodes give the same bytes. Where the task shows an image, observations are a group of `vector` and `image`, as
its Gymnasium environment's are; images that were only kept beside a vector are `infos/images`.
"""

import errno
import json
import os
import shutil
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from common.files import part_path
from policies.datasets.episodes import DatasetError, DatasetOrigin, EpisodeRows
from policies.experts.demonstration_file import LAYOUT_KEY, SETTINGS_KEY, TASK_KEY, check_is_free
from policies.tasks.gym_arrays import action_space, observation_space

MAIN_FILE, METADATA_FILE = "main_data.hdf5", "metadata.json"
CHUNK_ROWS = 1024  # read at once; 55 floats each: 220 KiB
REWARDS_KEY, NOTES_KEY, SEED_KEY = "honeyguide_rewards_by", "honeyguide_notes", "honeyguide_seed"
PILOT_KEY, SUCCESSES_KEY = "honeyguide_expert", "honeyguide_successes"
_SPARE_BYTES = 1 << 20  # of groups, attributes and the file's own: HDF5 crashes where a disk is full


class DatasetWriter:
    """Writes one dataset; used as a context, which removes what was written if it is left by an error.

    Args:
        folder: to be made.
        origin: what the dataset is of.

    Raises:
        DemonstrationFileError: something is there already, or its parent is missing.
        ModuleNotFoundError: Minari is not installed.
    """

    def __init__(self, folder: Path, origin: DatasetOrigin) -> None:
        check_is_free(folder)
        self._folder, self._part, self._origin = folder, part_path(folder).absolute(), origin
        self.episodes = self.steps = self.successes = 0

    def __enter__(self) -> Self:
        import h5py  # noqa: PLC0415  (extra `learn`)

        shutil.rmtree(self._part, ignore_errors=True)
        try:
            self._part.mkdir()
            self._require_space(0)
            self._file = h5py.File(self._part / MAIN_FILE, "w", track_order=True)
        except OSError as error:
            shutil.rmtree(self._part, ignore_errors=True)
            raise self._trouble(error) from error
        return self

    def add(self, episode: EpisodeRows) -> None:
        """Appends an episode.

        Raises:
            DatasetError: it is of another layout, or the disk is full.
        """
        layout = self._origin.layout
        if episode.observations.shape[1] != layout.observation_size:
            raise DatasetError(
                f"{self._folder}: an episode of {episode.observations.shape[1]} elements, not {layout.observation_size}"
            )
        if layout.image is not None and (episode.images is None or episode.images.shape[1:] != layout.image_shape):
            found = "none" if episode.images is None else episode.images.shape[1:]
            raise DatasetError(f"{self._folder}: an episode with images of shape {found}, not {layout.image_shape}")
        images = 0 if episode.images is None else episode.images.nbytes
        try:
            self._require_space(episode.observations.nbytes + episode.actions.nbytes + 32 * len(episode) + images)
            self._write(episode)
        except OSError as error:
            raise self._trouble(error) from error
        self.episodes += 1
        self.steps += len(episode)
        self.successes += episode.is_success

    def add_all(self, episodes: Iterable[EpisodeRows]) -> None:
        """Appends episodes, one after the other."""
        for episode in episodes:
            self.add(episode)

    def _write(self, episode: EpisodeRows) -> None:
        group = self._file.create_group(f"episode_{self.episodes}")
        steps, rewards = len(episode), episode.rewards.astype(np.float64)
        ends = np.zeros(steps, np.bool_)
        ends[-1] = True
        none = np.zeros(steps, np.bool_)
        actions = episode.actions
        has_image = self._origin.layout.image is not None
        columns: dict[str, Any] = {
            "observations/vector" if has_image else "observations": episode.observations.astype(np.float32),
            "actions": actions.astype(np.int64 if self._origin.layout.branches else np.float32),
            "rewards": rewards,
            "terminations": ends if episode.is_terminated else none,
            "truncations": none if episode.is_terminated else ends,
        }
        for name, column in columns.items():
            chunk = (min(CHUNK_ROWS, len(column)), *column.shape[1:])
            group.create_dataset(name, data=column, chunks=chunk, maxshape=(None, *column.shape[1:]), track_times=False)
        if episode.images is not None:
            name, chunk = "observations/image" if has_image else "infos/images", (1, *episode.images.shape[1:])
            group.create_dataset(
                name, data=episode.images, chunks=chunk, compression="gzip", compression_opts=1, track_times=False
            )
        group.attrs.update(
            {
                "id": self.episodes,
                "total_steps": steps,
                "success": episode.is_success,
                "outcome": episode.outcome,
                "rewards_sum": float(rewards.sum()),
                "rewards_mean": float(rewards.mean()),
                "rewards_std": float(rewards.std()),
                "rewards_max": float(rewards.max()),
                "rewards_min": float(rewards.min()),
                **{f"context_{name}": value for name, value in sorted(episode.context.items())},
            }
        )

    def _require_space(self, size: int) -> None:
        free = shutil.disk_usage(self._part).free
        if free < 2 * size + _SPARE_BYTES:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def _trouble(self, error: OSError) -> DatasetError:
        return DatasetError(f"{self._folder}: cannot be written: {error.strerror or error}")

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._file.close()
            if kind is None:
                if not self.episodes:
                    raise DatasetError(f"{self._folder}: nothing to write: no episode")
                metadata = _metadata(self)
                (self._part / METADATA_FILE).write_text(json.dumps(metadata), encoding="utf-8")
                self._part.replace(self._folder)
        except OSError as trouble:
            raise self._trouble(trouble) from trouble
        finally:
            shutil.rmtree(self._part, ignore_errors=True)

    @property
    def origin(self) -> DatasetOrigin:
        return self._origin

    @property
    def size_mb(self) -> float:
        """Of the data, as Minari counts it."""
        return round((self._part / MAIN_FILE).stat().st_size / 1e6, 1)


def _metadata(writer: DatasetWriter) -> dict[str, Any]:
    """Minari's keys, and ours."""
    from minari import __version__ as minari_version  # noqa: PLC0415  (extra `learn`)
    from minari.serialization import serialize_space  # noqa: PLC0415

    origin = writer.origin
    layout = origin.layout
    return {
        "total_episodes": writer.episodes,
        "total_steps": writer.steps,
        "data_format": "hdf5",
        "jpeg_encoding": False,
        "observation_space": serialize_space(observation_space(layout)),
        "action_space": serialize_space(action_space(layout)),
        "dataset_size": writer.size_mb,
        "dataset_id": f"honeyguide/{layout.task.lower()}/{file_word(origin.pilot)}-v0",
        "minari_version": minari_version,
        "algorithm_name": f"honeyguide, {origin.pilot}",
        "description": f"{writer.episodes} episodes of {layout.task}",
        LAYOUT_KEY: json.dumps(layout.record()),
        TASK_KEY: layout.task,
        SETTINGS_KEY: json.dumps(dict(origin.settings)),
        PILOT_KEY: origin.pilot,
        SEED_KEY: origin.seed,
        SUCCESSES_KEY: writer.successes,
        REWARDS_KEY: origin.rewards_by,
        NOTES_KEY: json.dumps(dict(origin.notes)),
    }


def file_word(text: str) -> str:
    """A text as part of a dataset's id: letters, digits and dashes."""
    return "".join(c if c.isalnum() else "-" for c in text.lower()).strip("-") or "unknown"
