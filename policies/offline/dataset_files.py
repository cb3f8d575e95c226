"""Minari datasets as one table of float32 rows, written chunk by chunk: into memory, or into a file that is mapped.

A row is an observation with what was done there: elements, continuous actions, branches (as floats), reward,
is_terminated, is_ended. Each episode has one row more than decisions, for what it saw last; it holds zeros beside its
observation. So the observation after a decision is that of the next row. Images, if there are any, are a second table.
"""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.files import part_path
from policies.learn.rollout.demonstrations import (
    DemonstrationError,
    recorded_layout,
    recorded_settings,
)
from policies.tasks.layout import Layout
from policies.tasks.settings_difference import settings_difference

CHUNK_ROWS = 65_536  # read and written at once,
_IMAGE_BYTES = 64 * 2**20  # of images at most
_VERSION = 1  # of the table in cache files
_DATA_FILE = "main_data.hdf5"
_ENDS = 3  # columns behind the actions: reward, is_terminated, is_ended


@dataclass(frozen=True, slots=True)
class Chunk:
    """Consecutive rows of one episode."""

    rows: NDArray[np.float32]  # (rows, row width)
    images: NDArray[np.uint8] | None  # (rows, height, width, channels)


def row_width(layout: Layout) -> int:
    """Floats of a row."""
    return layout.observation_size + len(layout.continuous) + len(layout.branches) + _ENDS


def row_count(folders: Sequence[Path]) -> int:
    """Rows that datasets make together: decisions, and one for each episode's end.

    Raises:
        DemonstrationError: a dataset that cannot be read, or no decision at all.
    """
    count = sum(len(group["rewards"]) + 1 for folder in folders for _source, group in _episodes(folder))
    if not count:
        raise DemonstrationError(f"{folders[0]}: has no episodes")
    return count


def chunks(folders: Sequence[Path], layout: Layout, *, has_images: bool = True) -> Iterator[Chunk]:
    """All rows of datasets in the order they were recorded, checked; without their images if they are not wanted.

    Raises:
        DemonstrationError: a dataset that cannot be read, or holds what the layout cannot.
    """
    size = CHUNK_ROWS if layout.image is None else max(1, min(CHUNK_ROWS, _IMAGE_BYTES // prod(layout.image_shape)))
    for folder in folders:
        for source, group in _episodes(folder):
            count = len(group["rewards"])
            if not count:
                raise DemonstrationError(f"{source}: has no decisions")
            _check_shapes(group, layout, source)
            for first in range(0, count + 1, size):
                span = slice(first, min(first + size, count + 1))
                yield _chunk(group, layout, span, source, has_images=has_images)


def cache_name(folders: Sequence[Path], layout: Layout) -> str:
    """Of the file that datasets as they are now would be kept in: another one when one of them has changed.

    Raises:
        DemonstrationError: a dataset without its data.
    """
    parts: list[Any] = [_VERSION, layout.record()]
    for folder in folders:
        path = folder / _DATA_FILE
        try:
            status = path.stat()
        except OSError as error:
            raise DemonstrationError(f"{path}: cannot be read: {error.strerror}") from error
        parts.append([str(folder.resolve()), status.st_size, status.st_mtime_ns])
    return f"rows-{hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:16]}"


def write_table(path: Path, shape: tuple[int, ...], dtype: Any, blocks: Iterator[NDArray[Any]]) -> None:
    """Writes a table block by block; the file appears when it is complete.

    Raises:
        OSError: it cannot be written.
    """
    part = part_path(path)
    try:
        with part.open("wb") as file:
            header = {"descr": np.lib.format.dtype_to_descr(np.dtype(dtype)), "fortran_order": False, "shape": shape}
            np.lib.format.write_array_header_2_0(file, header)
            for block in blocks:
                file.write(np.ascontiguousarray(block, dtype).data)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def check_layouts(folders: Sequence[Path], layout: Layout | None) -> Layout:
    """The layout that all datasets were recorded with, which is that of the policy if there is one.

    Raises:
        DemonstrationError: metadata that cannot be read, or datasets of other settings than the first.
        LayoutError: recorded with another task or preset.
    """
    expected = layout or recorded_layout(folders[0])
    settings = recorded_settings(folders[0])
    for folder in folders:
        expected.require(recorded_layout(folder), str(folder))
        difference = settings_difference(expected.task, settings, recorded_settings(folder))
        if difference:
            raise DemonstrationError(f"{folder}: recorded with other settings than {folders[0]}: {difference}")
    return expected


def _episodes(folder: Path) -> Iterator[tuple[str, Any]]:
    """The HDF5 groups of a dataset's episodes in their order, each with what messages call it."""
    import h5py  # noqa: PLC0415  (extra `learn`)

    path = folder / _DATA_FILE
    try:
        with h5py.File(path, "r") as file:
            for k in range(len(file)):
                name = f"episode_{k}"
                if name not in file or "rewards" not in file[name]:
                    raise DemonstrationError(
                        f"{folder}: not a readable Minari dataset: {name} is missing or incomplete"
                    )
                yield f"{folder}: episode {k}", file[name]
    except OSError as error:
        first_line = (str(error) or type(error).__name__).splitlines()[0]
        raise DemonstrationError(f"{folder}: not a readable Minari dataset: {first_line}") from error


def _check_shapes(group: Any, layout: Layout, source: str) -> None:
    missing = [key for key in ("observations", "actions", "terminations", "truncations") if key not in group]
    if missing:
        raise DemonstrationError(f"{source}: not a readable Minari dataset: {missing[0]} is missing")
    count = len(group["rewards"])
    vectors, images = _parts(group, layout, source)
    expected: list[tuple[str, Any, tuple[int, ...]]] = [
        ("observations", vectors, (count + 1, layout.observation_size)),
        ("terminations", group["terminations"], (count,)),
        ("truncations", group["truncations"], (count,)),
    ]
    if layout.image is not None:
        expected.append(("images", images, (count + 1, *layout.image_shape)))
    for what, array, shape in expected:
        if array.shape != shape:
            raise DemonstrationError(f"{source}: {count} rewards need {what} of shape {shape}, not {array.shape}")
    width = len(layout.branches) or len(layout.continuous)
    if group["actions"].size != count * width:
        raise DemonstrationError(f"{source}: {count} rewards need {count * width} actions, not {group['actions'].size}")


def _parts(group: Any, layout: Layout, source: str) -> tuple[Any, Any]:
    """The datasets of vectors and of images, which a layout without an image has not."""
    observations = group["observations"]
    if layout.image is None:
        return observations, None
    if not hasattr(observations, "keys") or {"vector", "image"} - set(observations.keys()):
        raise DemonstrationError(f"{source}: holds no images, and {layout.task} as it is set shows one")
    return observations["vector"], observations["image"]


def _chunk(group: Any, layout: Layout, span: slice, source: str, *, has_images: bool) -> Chunk:
    """Rows of an episode; the last one of all has only an observation."""
    count = len(group["rewards"])
    done = slice(span.start, min(span.stop, count))
    vectors, images = _parts(group, layout, source)
    rows = np.zeros((span.stop - span.start, row_width(layout)), np.float32)
    n = layout.observation_size
    rows[:, :n] = vectors[span]
    decisions = rows[: done.stop - done.start]
    actions = np.asarray(group["actions"][done]).reshape(len(decisions), len(layout.branches) or len(layout.continuous))
    if layout.branches and ((actions < 0).any() or (actions >= np.array(layout.branch_sizes)).any()):
        raise DemonstrationError(f"{source}: holds a choice that no branch has")
    decisions[:, n:-_ENDS] = actions
    if not layout.branches:
        decisions[:, n:-_ENDS].clip(-1.0, 1.0, out=decisions[:, n:-_ENDS])
    decisions[:, -3] = group["rewards"][done]
    decisions[:, -2] = group["terminations"][done]
    decisions[:, -1] = decisions[:, -2] + np.asarray(group["truncations"][done]) > 0
    if not np.isfinite(rows).all():
        raise DemonstrationError(f"{source}: holds a value that is not finite")
    is_last = np.arange(done.start, done.stop) == count - 1
    if decisions[~is_last, -1].any():
        raise DemonstrationError(f"{source}: goes on after a decision that ended it")
    decisions[is_last, -1] = 1.0  # what was cut without a word was cut
    return Chunk(rows, np.asarray(images[span], np.uint8) if has_images and images is not None else None)
