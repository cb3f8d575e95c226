"""Datasets in the formats of others: D4RL's flat HDF5, and LeRobot's parquet folder.

An episode passes at a time. D4RL (Fu et al. 2020): columns of all steps in a row, `terminals` and `timeouts` marking
the ends, `next_observations` beside them. LeRobot 2.1: a parquet file per episode, and in `meta` info.json and a line
per episode of episodes.jsonl and episodes_stats.jsonl, without which its reader opens nothing.
"""

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.files import part_path
from policies.datasets.episodes import DatasetError, EpisodeRows
from policies.datasets.reader import DatasetReader

_CHUNK = 4096  # rows
_DECISION_HZ, _HOVER_HZ = 10, 50  # of the flown tasks
_EPISODES_PER_CHUNK = 1000  # LeRobot's chunks_size


def export_d4rl(source: Path, target: Path) -> int:
    """One HDF5 file; returns how many steps it holds.

    Raises:
        DatasetError: the dataset cannot be read, or the file not be written.
    """
    import h5py  # noqa: PLC0415  (extra `learn`)

    _check_is_free(target)
    part = part_path(target)
    try:
        with DatasetReader(source) as reader, h5py.File(part, "w") as file:
            _refuse_images(reader)
            columns: dict[str, Any] = {}
            for episode in reader:
                for name, rows in _d4rl_columns(episode).items():
                    if name not in columns:
                        shape = rows.shape[1:]
                        columns[name] = file.create_dataset(
                            name, (0, *shape), rows.dtype, maxshape=(None, *shape), chunks=(_CHUNK, *shape),
                            track_times=False,
                        )  # fmt: skip
                    size = len(columns[name])
                    columns[name].resize(size + len(rows), axis=0)
                    columns[name][size:] = rows
            file.attrs["task"], file.attrs["layout"] = reader.layout.task, json.dumps(reader.layout.record())
            steps = reader.steps
        part.replace(target)
    except OSError as error:
        raise DatasetError(f"{target}: cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)
    return steps


def _d4rl_columns(episode: EpisodeRows) -> dict[str, Any]:
    ends = np.zeros(len(episode), np.bool_)
    ends[-1] = True
    none = np.zeros(len(episode), np.bool_)
    return {
        "observations": episode.observations[:-1].astype(np.float32),
        "next_observations": episode.observations[1:].astype(np.float32),
        "actions": episode.actions,
        "rewards": episode.rewards.astype(np.float32),
        "terminals": ends if episode.is_terminated else none,
        "timeouts": none if episode.is_terminated else ends,
    }


def export_lerobot(source: Path, target: Path) -> int:
    """A folder of parquet files; returns how many steps it holds.

    Args:
        source: the dataset.
        target: to be made.

    Raises:
        DatasetError: the dataset cannot be read, or the folder not be written.
        ModuleNotFoundError: pyarrow is not installed.
    """
    from pyarrow import parquet  # noqa: PLC0415  (extra `lerobot`)

    _check_is_free(target)
    part = part_path(target)
    try:
        shutil.rmtree(part, ignore_errors=True)
        (part / "meta").mkdir(parents=True)
        lengths, first = [], 0
        with DatasetReader(source) as reader:
            _refuse_images(reader)
            fps = _HOVER_HZ if reader.layout.task == "Hover" else _DECISION_HZ
            for k, episode in enumerate(reader):
                folder = part / "data" / f"chunk-{k // _EPISODES_PER_CHUNK:03d}"
                folder.mkdir(parents=True, exist_ok=True)
                columns = _lerobot_columns(episode, k, first, fps)
                parquet.write_table(_arrow_table(columns), folder / f"episode_{k:06d}.parquet")
                found = {"episode_index": k, "stats": _statistics(columns)}
                _append_line(part / "meta" / "episodes_stats.jsonl", found)
                lengths.append(len(episode))
                first += len(episode)
            _write_meta(part / "meta", reader, lengths, fps)
        part.replace(target)
    except OSError as error:
        raise DatasetError(f"{target}: cannot be written: {error.strerror or error}") from error
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return first


def _lerobot_columns(episode: EpisodeRows, k: int, first: int, fps: int) -> dict[str, NDArray[Any]]:
    """Shape (steps,), or (steps, elements) of what has more than one, as LeRobot's features have them."""
    steps = len(episode)
    vectors = {
        "observation.state": episode.observations[:-1].astype(np.float32),
        "action": episode.actions.reshape(steps, -1).astype(np.float32),
    }
    return {
        **{name: rows[:, 0] if rows.shape[1] == 1 else rows for name, rows in vectors.items()},
        "next.reward": episode.rewards.astype(np.float32),
        "next.done": np.arange(steps) == steps - 1,
        "next.success": (np.arange(steps) == steps - 1) & episode.is_success,
        "timestamp": (np.arange(steps) / fps).astype(np.float32),
        "frame_index": np.arange(steps, dtype=np.int64),
        "episode_index": np.full(steps, k, np.int64),
        "index": np.arange(first, first + steps, dtype=np.int64),
        "task_index": np.zeros(steps, np.int64),
    }


def _arrow_table(columns: Mapping[str, NDArray[Any]]) -> Any:
    import pyarrow as pa  # noqa: PLC0415  (extra `lerobot`)

    arrays = {
        name: pa.array(rows) if rows.ndim == 1 else pa.FixedSizeListArray.from_arrays(rows.ravel(), rows.shape[1])
        for name, rows in columns.items()
    }
    return pa.table(arrays)


def _statistics(columns: Mapping[str, NDArray[Any]]) -> dict[str, dict[str, Any]]:
    """Of each column of an episode: least, most, mean and deviation of each element, and how many rows."""
    found: dict[str, dict[str, Any]] = {}
    for name, column in columns.items():
        rows = column.reshape(len(column), -1)
        moments = {"min": rows.min(0), "max": rows.max(0), "mean": rows.mean(0), "std": rows.std(0)}
        found[name] = {key: value.tolist() for key, value in moments.items()} | {"count": [len(rows)]}
    return found


def _append_line(path: Path, record: Mapping[str, Any]) -> None:
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(record) + "\n")


def _write_meta(folder: Path, reader: DatasetReader, lengths: list[int], fps: int) -> None:
    layout = reader.layout
    names = [element.name for element in layout.frame] * layout.stack
    acted = [element.name for element in layout.continuous] or [branch.name for branch in layout.branches]
    scalar = {"next.reward": "float32", "next.done": "bool", "next.success": "bool", "timestamp": "float32"}
    scalar |= dict.fromkeys(("frame_index", "episode_index", "index", "task_index"), "int64")
    features: dict[str, Any] = {
        "observation.state": {"dtype": "float32", "shape": [len(names)], "names": names},
        "action": {"dtype": "float32", "shape": [len(acted)], "names": acted},
        **{name: {"dtype": dtype, "shape": [1], "names": None} for name, dtype in scalar.items()},
    }
    info = {
        "codebase_version": "v2.1",
        "robot_type": "drone",
        "total_episodes": len(lengths),
        "total_frames": sum(lengths),
        "total_tasks": 1,
        "total_videos": 0,
        "total_chunks": (len(lengths) - 1) // _EPISODES_PER_CHUNK + 1,
        "chunks_size": _EPISODES_PER_CHUNK,
        "fps": fps,
        "splits": {"train": f"0:{len(lengths)}"},
        "data_path": "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
        "video_path": None,
        "features": features,
    }
    (folder / "info.json").write_text(json.dumps(info, indent=2), encoding="utf-8")
    lines = [json.dumps({"episode_index": k, "tasks": [layout.task], "length": n}) for k, n in enumerate(lengths)]
    (folder / "episodes.jsonl").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "tasks.jsonl").write_text(json.dumps({"task_index": 0, "task": layout.task}) + "\n", encoding="utf-8")


def _refuse_images(reader: DatasetReader) -> None:
    if reader.layout.image is not None:
        raise DatasetError(f"{reader.folder}: observations with images are not exported: vectors alone are")


def _check_is_free(target: Path) -> None:
    if target.exists():
        raise DatasetError(f"{target}: there is something of that name already")
    if not target.parent.is_dir():
        raise DatasetError(f"{target}: the folder it would lie in does not exist")
