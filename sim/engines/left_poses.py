"""Where an engine has left its bodies, by which it notices that somebody else has put one elsewhere."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

_POSE = ["pos_ned", "vel_ned", "q_ned_from_frd", "omega_frd"]


class LeftPoses:
    """Pose and motion of each row of a body's `State`, as the last step has left it.

    Args:
        states: the live rows, shape (vehicles,).
    """

    def __init__(self, states: NDArray[Any]) -> None:
        self._states = states
        self._left = states[_POSE].copy()

    def now(self) -> NDArray[Any]:
        """A copy of pose and motion as they are, shape (vehicles,)."""
        return self._states[_POSE].copy()

    def moved(self) -> list[int]:
        """The rows that are no longer as they were left."""
        return np.flatnonzero(self._states[_POSE] != self._left).tolist()

    def leave(self) -> None:
        """The step is over; those that are held in hands are the engine's to put again."""
        self._left = self.now()
        self.forget(self._states["is_held"])

    def forget(self, is_chosen: NDArray[Any]) -> None:
        """Rows, those that are not 0, that count as moved whatever they hold."""
        self._left["pos_ned"][is_chosen != 0] = np.nan
