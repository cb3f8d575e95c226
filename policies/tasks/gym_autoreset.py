"""Environments that begin episodes by themselves: which steps of which rows are decisions, and final observations.

Gymnasium's `AutoresetMode.NEXT_STEP`: the step after an end ignores its action, shows what the next episode begins
with, and pays nothing. `SAME_STEP`: the step that ends an episode shows that already, and has the final observation in
its info. In: where the environment's episodes end. Out: rows that begin, and rows whose step was no decision.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import concatenate, create_empty_array, iterate
from numpy.typing import NDArray

from policies.tasks.task_error import TaskError

Rows = NDArray[np.bool_]

WAIT_STEPS = 100_000  # for an environment's own end; guess


class AutoresetRows:
    """Rows that begin episodes by themselves; shapes (envs,).

    Args:
        name: of the task, for what goes wrong.
        envs: NEXT_STEP or SAME_STEP.
    """

    def __init__(self, name: str, envs: VectorEnv[Any, Any, Any]) -> None:
        self._name, self._envs, env_count = name, envs, envs.num_envs
        self.is_same_step = envs.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
        """Whether an episode begins in the step that ends the one before, not with the next."""
        self.is_begun = np.zeros(env_count, dtype=np.bool_)
        """Where an episode began with the last step."""
        self.is_skipped = np.zeros(env_count, dtype=np.bool_)
        """Where the last step was no decision."""
        self._begins = np.zeros(env_count, dtype=np.bool_)  # with the next step
        self._waited = np.zeros(
            env_count, dtype=np.int64
        )  # steps, of an episode that the task alone has ended; 0: none

    def step(self, is_over: Rows) -> None:
        """Books a step after which these episodes of the environment are over.

        Raises:
            TaskError: an environment whose episode was ended early has no end of its own.
        """
        waits = self._waited > 0
        self.is_begun = is_over if self.is_same_step else self._begins
        self.is_skipped = waits if self.is_same_step else waits | self.is_begun
        self._begins = is_over & ~self.is_begun
        self._waited = np.where(waits & ~self.is_begun, self._waited + 1, 0)
        if (self._waited > WAIT_STEPS).any():
            raise TaskError(
                f"{self._name}: an episode that was ended early has gone on for {WAIT_STEPS} steps: the environment "
                "needs an end of its own, or autoreset_mode Disabled"
            )

    def leave(self, is_chosen: Rows) -> bool:
        """Takes the running episodes of rows for over, which the environment goes on with; false if all rows are."""
        self._waited = np.where(is_chosen & ~self._begins, np.maximum(self._waited, 1), self._waited)
        return not (self._waited > 0).all()

    def restart(self) -> None:
        """All rows have been reset."""
        self._begins = np.zeros_like(self._begins)
        self._waited = np.zeros_like(self._waited)

    def final_observations(self, info: Mapping[str, Any], is_over: Rows) -> Any:
        """The final observations of rows whose episode has ended in this step, a batch of as many.

        Args:
            info: of the step; `final_obs` is a batch, or an array of single observations.
            is_over: these rows.

        Raises:
            TaskError: one is missing.
        """
        final = info.get("final_obs")
        if final is not None and not (isinstance(final, np.ndarray) and final.dtype == object):
            final = list(iterate(self._envs.observation_space, final))
        each = [None if final is None else final[i] for i in np.flatnonzero(is_over)]
        if any(observation is None for observation in each):
            raise TaskError(f"{self._name}: an episode has ended without a final_obs in info, which SAME_STEP needs")
        batch: Any = create_empty_array(self._envs.single_observation_space, len(each))
        return concatenate(self._envs.single_observation_space, each, batch)
