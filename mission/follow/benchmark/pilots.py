"""Whose flights are judged: a policy of ours, an ONNX file, or a class of anybody's Python.

All of them are `policies.companion.skills.following.Pilot`: a vector and a picture in, four numbers out, ten times a
second; what the elements are: docs/reference of FollowMe.
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from common.attitude import Vector
from policies.companion.pilot import PilotError, load_pilot
from policies.companion.skills.following import Pilot
from policies.companion.skills.skill import Floats
from policies.tasks.follow_me.observe import EGO, EGO_BLIND, IMAGE_CHANNELS, IMAGE_SIZE, vector_elements


def any_pilot(name: str) -> Pilot:
    """The pilot that a name means: `scripted`, a policy's file or run, an .onnx file, or module:Class.

    Raises:
        PilotError: no such one, or it does not fit FollowMe.
    """
    if name.endswith(".onnx"):
        return OnnxPilot(Path(name))
    if ":" in name:
        return _of_class(name)
    return load_pilot(name)


def _of_class(name: str) -> Pilot:
    from pkgutil import resolve_name

    sys.path.insert(0, str(Path.cwd()))
    try:
        made: Pilot = resolve_name(name)()
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        raise PilotError(f"{name}: no class that can be made without arguments: {error}") from error
    finally:
        sys.path.pop(0)
    missing = [part for part in ("kind", "image_shape", "reset", "act") if not hasattr(made, part)]
    if missing:
        raise PilotError(f"{name}: a pilot has {', '.join(missing)} too")
    if not hasattr(made, "owner_hfrd"):
        made.owner_hfrd = None
    return made


class OnnxPilot:
    """A policy as `honeyguide export` writes it, or anything of the same inputs and outputs.

    Args:
        path: of the file.

    Raises:
        PilotError: it cannot be read, or does not take FollowMe's picture and vector.
    """

    image_shape = (IMAGE_SIZE, IMAGE_SIZE, len(IMAGE_CHANNELS))

    def __init__(self, path: Path) -> None:
        import onnxruntime

        try:
            self._session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
        except Exception as error:  # onnxruntime's own kinds, which it does not name
            raise PilotError(f"{path}: {str(error).splitlines()[0]}") from error
        shapes = {put.name: put.shape for put in self._session.get_inputs()}
        sizes = {len(vector_elements(int(kind))): int(kind) for kind in (EGO, EGO_BLIND)}
        vectors = [name for name, shape in shapes.items() if len(shape) == 2 and shape[1] in sizes]
        images = [name for name, shape in shapes.items() if len(shape) == 4]
        if not vectors or not images:
            raise PilotError(f"{path}: takes {shapes}; a pilot of FollowMe takes a vector and a picture")
        self._vector, self._image = vectors[0], images[0]
        self._has_channels_first = shapes[self._image][1] == len(IMAGE_CHANNELS)
        self.kind = sizes[shapes[self._vector][1]]
        self._memory = next((name for name in shapes if "recurrent" in name or "memor" in name), None)
        self._size = shapes[self._memory][-1] if self._memory is not None else 0
        outputs = [put.name for put in self._session.get_outputs()]
        self._action = next((n for n in outputs if n.startswith("deterministic_continuous")), outputs[0])
        self._next = next((name for name in outputs if "recurrent" in name or "memor" in name), None)
        self.owner_hfrd: Vector | None = None
        self.reset()

    def reset(self) -> None:
        self._state = np.zeros((1, 1, self._size), np.float32)

    def act(self, vector: Floats, image: NDArray[np.uint8]) -> Floats:
        picture = image.astype(np.float32)[None] / 255.0
        fed = {self._vector: vector[None], self._image: picture.transpose(0, 3, 1, 2)}
        if not self._has_channels_first:
            fed[self._image] = picture
        if self._memory is not None:
            fed[self._memory] = self._state
        wanted = [self._action] + ([self._next] if self._next is not None else [])
        action, *state = self._session.run(wanted, fed)
        if state:
            self._state = state[0]
        bounded: Floats = np.clip(action[0], -1.0, 1.0)
        return bounded
