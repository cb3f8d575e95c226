"""Datasets in D4RL's flat HDF5 (Fu et al. 2020), an episode at a time.

Columns of all steps in a row, `terminals` and `timeouts` marking the ends, `next_observations` beside them. Where
observations have an image, `observations` are their vectors and `images` lie beside them, row by row.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.files import part_path
from policies.datasets.episodes import DatasetError, EpisodeRows
from policies.datasets.reader import DatasetReader

_CHUNK = 4096  # rows
_IMAGE_CHUNK_BYTES = 1 << 18  # 16 images of 64 x 64 x 4: a chunk is inflated whole, whichever row is read


def export_d4rl(source: Path, target: Path) -> int:
    """One HDF5 file; returns how many steps it holds.

    Images are uint8: `images` (steps, height, width, channels), those of `observations`, and `final_images` (episodes,
    height, width, channels), those after each episode's last step. The image that belongs to row k of
    `next_observations` is `images[k + 1]`, or at the n-th end of an episode (`terminals | timeouts`) `final_images[n]`:
    none is stored twice. The attribute `layout` names the channels.

    Raises:
        DatasetError: the dataset cannot be read, or the file not be written.
    """
    import h5py  # noqa: PLC0415  (extra `learn`)

    check_target_is_free(target)
    part = part_path(target)
    try:
        with DatasetReader(source) as reader, h5py.File(part, "w") as file:
            has_image = reader.layout.image is not None
            for k in range(reader.count):
                episode = reader.episode(k, has_images=has_image)
                for name, rows in _d4rl_columns(episode).items():
                    if name not in file:
                        shape = rows.shape[1:]
                        file.create_dataset(
                            name, (0, *shape), rows.dtype, maxshape=(None, *shape), track_times=False, **_storage(rows)
                        )
                    size = len(file[name])
                    file[name].resize(size + len(rows), axis=0)
                    file[name][size:] = rows
            file.attrs["task"], file.attrs["layout"] = reader.layout.task, json.dumps(reader.layout.record())
            steps = reader.steps
        part.replace(target)
    except OSError as error:
        raise DatasetError(f"{target}: cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)
    return steps


def _d4rl_columns(episode: EpisodeRows) -> dict[str, NDArray[Any]]:
    ends = np.zeros(len(episode), np.bool_)
    ends[-1] = True
    none = np.zeros(len(episode), np.bool_)
    columns = {
        "observations": episode.observations[:-1].astype(np.float32),
        "next_observations": episode.observations[1:].astype(np.float32),
        "actions": episode.actions,
        "rewards": episode.rewards.astype(np.float32),
        "terminals": ends if episode.is_terminated else none,
        "timeouts": none if episode.is_terminated else ends,
    }
    if episode.images is not None:
        columns |= {"images": episode.images[:-1], "final_images": episode.images[-1:]}
    return columns


def _storage(rows: NDArray[Any]) -> dict[str, Any]:
    """How a column lies in the file: images are deflated, in chunks that hold as many of them as their size allows."""
    shape = rows.shape[1:]
    if rows.dtype != np.uint8:
        return {"chunks": (_CHUNK, *shape)}
    count = max(1, _IMAGE_CHUNK_BYTES // rows[0].nbytes)
    return {"chunks": (count, *shape), "compression": "gzip", "compression_opts": 1}


def check_target_is_free(target: Path) -> None:
    """Makes sure that an export can be written there.

    Raises:
        DatasetError: something is there already, or its parent is missing.
    """
    if target.exists():
        raise DatasetError(f"{target}: there is something of that name already")
    if not target.parent.is_dir():
        raise DatasetError(f"{target}: the folder it would lie in does not exist")
