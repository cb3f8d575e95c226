"""The store of offline training: recorded decisions as one float32 table, from which minibatches are gathered.

In: folders of Minari datasets that `honeyguide` wrote. Out: views of their columns, statistics, and minibatches as
`ReplayBatch`. A small table lies in memory. A large one is a file beside its dataset, made chunk by chunk, whole or not
at all, mapped into memory, and made anew when a dataset has changed: a million decisions are never in memory at once.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from policies.learn.rollout.demonstrations import DemonstrationError, data_folders
from policies.learn.rollout.replay_buffer import ReplayBatch
from policies.offline.dataset_files import (
    CHUNK_ROWS,
    cache_name,
    check_layouts,
    chunks,
    row_count,
    row_width,
    write_table,
)
from policies.tasks.layout import Layout

MEMORY_LIMIT = 512 * 2**20  # bytes of tables that are kept in memory (guess: a small part of any machine's)


@dataclass(frozen=True, slots=True)
class Statistics:
    """Of all observations and rewards."""

    mean: Tensor  # (elements,) float64, of observations
    variance: Tensor  # (elements,) float64
    reward_mean: float  # of a decision
    reward_deviation: float


class OfflineStore:
    """Recorded decisions of one layout. Row r + 1 holds the observation after the decision in row r."""

    def __init__(self, layout: Layout, rows: NDArray[np.float32], images: NDArray[np.uint8] | None = None) -> None:
        """A store on tables as `dataset_files` makes them.

        Args:
            layout: of observations and actions.
            rows: shape (decisions + episodes, row width), writable.
            images: shape (decisions + episodes, height, width, channels).
        """
        self.layout = layout
        self.rows = torch.from_numpy(rows)
        self.images = None if images is None else torch.from_numpy(images)
        n, width = layout.observation_size, rows.shape[1]
        self._widths = [n, len(layout.continuous), len(layout.branches), 1, 1, 1, n]
        # A row and the next row's observation as one: an overlapping view, so that a batch is gathered in one go.
        self._pairs = self.rows.as_strided((len(rows) - 1, width + n), (width, 1))
        columns = torch.split(self.rows, self._widths[:-1], dim=1)
        self.observations: Tensor = columns[0]  # (rows, elements), views all of them
        self.continuous: Tensor = columns[1]  # (rows, continuous actions)
        self.branches: Tensor = columns[2]  # (rows, branches) float32
        self.rewards: Tensor = columns[3][:, 0]  # (rows,)
        self.is_terminated: Tensor = columns[4][:, 0]  # (rows,) 1.0 where nothing follows
        self.is_ended: Tensor = columns[5][:, 0]  # (rows,) 1.0 also where the time was up
        ends = _flat_nonzero(rows[:, -1])
        self.starts = torch.from_numpy(np.concatenate(([0], ends[:-1] + 2)))  # (episodes,) rows of first decisions
        self.lengths = torch.from_numpy(ends + 1) - self.starts  # (episodes,) decisions
        is_decision = np.ones(len(rows), dtype=np.bool_)
        is_decision[ends + 1] = False
        self.decisions = torch.from_numpy(np.flatnonzero(is_decision))  # (decisions,) rows of decisions

    def __len__(self) -> int:
        """Decisions."""
        return len(self.decisions)

    @property
    def episode_count(self) -> int:
        return len(self.starts)

    def take(self, rows: Tensor) -> ReplayBatch:
        """Copies of the decisions in these rows (`decisions` has them), shape (B,)."""
        columns = torch.split(self._pairs.index_select(0, rows), self._widths, dim=1)
        before, continuous, branches, rewards, is_terminated, is_ended, after = columns
        ends = is_terminated[:, 0], is_ended[:, 0] > 0.0
        return ReplayBatch(before, after, continuous, branches.long(), rewards[:, 0], *ends)

    def in_order(self, size: int = CHUNK_ROWS) -> Iterator[ReplayBatch]:
        """All decisions in the order they were recorded, so many at a time."""
        for rows in torch.split(self.decisions, size):
            yield self.take(rows)

    def episode_returns(self) -> Tensor:
        """The sum of each episode's rewards, shape (episodes,), float64."""
        return torch.stack([self.rewards[first : first + count].double().sum() for first, count in self._spans()])

    def statistics(self) -> Statistics:
        """Of all observations, also those that episodes end with, and of the decisions' rewards."""
        count, n = len(self.rows), self.layout.observation_size
        totals = torch.zeros(2, n, dtype=torch.float64)
        paid = torch.zeros(2, dtype=torch.float64)
        base = self.observations[0].double()  # sums of squares are taken from here, so that they keep their digits
        for first in range(0, count, CHUNK_ROWS):
            apart = self.observations[first : first + CHUNK_ROWS].double() - base
            totals += torch.stack((apart.sum(0), apart.square().sum(0)))
            rewards = self.rewards[first : first + CHUNK_ROWS].double()
            paid += torch.stack((rewards.sum(), rewards.square().sum()))
        mean = totals[0] / count
        variance = (totals[1] / count - mean.square()).clamp(min=0.0)
        reward_mean, reward_square = (paid / len(self)).tolist()
        return Statistics(
            base + mean, variance, reward_mean, max(0.0, reward_square - reward_mean * reward_mean) ** 0.5
        )

    def identity(self) -> dict[str, float]:
        """What tells this store from others, so that a run is not gone on with on other data."""
        statistics = self.statistics()
        return {
            "decisions": len(self),
            "episodes": self.episode_count,
            "observation_sum": float(statistics.mean.sum()),
            "reward_mean": statistics.reward_mean,
        }

    def _spans(self) -> Iterator[tuple[int, int]]:
        """First row and number of decisions of each episode."""
        yield from zip(self.starts.tolist(), self.lengths.tolist(), strict=True)


def open_store(
    paths: Sequence[str],
    layout: Layout | None = None,
    *,
    cache: Path | None = None,
    memory_limit: int = MEMORY_LIMIT,
) -> OfflineStore:
    """Opens datasets; several are one after the other.

    Args:
        paths: as `demo_path` of demonstrations: folders of datasets, or ids of local ones.
        layout: of the policy that is to learn from them; none: that of the first dataset.
        cache: folder of the mapped file; none: that of the first dataset.
        memory_limit: [bytes] of tables that are held in memory; larger ones are mapped.

    Raises:
        DemonstrationError: nothing there, not readable, or a cache that cannot be written.
        LayoutError: recorded with another task or preset.
    """
    if not paths:
        raise DemonstrationError("no dataset is named")
    folders = [folder for path in paths for folder in data_folders(path)]
    layout = check_layouts(folders, layout)
    count = row_count(folders)
    row_bytes = 4 * row_width(layout) + int(np.prod(layout.image_shape))
    if count * row_bytes <= memory_limit:
        made = list(chunks(folders, layout))
        images = [chunk.images for chunk in made if chunk.images is not None]
        rows = np.concatenate([chunk.rows for chunk in made])
        return OfflineStore(layout, rows, np.concatenate(images) if images else None)
    try:
        return _mapped(folders, layout, cache or folders[0], count)
    except OSError as error:
        place = error.filename or cache or folders[0]
        raise DemonstrationError(f"{place}: the cache cannot be written: {error.strerror or error}") from error


def _mapped(folders: Sequence[Path], layout: Layout, cache: Path, count: int) -> OfflineStore:
    """The store on mapped files, which are made if they are not there; those of an older dataset are removed."""
    name = cache_name(folders, layout)
    tables: dict[Path, tuple[tuple[int, ...], Any]] = {cache / f"{name}.npy": ((count, row_width(layout)), np.float32)}
    if layout.image is not None:
        tables[cache / f"{name}-images.npy"] = ((count, *layout.image_shape), np.uint8)
    for path, (shape, dtype) in tables.items():
        if path.exists():
            continue
        cache.mkdir(parents=True, exist_ok=True)
        made = chunks(folders, layout, has_images=dtype is np.uint8)
        blocks = (chunk.rows if dtype is np.float32 else chunk.images for chunk in made)
        write_table(path, shape, dtype, (block for block in blocks if block is not None))
    if cache == folders[0]:  # a folder of the user's choice may hold those of other datasets
        for old in cache.glob("rows-*.npy"):
            if old not in tables:
                old.unlink(missing_ok=True)
    arrays = [np.load(path, mmap_mode="c") for path in tables]  # "c": torch wants memory that may be written
    return OfflineStore(layout, *arrays)


def _flat_nonzero(column: NDArray[np.float32]) -> NDArray[np.int64]:
    """Where a column is not zero, read chunk by chunk."""
    parts = [first + np.flatnonzero(column[first : first + CHUNK_ROWS]) for first in range(0, len(column), CHUNK_ROWS)]
    return np.concatenate(parts).astype(np.int64)
