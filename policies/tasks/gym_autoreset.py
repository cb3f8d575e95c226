"""Environments that begin episodes by themselves: which steps of which rows are decisions, and what was seen last.

Gymnasium's `AutoresetMode.NEXT_STEP`: the step after an end ignores its action, shows what the next episode sees first,
and pays nothing. `SAME_STEP`: the step that ends an episode shows that already, and tells apart what was seen last. In:
where the environment's episodes end. Out: rows that begin, and rows whose step was no decision.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import Space
from gymnasium.vector.utils import concatenate, create_empty_array
from numpy.typing import NDArray

Rows = NDArray[np.bool_]


class AutoresetRows:
    """Rows that begin episodes by themselves; shapes (envs,)."""

    def __init__(self, env_count: int, *, is_same_step: bool) -> None:
        self.is_same_step = is_same_step
        """Whether an episode begins in the step that ends the one before, not with the next."""
        self.is_skipped = np.zeros(env_count, dtype=np.bool_)
        """Where the last step was no decision."""
        self._begins = np.zeros(env_count, dtype=np.bool_)  # with the next step
        self._waits = np.zeros(env_count, dtype=np.bool_)  # ended by the task alone: until the environment's own end

    def step(self, is_over: Rows) -> Rows:
        """Books a step after which these episodes of the environment are over; says where one began with it."""
        if self.is_same_step:
            is_begun, self.is_skipped = is_over, self._waits
        else:
            is_begun, self.is_skipped = self._begins, self._begins | self._waits
            self._begins = is_over & ~is_begun
        self._waits = self._waits & ~is_begun
        return is_begun

    def leave(self, is_chosen: Rows) -> bool:
        """Takes the running episodes of rows for over, which the environment goes on with; false if all rows are."""
        self._waits = self._waits | (is_chosen & ~self._begins)
        return not self._waits.all()

    def restart(self) -> None:
        """All rows have been reset."""
        self._begins = np.zeros_like(self._begins)
        self._waits = np.zeros_like(self._waits)


def final_observations(space: Space[Any], info: Mapping[str, Any], is_over: Rows) -> Any:
    """A batch of observations: where an episode ended in this step what it saw last, elsewhere anything.

    Args:
        space: of one environment.
        info: of the step; `final_obs` is a batch, or an array of single observations.
        is_over: rows in which one ended.

    Raises:
        ValueError: `info` does not say.
    """
    if "final_obs" not in info:
        raise ValueError("an episode has ended, and info tells no final_obs, as SAME_STEP has to")
    told = info["final_obs"]
    if not (isinstance(told, np.ndarray) and told.dtype == object):
        return told
    some = told[np.flatnonzero(is_over)[0]]
    each = [told[i] if is_over[i] else some for i in range(len(is_over))]
    batch: Any = create_empty_array(space, len(is_over))
    return concatenate(space, each, batch)
