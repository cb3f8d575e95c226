"""Datasets in LeRobot's format 2.1, an episode at a time.

A parquet file per episode, and in `meta` info.json and a line per episode of episodes.jsonl and episodes_stats.jsonl,
without which its reader opens nothing. Images are PNGs, without loss, in the parquet files. The format has images of
three channels only: red, green and blue become `observation.images.front`, and every other channel, as depth, an image
of its own, `observation.images.depth`, grey, with the same byte in all three.
"""

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from common.files import part_path
from policies.datasets.episodes import DatasetError, EpisodeRows
from policies.datasets.exporting import check_target_is_free
from policies.datasets.reader import DatasetReader
from policies.tasks.layout import Layout

_DECISION_HZ, _HOVER_HZ = 10, 50  # of the flown tasks
_EPISODES_PER_CHUNK = 1000  # LeRobot's chunks_size
_COLOURS = ("red", "green", "blue")
_SCALARS = {"next.reward": "float32", "next.done": "bool", "next.success": "bool", "timestamp": "float32"}
_SCALARS |= dict.fromkeys(("frame_index", "episode_index", "index", "task_index"), "int64")


def export_lerobot(source: Path, target: Path) -> int:
    """A folder of parquet files; returns how many steps it holds.

    Images are of shape (height, width, 3), bytes as observed: `observation.images.front` is red, green and blue,
    `observation.images.depth` (any channel but these, by its name) that channel thrice, for the format has no depth.

    Args:
        source: the dataset.
        target: to be made.

    Raises:
        DatasetError: the dataset cannot be read, or the folder not be written.
        ModuleNotFoundError: pyarrow is not installed.
    """
    from pyarrow import parquet  # noqa: PLC0415  (extra `lerobot`)

    check_target_is_free(target)
    part = part_path(target)
    try:
        shutil.rmtree(part, ignore_errors=True)
        (part / "meta").mkdir(parents=True)
        lengths, first = [], 0
        with DatasetReader(source) as reader:
            cameras, features = _cameras(reader.layout), _features(reader.layout)
            fps = _HOVER_HZ if reader.layout.task == "Hover" else _DECISION_HZ
            for k in range(reader.count):
                episode = reader.episode(k, has_images=bool(cameras))
                folder = part / "data" / f"chunk-{k // _EPISODES_PER_CHUNK:03d}"
                folder.mkdir(parents=True, exist_ok=True)
                columns = _lerobot_columns(episode, k, first, fps) | _images(episode, cameras)
                parquet.write_table(_arrow_table(columns, features), folder / f"episode_{k:06d}.parquet")
                found = {"episode_index": k, "stats": _statistics(columns)}
                _append_line(part / "meta" / "episodes_stats.jsonl", found)
                lengths.append(len(episode))
                first += len(episode)
            _write_meta(part / "meta", reader.layout.task, features, lengths, fps)
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


def _cameras(layout: Layout) -> dict[str, list[int]]:
    """Which channels of an observation's image are red, green and blue of each exported one."""
    channels = layout.image.channels if layout.image is not None else ()
    colours = [channels.index(name) for name in _COLOURS] if set(_COLOURS) <= set(channels) else []
    greys = {f"observation.images.{name}": [k] * 3 for k, name in enumerate(channels) if k not in colours}
    return {"observation.images.front": colours, **greys} if colours else greys


def _images(episode: EpisodeRows, cameras: Mapping[str, list[int]]) -> dict[str, NDArray[Any]]:
    """Shape (steps, height, width, 3), uint8."""
    if episode.images is None:
        return {}
    return {name: episode.images[:-1][..., channels] for name, channels in cameras.items()}


def _features(layout: Layout) -> dict[str, Any]:
    """As info.json has them."""
    names = [element.name for element in layout.frame] * layout.stack
    acted = [element.name for element in layout.continuous] or [branch.name for branch in layout.branches]
    axes = ["height", "width", "channels"]
    return {
        "observation.state": {"dtype": "float32", "shape": [len(names)], "names": names},
        "action": {"dtype": "float32", "shape": [len(acted)], "names": acted},
        **{name: {"dtype": dtype, "shape": [1], "names": None} for name, dtype in _SCALARS.items()},
        **{name: {"dtype": "image", "shape": [*layout.image_shape[:2], 3], "names": axes} for name in _cameras(layout)},
    }


def _arrow_table(columns: Mapping[str, NDArray[Any]], features: Mapping[str, Any]) -> Any:
    import pyarrow as pa  # noqa: PLC0415  (extra `lerobot`)

    table = pa.table({name: _arrow_column(rows) for name, rows in columns.items()})
    known = {"info": {"features": {name: _hub_feature(feature) for name, feature in features.items()}}}
    return table.replace_schema_metadata({"huggingface": json.dumps(known)})


def _arrow_column(rows: NDArray[Any]) -> Any:
    """Numbers, lists of a fixed size, or images with the names that LeRobot gives their files."""
    import pyarrow as pa  # noqa: PLC0415  (extra `lerobot`)

    if rows.ndim == 1:
        return pa.array(rows)
    if rows.ndim == 2:
        return pa.FixedSizeListArray.from_arrays(rows.ravel(), rows.shape[1])
    files = [{"bytes": _png(image), "path": f"frame_{k:06d}.png"} for k, image in enumerate(rows)]
    return pa.array(files, pa.struct({"bytes": pa.binary(), "path": pa.string()}))


def _png(image: NDArray[np.uint8]) -> bytes:
    """Of red, green and blue, shape (height, width, 3)."""
    return cv2.imencode(".png", image[..., ::-1])[1].tobytes()  # OpenCV's order is blue, green, red


def _hub_feature(feature: Mapping[str, Any]) -> dict[str, Any]:
    """As the package `datasets` notes a column's type in a parquet file: without it, it decodes no images."""
    if feature["dtype"] == "image":
        return {"_type": "Image"}
    value, (size,) = {"dtype": feature["dtype"], "_type": "Value"}, feature["shape"]
    return value if size == 1 else {"feature": value, "length": size, "_type": "Sequence"}


def _statistics(columns: Mapping[str, NDArray[Any]]) -> dict[str, dict[str, Any]]:
    """Of each column of an episode: least, most, mean and deviation of each element, and how many rows."""
    found: dict[str, dict[str, Any]] = {}
    for name, column in columns.items():
        if column.ndim == 4:
            moments = _image_moments(column)
        else:
            rows = column.reshape(len(column), -1)
            moments = {"min": rows.min(0), "max": rows.max(0), "mean": rows.mean(0), "std": rows.std(0)}
        found[name] = {key: value.tolist() for key, value in moments.items()} | {"count": [len(column)]}
    return found


def _image_moments(images: NDArray[np.uint8]) -> dict[str, NDArray[np.float64]]:
    """Of each channel over all pixels, bytes scaled to [0, 1], shape (3, 1, 1): LeRobot takes them of a sample."""
    axes = (0, 1, 2)
    mean, square = images.mean(axes), np.square(images, dtype=np.uint16).mean(axes)  # 255 squared fits
    std = np.sqrt(np.maximum(square - mean**2, 0.0))  # without the images as floats
    moments = {"min": images.min(axes), "max": images.max(axes), "mean": mean, "std": std}
    return {key: (value / 255.0).reshape(3, 1, 1) for key, value in moments.items()}


def _append_line(path: Path, record: Mapping[str, Any]) -> None:
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(record) + "\n")


def _write_meta(folder: Path, task: str, features: Mapping[str, Any], lengths: list[int], fps: int) -> None:
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
    lines = [json.dumps({"episode_index": k, "tasks": [task], "length": n}) for k, n in enumerate(lengths)]
    (folder / "episodes.jsonl").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "tasks.jsonl").write_text(json.dumps({"task_index": 0, "task": task}) + "\n", encoding="utf-8")
