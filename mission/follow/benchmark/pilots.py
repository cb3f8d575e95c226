"""Whose following is judged: a policy of ours, an ONNX file, or a class of anybody's Python.

All of them are `policies.companion.skills.following.Pilot`: a vector and a picture in, four numbers out, ten times a
second; what the elements are: docs/reference of FollowMe.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.attitude import Vector
from mission.benchmark.any_pilot import OnnxNetwork, made_by_name
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
    if ":" not in name:
        return load_pilot(name)
    made: Pilot = made_by_name(name, ("kind", "image_shape", "reset", "act"))
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
        self._network = OnnxNetwork(path)
        shapes: dict[str, list[Any]] = self._network.shapes
        sizes = {len(vector_elements(int(kind))): int(kind) for kind in (EGO, EGO_BLIND)}
        vectors = [name for name, shape in shapes.items() if len(shape) == 2 and shape[1] in sizes]
        images = [name for name, shape in shapes.items() if len(shape) == 4]
        if not vectors or not images:
            raise PilotError(f"{path}: takes {shapes}; a pilot of FollowMe takes a vector and a picture")
        self._vector, self._image = vectors[0], images[0]
        self._has_channels_first = shapes[self._image][1] == len(IMAGE_CHANNELS)
        self.kind = sizes[shapes[self._vector][1]]
        self.owner_hfrd: Vector | None = None

    def reset(self) -> None:
        self._network.reset()

    def act(self, vector: Floats, image: NDArray[np.uint8]) -> Floats:
        picture = image.astype(np.float32)[None] / 255.0
        fed = {self._vector: vector[None], self._image: picture.transpose(0, 3, 1, 2)}
        if not self._has_channels_first:
            fed[self._image] = picture
        return self._network.run(fed)
