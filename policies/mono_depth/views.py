"""Images to train and judge monocular depth by, with the depth that the renderer knows.

In: the person detector's scenes. Out: colours as a companion gets them, how the camera is held, and of each block of
pixels the nearest depth and whether somebody is in it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.attitude import inverse, rotated
from policies.mono_depth.network import BLOCK, BLOCKS
from policies.person_detector.scenes import Stage
from sim.sensors.ray import PERSON, TRUNK

_HEIGHT_OFF = 0.06  # of the height above ground, as a fraction: slopes, and what grows below
_LEAN_OFF = 0.02  # [rad] of attitude
_UNKNOWN = 0.05  # fraction of images without a height


@dataclass(frozen=True, slots=True)
class Views:
    """So many images."""

    colours: NDArray[np.uint8]  # (images, height, width, 3)
    down_rdf: NDArray[np.float32]  # (images, 3), as a vehicle would know it
    height_m: NDArray[np.float32]  # (images,), likewise; NaN: not known
    byte: NDArray[np.uint8]  # (images, BLOCKS, BLOCKS): nearest depth, as the depth channel shows it
    is_person: NDArray[np.bool_]  # likewise
    is_trunk: NDArray[np.bool_]  # likewise


def views(stage: Stage, count: int) -> Views:
    """At least so many images."""
    parts = []
    for _ in range(-(-count // stage.count)):
        stage.place()
        optics: Any = stage.camera.optics.numpy()
        optics["depth_std_fraction"] = optics["depth_holes"] = optics["has_depth_limit"] = 0  # true depth
        stage.camera.optics.assign(optics)
        images = stage.images()
        kind = stage.camera.kind.numpy()
        parts.append(
            (
                images[..., :3],
                *_known(stage),
                _blocks(images[..., 3]).min(axis=(2, 4)),
                _blocks(kind == PERSON).any(axis=(2, 4)),
                _blocks(kind == TRUNK).any(axis=(2, 4)),
            )
        )
    return Views(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _blocks(pixels: Any) -> Any:
    return pixels.reshape(len(pixels), BLOCKS, BLOCK, BLOCKS, BLOCK)


def _known(stage: Stage) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Which way is down and how high the lenses are, as vehicles would know it."""
    lens: Any = stage.camera.lenses.numpy()
    down = np.array([rotated(inverse(q.tolist()), (0.0, 0.0, 1.0)) for q in lens["q_ned_from_rdf"]])
    down += stage.rng.normal(0.0, _LEAN_OFF, down.shape)
    height_m = stage.height_m * np.exp(stage.rng.normal(0.0, _HEIGHT_OFF, stage.count))
    height_m[stage.rng.random(stage.count) < _UNKNOWN] = np.nan
    return (down / np.linalg.norm(down, axis=1, keepdims=True)).astype(np.float32), height_m.astype(np.float32)
