"""Environments that begin episodes by themselves, with the step after an end: which steps of which rows are decisions.

Gymnasium's `AutoresetMode.NEXT_STEP`: that step ignores its action, shows what the next episode sees first, and pays
nothing. In: where the environment's episodes end. Out: rows that begin, and rows whose step was no decision.
"""

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[np.bool_]


class NextStepRows:
    """Rows between two episodes; shapes (envs,)."""

    def __init__(self, env_count: int) -> None:
        self.is_skipped = np.zeros(env_count, dtype=np.bool_)
        """Where the last step was no decision."""
        self._begins = np.zeros(env_count, dtype=np.bool_)  # with the next step
        self._waits = np.zeros(env_count, dtype=np.bool_)  # ended by the task alone: until the environment's own end

    def step(self, is_over: Rows) -> Rows:
        """Books a step after which these episodes of the environment are over; says where one began with it."""
        is_begun = self._begins
        self.is_skipped = is_begun | self._waits
        self._waits = self._waits & ~is_begun
        self._begins = is_over & ~is_begun
        return is_begun

    def leave(self, is_chosen: Rows) -> bool:
        """Takes the running episodes of rows for over, which the environment goes on with; false if all rows are."""
        self._waits = self._waits | (is_chosen & ~self._begins)
        return not self._waits.all()

    def restart(self) -> None:
        """All rows have been reset."""
        self._begins = np.zeros_like(self._begins)
        self._waits = np.zeros_like(self._waits)
