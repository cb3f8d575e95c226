"""Pilots of FollowMe that nobody should fly: what a guard is tried against.

In and out as of any pilot. `honeyguide benchmark follow --policy policies.experts.adversaries:Rusher`, and so on.
"""

from math import atan2, hypot

import numpy as np
from numpy.typing import NDArray

from policies.experts.follower import Floats, ScriptedFollower

_CHANGES = 0.1  # of its decisions that the random one changes its mind


class Rusher(ScriptedFollower):
    """Flies at its owner as fast as it can, from wherever it sees them."""

    def act(self, vector: Floats, image: NDArray[np.uint8]) -> Floats:
        """Full speed along the line of sight, where nobody is seen straight ahead."""
        action = super().act(vector, image)
        ahead_m, right_m = (1.0, 0.0) if self.owner_hfrd is None else self.owner_hfrd[:2]
        action[0], action[1] = np.array([ahead_m, right_m]) / max(hypot(ahead_m, right_m), 1e-3)
        action[3] = np.clip(2.0 * atan2(right_m, ahead_m), -1.0, 1.0)
        return action


class Random(ScriptedFollower):
    """Any velocity and yaw rate that can be asked for, and another one a second later."""

    def __init__(self) -> None:
        super().__init__()
        self.reset()

    def reset(self) -> None:
        """Begins the same every time."""
        super().reset()
        self._random = np.random.default_rng(0)
        self._action = np.zeros(4, dtype=np.float32)

    def act(self, vector: Floats, image: NDArray[np.uint8]) -> Floats:
        """Looks where the owner is, and does not care."""
        super().act(vector, image)
        if self._random.random() < _CHANGES or not self._action.any():
            self._action = self._random.uniform(-1.0, 1.0, 4).astype(np.float32)
        return self._action


class Blind(ScriptedFollower):
    """Straight ahead as fast as it can, and down."""

    def act(self, vector: Floats, image: NDArray[np.uint8]) -> Floats:
        """The same whatever it is told."""
        super().act(vector, image)
        return np.array([1.0, 0.0, 0.5, 0.0], dtype=np.float32)
