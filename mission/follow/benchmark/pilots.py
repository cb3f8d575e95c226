"""Whose following is judged: a policy of ours, an ONNX file, or a class of anybody's Python.

All of them are `policies.companion.skills.following.Pilot`: a vector and an image in, four numbers out, ten times a
second; what the elements are: docs/reference/tasks.md of FollowMe.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.attitude import Vector
from mission.benchmark.any_pilot import CheckedPilot, OnnxNetwork, is_class, made_by_name
from policies.companion.pilot import PilotError, load_pilot
from policies.companion.skills.following import Pilot
from policies.companion.skills.skill import Floats
from policies.tasks.flight.own_state import ACTIONS
from policies.tasks.follow_me.observe import (
    EGO,
    EGO_BLIND,
    IMAGE_CHANNELS,
    IMAGE_SHAPE,
    IMAGE_SIZE,
    TRACKED,
    vector_elements,
)
from policies.tasks.follow_me.tracked.vector import TRACKED_ELEMENTS

_ELEMENTS = {
    int(EGO): vector_elements(int(EGO)),
    int(EGO_BLIND): vector_elements(int(EGO_BLIND)),
    int(TRACKED): TRACKED_ELEMENTS,
}
_WANTED = (
    f"a pilot of FollowMe takes a vector of {len(_ELEMENTS[int(EGO)])} or {len(_ELEMENTS[int(EGO_BLIND)])} floats and "
    f"an image of {IMAGE_SIZE} x {IMAGE_SIZE} x {len(IMAGE_CHANNELS)}, or frames of {len(TRACKED_ELEMENTS)} floats "
    f"and no image, and gives {len(ACTIONS)} numbers"
)


def any_pilot(name: str) -> Pilot:
    """The pilot that a name means: `scripted`, a policy's file or run, an .onnx file, or module:Class.

    Raises:
        PilotError: no such one, or it does not fit FollowMe.
    """
    made: Any
    if name.endswith(".onnx"):
        made = OnnxPilot(Path(name))
    elif is_class(name):
        made = _made(name)
    else:
        return load_pilot(name)
    vector, image = np.zeros(len(_ELEMENTS[made.kind]), np.float32), np.zeros(IMAGE_SHAPE, np.uint8)
    checked: Any = CheckedPilot(made, name, len(ACTIONS), vector, image)
    pilot: Pilot = checked
    return pilot


def _made(name: str) -> Any:
    """What a class of anybody's makes, which says what it is shown."""
    made = made_by_name(name, ("kind", "image_shape", "reset", "act"))
    if made.kind not in list(_ELEMENTS):
        raise PilotError(f"{name}: kind {made.kind}: must be one of {', '.join(map(str, _ELEMENTS))}")
    if made.image_shape != IMAGE_SHAPE:
        raise PilotError(f"{name}: image_shape {made.image_shape}: must be {IMAGE_SHAPE}")
    if not hasattr(made, "owner_hfrd"):
        made.owner_hfrd = None
    return made


class OnnxPilot:
    """A policy as `honeyguide export` writes it, or anything of the same inputs and outputs.

    It takes a vector and the image, or the last frames of what the senses tell and no image.

    Args:
        path: of the file.

    Raises:
        PilotError: it cannot be read, or takes or gives something else.
    """

    image_shape = IMAGE_SHAPE

    def __init__(self, path: Path) -> None:
        self._network = OnnxNetwork(path)
        observed = self._network.observed
        self._vector = next((name for name, shape in observed.items() if len(shape) == 2), "")
        self._image = next((name for name in observed if name != self._vector), "")
        size = observed.get(self._vector, [1, 0])[1]
        kind = self._kind(size if isinstance(size, int) else 0)
        is_whole = len(observed) == (1 if kind == int(TRACKED) else 2)
        if kind is None or not is_whole or not _fits(self._network.action_shape, (1, len(ACTIONS))):
            raise PilotError(f"{path}: takes {self._network.in_words()}; {_WANTED}")
        self.kind = kind
        self._frames: Floats = np.zeros((size // len(_ELEMENTS[kind]), len(_ELEMENTS[kind])), np.float32)
        self.owner_hfrd: Vector | None = None
        self.reset()

    def _kind(self, size: int) -> int | None:
        """Which vector has so many floats, with the image that there is or none; None: none of them."""
        if not self._image:
            return int(TRACKED) if size and size % len(TRACKED_ELEMENTS) == 0 else None
        shape = self._network.shapes[self._image]
        height, width, channels = self.image_shape
        self._has_channels_first = _fits(shape, (1, channels, height, width))
        if not self._has_channels_first and not _fits(shape, (1, height, width, channels)):
            return None
        return next((kind for kind in (int(EGO), int(EGO_BLIND)) if len(_ELEMENTS[kind]) == size), None)

    def reset(self) -> None:
        """As at an episode's start."""
        self._network.reset()
        self._frames[:] = 0.0

    def act(self, vector: Floats, image: NDArray[np.uint8]) -> Floats:
        self._frames[:-1] = self._frames[1:]
        self._frames[-1] = vector
        fed = {self._vector: self._frames.reshape(1, -1)}
        if self._image:
            pixels = image.astype(np.float32)[None] / 255.0
            fed[self._image] = pixels.transpose(0, 3, 1, 2) if self._has_channels_first else pixels
        return self._network.run(fed)


def _fits(shape: list[Any], wanted: tuple[int, ...]) -> bool:
    """Whether a shape may be the wanted one: sizes without a number may be any."""
    pairs = zip(shape, wanted, strict=False)
    return len(shape) == len(wanted) and all(size == want for size, want in pairs if isinstance(size, int))
