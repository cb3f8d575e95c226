"""A dataset read from disk, an episode or a slice at a time: nothing of it is kept in memory.

In: a folder that `writer.py` or `honeyguide demonstrate` made. Out: its layout and origin, and episodes in order.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from policies.datasets.episodes import DatasetError, DatasetOrigin, EpisodeRows
from policies.datasets.writer import (
    MAIN_FILE,
    METADATA_FILE,
    NOTES_KEY,
    PILOT_KEY,
    REWARDS_KEY,
    SEED_KEY,
    SUCCESSES_KEY,
)
from policies.experts.demonstration_file import LAYOUT_KEY, SETTINGS_KEY
from policies.tasks.layout import Layout

_CONTEXT = "context_"


class DatasetReader:
    """One dataset, opened for reading; used as a context.

    Args:
        folder: of the dataset.

    Raises:
        DatasetError: it is none, or was not recorded by honeyguide.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        path = folder / METADATA_FILE
        try:
            record = json.loads(path.read_text(encoding="utf-8"))
            self.count, self.steps = int(record["total_episodes"]), int(record["total_steps"])
            self.successes = int(record.get(SUCCESSES_KEY, 0))
        except FileNotFoundError as error:
            raise DatasetError(f"{folder}: is no dataset: {METADATA_FILE} is missing") from error
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise DatasetError(f"{path}: cannot be read: {error}") from error
        if LAYOUT_KEY not in record:
            raise DatasetError(f"{folder}: was not recorded by honeyguide (no {LAYOUT_KEY} in {METADATA_FILE})")
        try:
            self.origin = DatasetOrigin(
                layout=Layout.from_record(json.loads(record[LAYOUT_KEY])),
                settings=json.loads(record[SETTINGS_KEY]),
                pilot=str(record.get(PILOT_KEY, "unknown")),
                seed=int(record.get(SEED_KEY, 0)),
                rewards_by=str(record.get(REWARDS_KEY, "truth")),
                notes=json.loads(record.get(NOTES_KEY, "{}")),
            )
        except (ValueError, KeyError, TypeError) as error:
            raise DatasetError(f"{path}: cannot be read: {error}") from error

    @property
    def layout(self) -> Layout:
        return self.origin.layout

    def __enter__(self) -> Self:
        import h5py  # noqa: PLC0415  (extra `learn`)

        try:
            self._file = h5py.File(self.folder / MAIN_FILE, "r")
        except OSError as error:
            raise DatasetError(f"{self.folder / MAIN_FILE}: cannot be read: damaged or missing") from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def __iter__(self) -> Iterator[EpisodeRows]:
        return (self.episode(k) for k in range(self.count))

    def episode(self, k: int, *, has_images: bool = True) -> EpisodeRows:
        """An episode, read as a whole, or all of it but its images.

        Raises:
            DatasetError: it is damaged, or there is none of this number.
        """
        try:
            group = self._file[f"episode_{k}"]
            names = ("observations/vector", "observations/image")
            vectors, pixels = names if self.layout.image is not None else ("observations", "infos/images")
            is_read = has_images and (self.layout.image is not None or pixels in group)
            attributes = dict(group.attrs)
            return EpisodeRows(
                observations=group[vectors][()],
                actions=group["actions"][()],
                rewards=group["rewards"][()],
                is_terminated=bool(group["terminations"][-1]),
                outcome=str(attributes.get("outcome", "running")),
                images=group[pixels][()] if is_read else None,
                context={n.removeprefix(_CONTEXT): v for n, v in attributes.items() if n.startswith(_CONTEXT)},
            )
        except KeyError as error:
            raise DatasetError(f"{self.folder}: episode {k} is missing or lacks a part: {error}") from error
        except (OSError, IndexError) as error:
            raise DatasetError(f"{self.folder}: episode {k}: cannot be read: {error}") from error

    def summary(self, k: int) -> dict[str, Any]:
        """Steps, return, outcome and context of an episode, without its rows."""
        attributes = dict(self._file[f"episode_{k}"].attrs)
        return {
            "steps": int(attributes["total_steps"]),
            "return": float(attributes["rewards_sum"]),
            "outcome": str(attributes.get("outcome", "running")),
            **{name: value for name, value in attributes.items() if name.startswith(_CONTEXT)},
        }

    def column(self, k: int, name: str) -> NDArray[Any]:
        """One column of an episode: observations, actions or rewards."""
        return np.asarray(self._file[f"episode_{k}"][name][()])
