"""Images to train and judge monocular depth by, with the depth that the renderer knows.

In: a seed. Out: colours as a companion gets them, where level ground would be seen, and of each block of pixels the
nearest depth and whether somebody is in it. Worlds are those of the person detector: even seeds train, odd ones judge.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.attitude import inverse, rotated
from policies.mono_depth.network import BLOCK, BLOCKS, flat_ground
from policies.person_detector.scenes import WORLDS, Stage
from sim.sensors.ray import PERSON, TRUNK

_HEIGHT_OFF = 0.06  # of the height above ground, as a fraction: slopes, and what grows below
_LEAN_OFF = 0.02  # [rad] of attitude
_UNKNOWN = 0.05  # fraction of images without a height
_HEIGHT_OF_NONE = np.nan


@dataclass(frozen=True, slots=True)
class Views:
    """So many images."""

    colours: NDArray[np.uint8]  # (images, height, width, 3)
    ground: NDArray[np.float32]  # (images, height, width)
    byte: NDArray[np.uint8]  # (images, BLOCKS, BLOCKS): nearest depth, as the depth channel shows it
    is_person: NDArray[np.bool_]  # likewise
    is_trunk: NDArray[np.bool_]  # likewise


def views(count: int, seed: int, *, is_test: bool = False) -> Views:
    """At least so many images; of worlds that no other split has."""
    stage, parts = Stage(seed, is_test=is_test), []
    for _ in range(-(-count // WORLDS)):
        stage.place()
        optics: Any = stage.camera.optics.numpy()
        optics["depth_std_fraction"] = optics["depth_holes"] = optics["has_depth_limit"] = 0  # true depth
        images = stage.images()
        kind = stage.camera.kind.numpy()
        parts.append(
            (
                images[..., :3],
                _ground(stage),
                _blocks(images[..., 3]).min(axis=(2, 4)),
                _blocks(kind == PERSON).any(axis=(2, 4)),
                _blocks(kind == TRUNK).any(axis=(2, 4)),
            )
        )
    return Views(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _blocks(pixels: Any) -> Any:
    return pixels.reshape(len(pixels), BLOCKS, BLOCK, BLOCKS, BLOCK)


def _ground(stage: Stage) -> NDArray[np.float32]:
    """Of the heights and attitudes that a vehicle would know."""
    lens: Any = stage.camera.lenses.numpy()
    down = np.array([rotated(inverse(q.tolist()), (0.0, 0.0, 1.0)) for q in lens["q_ned_from_rdf"]])
    down += stage.rng.normal(0.0, _LEAN_OFF, down.shape)
    height_m = stage.height_m * np.exp(stage.rng.normal(0.0, _HEIGHT_OFF, WORLDS))
    height_m[stage.rng.random(WORLDS) < _UNKNOWN] = _HEIGHT_OF_NONE
    return flat_ground(down / np.linalg.norm(down, axis=1, keepdims=True), height_m)
