"""Who flies what is learnt from: a mediocre pilot, with errors that people make.

`honeyguide benchmark follow --policy bench.offline_story.pilots:Clumsy` shows how well.
"""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from policies.experts.follower import Floats, ScriptedFollower

_LATE = 3  # decisions from what is seen to what is done: 0.3 s
_NOISE, _NOISE_KEPT = 0.12, 0.8  # deviation of a hand that is not steady, and what of it is left a decision later
_TIMID_M = 1.3  # it keeps so much farther off than it should


class Clumsy(ScriptedFollower):
    """The scripted follower with slow eyes, an unsteady hand, and too much respect for its owner."""

    def __init__(self) -> None:
        super().__init__()
        self.reset()

    def reset(self) -> None:
        """Begins the same every time."""
        super().reset()
        self._random = np.random.default_rng(0)
        self._error = np.zeros(4)
        self._pending: deque[Floats] = deque(maxlen=_LATE + 1)

    def act(self, vector: Floats, image: NDArray[np.uint8]) -> Floats:
        """What the script would have done 0.3 s ago, farther off, and trembling."""
        action = super().act(vector, image)
        if self.owner_hfrd is not None:
            level = np.array(self.owner_hfrd[:2])
            action[:2] -= (_TIMID_M / max(float(np.hypot(*level)), 1.0) * level / self._limits[:2]).astype(np.float32)
        self._pending.append(action)
        self._error = _NOISE_KEPT * self._error + _NOISE * self._random.normal(0.0, 1.0, 4)
        return np.clip(self._pending[0] + self._error, -1.0, 1.0).astype(np.float32)
