"""A scripted follower: keeps two metres behind its owner from the same observation as a policy, without obstacles.

In: the observation's vector, with the phone's report in it. Out: velocity and yaw rate as an action. It is what a
trained policy is compared with, and what flies a companion that has been given none.
"""

from math import atan2, hypot
from typing import Any

import numpy as np
from numpy.typing import NDArray

from policies.tasks.flight.own import ACTIONS
from policies.tasks.follow_me.observe import EGO, IMAGE_CHANNELS, IMAGE_SIZE, vector_elements

DISTANCE_M = 2.0  # to the owner's chest, level: the middle of the band
HEIGHT_M = 1.6  # above the ground: over the chest, so that the owner is in the middle of a picture tilted down
DISTANCE_GAIN = 1.0  # [1/s] from metres too far to metres per second; guess
HEIGHT_GAIN = 1.0  # [1/s] guess
YAW_GAIN = 2.0  # [1/s] guess
_NEAR_M = 0.3  # nearer, the direction to the owner says nothing

Floats = NDArray[np.float32]


class ScriptedFollower:
    """Flies on the phone's report and the range finder alone."""

    kind = int(EGO)
    image_shape = (IMAGE_SIZE, IMAGE_SIZE, len(IMAGE_CHANNELS))

    def __init__(self) -> None:
        elements = vector_elements(self.kind)
        self._index = {element.name: k for k, element in enumerate(elements)}
        self._scales = np.array([element.scale for element in elements], dtype=np.float32)
        self._limits = np.array([element.scale for element in ACTIONS], dtype=np.float32)

    def reset(self) -> None:
        """Remembers nothing."""

    def act(self, vector: Floats, image: NDArray[np.uint8] | None) -> Floats:  # noqa: ARG002  (a pilot's signature)
        """Along the line of sight to the right distance, as fast as the owner; faces them; keeps its height."""
        values = vector * self._scales

        def read(*names: str) -> Any:
            return tuple(float(values[self._index[name]]) for name in names)

        wanted = np.zeros(4, dtype=np.float32)
        height_m, is_height_valid, is_known = read("height", "is_height_valid", "is_owner_known")
        if is_height_valid:
            wanted[2] = HEIGHT_GAIN * (height_m - HEIGHT_M)
        if is_known:
            ahead_m, right_m = read("owner_pos_hfrd_x", "owner_pos_hfrd_y")
            vel_ahead, vel_right = read("owner_vel_hfrd_x", "owner_vel_hfrd_y")
            distance_m = max(hypot(ahead_m, right_m), _NEAR_M)
            closing = DISTANCE_GAIN * (distance_m - DISTANCE_M) / distance_m
            wanted[0] = vel_ahead + closing * ahead_m
            wanted[1] = vel_right + closing * right_m
            wanted[3] = YAW_GAIN * atan2(right_m, ahead_m)
        return np.clip(wanted / self._limits, -1.0, 1.0)
