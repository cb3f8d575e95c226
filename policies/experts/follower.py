"""A scripted follower: keeps two metres behind its owner from the same observation as a policy, without obstacles.

In: the observation's vector, with the phone's report in it, and its image. Out: velocity and yaw rate as an action. It
is what a trained policy is compared with, and what flies a companion that has been given none.
"""

from math import atan2, hypot

import numpy as np
from numpy.typing import NDArray

from common.attitude import Vector
from policies.shirt_detector import chest_hfrd
from policies.tasks.flight.own_state import ACTIONS
from policies.tasks.follow_me.observe import (
    EGO,
    IMAGE_SHAPE,
    vector_elements,
)

DISTANCE_M = 2.0  # to the owner's chest, level: the middle of the band
HEIGHT_M = 1.6  # above the ground: over the chest, so that the owner is in the middle of an image tilted down
DISTANCE_GAIN = 1.0  # [1/s] from metres too far to metres per second; guess
HEIGHT_GAIN = 1.0  # [1/s] guess
YAW_GAIN = 2.0  # [1/s] guess
_NEAR_M = 0.3  # nearer, the direction to the owner says nothing

Floats = NDArray[np.float32]


class ScriptedFollower:
    """Flies on the image where the owner is in it, on the phone's report where not, and on the range finder."""

    kind = int(EGO)
    image_shape = IMAGE_SHAPE

    def __init__(self) -> None:
        self.owner_hfrd: Vector | None = None  # as a companion's `Pilot`
        elements = vector_elements(self.kind)
        self._index = {element.name: k for k, element in enumerate(elements)}
        self._scales = np.array([element.scale for element in elements], dtype=np.float32)
        self._limits = np.array([element.scale for element in ACTIONS], dtype=np.float32)
        self._values = np.zeros(len(elements), dtype=np.float32)

    def reset(self) -> None:
        """Has nothing to forget but where the owner was seen."""
        self.owner_hfrd = None

    def act(self, vector: Floats, image: NDArray[np.uint8]) -> Floats:
        """Along the line of sight to the right distance, as fast as the owner; faces them; keeps its height."""
        self._values = vector * self._scales
        wanted = np.zeros(4, dtype=np.float32)
        if self._read("is_height_valid"):
            wanted[2] = HEIGHT_GAIN * (self._read("height") - HEIGHT_M)
        self.owner_hfrd = chest_hfrd(image, (self._read("down_frd_x"), self._read("down_frd_y")))
        if self.owner_hfrd is not None:
            ahead_m, right_m, _ = self.owner_hfrd
        elif self._read("is_owner_known"):
            ahead_m, right_m = self._read("owner_pos_hfrd_x"), self._read("owner_pos_hfrd_y")
        else:
            return np.clip(wanted / self._limits, -1.0, 1.0)
        distance_m = max(hypot(ahead_m, right_m), _NEAR_M)
        closing = DISTANCE_GAIN * (distance_m - DISTANCE_M) / distance_m
        wanted[0] = self._read("owner_vel_hfrd_x") + closing * ahead_m
        wanted[1] = self._read("owner_vel_hfrd_y") + closing * right_m
        wanted[3] = YAW_GAIN * atan2(right_m, ahead_m)
        return np.clip(wanted / self._limits, -1.0, 1.0)

    def _read(self, name: str) -> float:
        return float(self._values[self._index[name]])
