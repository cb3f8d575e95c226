"""Checkpoints: all that a training run needs to go on bit for bit, written whole, and read without running any code.

In: nested plain values, tensors and arrays. Out: a file that is either complete and forced to the disk, or not there:
the processes that write it may be killed at any moment, and a full disk leaves the previous checkpoint as it was.
"""

import io
import pickle
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from common.files import part_path, write_durably
from policies.learn.export.policy_path import CheckpointError

_ARRAY = "npy"  # an array is stored as {"npy": its bytes in NumPy's format}: any element type, no pickled code


def save(path: Path, content: Mapping[str, Any], kind: str) -> None:
    """Writes a file of a kind ("checkpoint", "policy"), and returns when it would survive a loss of power.

    Raises:
        CheckpointError: it cannot be written, for example because the disk is full; an existing file is as it was.
    """
    stream = io.BytesIO()
    torch.save({"honeyguide": kind, "content": _stored(content)}, stream)
    try:
        write_durably(path, stream.getvalue())
    except OSError as error:
        part_path(path).unlink(missing_ok=True)  # half a checkpoint is of no use, and the disk may be full
        raise CheckpointError(f"{path}: cannot be written: {error.strerror}") from error


def load(path: Path, *kinds: str) -> dict[str, Any]:
    """What `save` wrote.

    Raises:
        CheckpointError: no such file, damaged, or of none of these kinds.
    """
    kind = " or ".join(kinds)
    try:
        with zipfile.ZipFile(path) as archive:
            damaged = archive.testzip()
        whole = torch.load(path, map_location="cpu", weights_only=True)
    except OSError as error:
        raise CheckpointError(f"{path}: cannot be read: {error.strerror}") from error
    except (zipfile.BadZipFile, pickle.UnpicklingError, RuntimeError, EOFError, KeyError, ValueError) as error:
        raise CheckpointError(f"{path}: not a {kind} of honeyguide, or damaged") from error
    if damaged is not None or not isinstance(whole, dict) or "honeyguide" not in whole:
        raise CheckpointError(f"{path}: not a {kind} of honeyguide, or damaged")
    if whole["honeyguide"] not in kinds:
        raise CheckpointError(f"{path}: a {whole['honeyguide']} of honeyguide, not a {kind}")
    try:
        content = _restored(whole["content"])
    except (AttributeError, EOFError, KeyError, RecursionError, TypeError, ValueError) as error:
        raise CheckpointError(f"{path}: not a {kind} of honeyguide, or damaged") from error
    if not isinstance(content, dict):
        raise CheckpointError(f"{path}: not a {kind} of honeyguide, or damaged")
    return content


def checkpoint_path(folder: Path, behavior: str, steps: int) -> Path:
    """Where the checkpoint after so many steps lies, named as ML-Agents names it."""
    return folder / f"{behavior}-{steps}.pt"


def checkpoints(folder: Path, behavior: str) -> list[Path]:
    """The complete checkpoints of a run, oldest first."""
    name = re.compile(rf"{re.escape(behavior)}-(\d+)\.pt")
    found = [(int(match[1]), path) for path in folder.glob("*.pt") if (match := name.fullmatch(path.name))]
    return [path for _, path in sorted(found)]


def prune(folder: Path, behavior: str, keep: int) -> None:
    """Removes the oldest checkpoints, and what was exported beside them, until `keep` are left."""
    for path in checkpoints(folder, behavior)[: -max(keep, 1)]:
        path.with_suffix(".onnx").unlink(missing_ok=True)
        path.unlink()


def _stored(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return {_ARRAY: _array_bytes(value)}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        return {key: _stored(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(_stored(item) for item in value)
    if isinstance(value, torch.Tensor):
        return value.detach().clone()  # a view would be stored with all of the memory that it looks at
    return value


def _restored(value: Any) -> Any:
    if isinstance(value, dict):
        if set(value) == {_ARRAY}:
            return np.load(io.BytesIO(value[_ARRAY].numpy().tobytes()), allow_pickle=False)
        return {key: _restored(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(_restored(item) for item in value)
    return value


def _array_bytes(array: NDArray[Any]) -> torch.Tensor:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=False)
    return torch.frombuffer(bytearray(stream.getvalue()), dtype=torch.uint8)
