"""Who flies what is learnt from: mediocre pilots, with errors that people make.

`honeyguide benchmark follow --policy bench.offline_story.pilots:Clumsy` shows how well; `navigate` takes
`ClumsyNavigator`, `park` `ClumsyDriver`.
"""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from common.range_sectors import FIRST_EDGE_DEG, RANGE_M, SECTOR_DEG, SECTORS
from policies.companion.vector_pilot import DrivingPilot, NavigationPilot
from policies.experts.follower import Floats, ScriptedFollower
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.tasks.flight.own_state import CLIMB_MAX_M_S, SPEED_MAX_M_S, YAW_RATE_MAX_RAD_S

_LATE = 3  # decisions from what is seen to what is done: 0.3 s
_NOISE, _NOISE_KEPT = 0.12, 0.8  # deviation of a hand that is not steady, and what of it is left a decision later
_TIMID_M = 1.3  # it keeps so much farther off than it should
_NAVIGATOR_NOISE, _NAVIGATOR_LATE = 0.07, 1
_DRIVER_NOISE, _DRIVER_LATE = 0.25, 2


class UnsteadyHand:
    """What becomes of actions by slow eyes and a hand that trembles; the same every time.

    Args:
        size: of an action.
        noise: deviation of the trembling's changes.
        late: decisions from what is seen to what is done.
    """

    def __init__(self, size: int, noise: float = _NOISE, late: int = _LATE) -> None:
        self._size, self._noise, self._late = size, noise, late
        self.reset()

    def reset(self) -> None:
        """As at an episode's start."""
        self._random = np.random.default_rng(0)
        self._error = np.zeros(self._size)
        self._pending: deque[Floats] = deque(maxlen=self._late + 1)

    def done(self, action: Floats) -> Floats:
        """What was meant some decisions ago, and trembling."""
        self._pending.append(action)
        self._error = _NOISE_KEPT * self._error + self._noise * self._random.normal(0.0, 1.0, self._size)
        return np.clip(self._pending[0] + self._error, -1.0, 1.0).astype(np.float32)


class Clumsy(ScriptedFollower):
    """The scripted follower with slow eyes, an unsteady hand, and too much respect for its owner."""

    def __init__(self) -> None:
        self._hand = UnsteadyHand(4)
        super().__init__()

    def reset(self) -> None:
        """Begins the same every time."""
        super().reset()
        self._hand.reset()

    def act(self, vector: Floats, image: NDArray[np.uint8]) -> Floats:
        """What the script would have done 0.3 s ago, farther off, and trembling."""
        action = super().act(vector, image)
        if self.owner_hfrd is not None:
            level = np.array(self.owner_hfrd[:2])
            action[:2] -= (_TIMID_M / max(float(np.hypot(*level)), 1.0) * level / self._limits[:2]).astype(np.float32)
        return self._hand.done(action)


class ClumsyNavigator:
    """Goes where the way is free and leads most nearly to the goal, slowly, with slow eyes and an unsteady hand."""

    stack = 1
    _angles = np.radians(FIRST_EDGE_DEG + SECTOR_DEG * (np.arange(SECTORS) + 0.5))
    _wide = 3  # sectors to each side that it wants free
    _free_m = 6.0
    _height_m = 2.0

    def __init__(self) -> None:
        names = [element.name for element in NavigationPilot.task.frame]
        self._height = names.index("height")
        self._goal = names.index("goal_dir_hfrd_x")
        self._ranges = names.index("goal_below") + 1
        self._hand = UnsteadyHand(4, _NAVIGATOR_NOISE, _NAVIGATOR_LATE)

    def reset(self) -> None:
        """Begins the same every time."""
        self._hand.reset()

    def act(self, vector: Floats) -> Floats:
        """Along the best sector, the nose turning there."""
        ranges_m = RANGE_M * (1.0 - vector[self._ranges : self._ranges + SECTORS])
        padded = np.pad(ranges_m, self._wide, constant_values=0.0)  # what is not seen is not free
        windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * self._wide + 1)
        clear_m = windows.min(axis=1)
        goal = float(np.arctan2(vector[self._goal + 1], vector[self._goal]))
        turn = np.abs(np.remainder(self._angles - goal + np.pi, 2.0 * np.pi) - np.pi)
        best = int((turn + 2.0 * np.clip(1.0 - clear_m / self._free_m, 0.0, 1.0)).argmin())
        angle, speed = float(self._angles[best]), min(0.6 * float(clear_m[best]), 4.0)
        climb = 0.7 * (5.0 * float(vector[self._height]) - self._height_m)
        meant = np.array(
            [
                speed * np.cos(angle) / SPEED_MAX_M_S,
                speed * np.sin(angle) / SPEED_MAX_M_S,
                climb / CLIMB_MAX_M_S,
                1.5 * angle / YAW_RATE_MAX_RAD_S,
            ],
            np.float32,
        )
        return self._hand.done(np.clip(meant, -1.0, 1.0))


class ClumsyDriver(DrivingPilot):
    """The policy that ships for parking, with slow eyes and an unsteady hand."""

    def __init__(self) -> None:
        self._hand = UnsteadyHand(2, _DRIVER_NOISE, _DRIVER_LATE)
        path = find_policy("drive-park")
        super().__init__(load_policy(path)[0], str(path))

    def reset(self) -> None:
        """Begins the same every time."""
        super().reset()
        self._hand.reset()

    def act(self, vector: Floats) -> Floats:
        """What the policy would have done 0.2 s ago, and trembling."""
        return self._hand.done(super().act(vector))
