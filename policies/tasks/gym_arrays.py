"""What Gymnasium sees of a task: its spaces, and its buffers as NumPy arrays. One environment and a batch share it."""

from typing import Any

import numpy as np
from gymnasium.spaces import Box, Dict, Discrete, MultiDiscrete
from numpy.typing import NDArray

from policies.tasks.catalogue import UnknownTask
from policies.tasks.layout import Layout
from policies.tasks.reshaping import cut_rows
from policies.tasks.task import Task

Array = NDArray[Any]
Observation = Array | dict[str, Array]


class TaskArrays:
    """A task's buffers as NumPy arrays: live on the CPU."""

    def __init__(self, task: Task, *, has_privileged: bool) -> None:
        buffers = task.buffers
        self._task = task
        self._has_privileged = has_privileged
        self.is_begun = False
        self._sizes = np.array(task.layout.branch_sizes)
        self.continuous: Array = buffers.continuous.numpy()
        self.branches: Array = buffers.branches.numpy()
        self._now = {"image": buffers.images, "vector": buffers.observations, "privileged": buffers.privileged}
        self._final = {
            "image": buffers.final_images,
            "vector": buffers.final_observations,
            "privileged": buffers.final_privileged,
        }
        self.rewards: Array = buffers.rewards.numpy()
        self.outcomes: Array = buffers.outcomes.numpy()
        self.is_terminated: Array = buffers.is_terminated.numpy()
        self.is_truncated: Array = buffers.is_truncated.numpy()
        self.steps: Array = buffers.steps.numpy()

    @property
    def is_over(self) -> Array:
        """Which episodes ended with the last decision, shape (envs,)."""
        over: Array = self.is_terminated | self.is_truncated
        return over

    def reset(self, seed: int | list[int], is_chosen: NDArray[np.bool_] | None = None) -> None:
        self.is_begun = True
        self._task.reset(seed, is_chosen)

    def observation(self, rows: Any = slice(None), *, is_final: bool = False) -> Observation:
        """A copy of the observations of rows, or of what their last ended episodes saw last."""
        arrays = self._final if is_final else self._now
        layout = self._task.layout
        has_more = {"image": layout.image is not None, "vector": True, "privileged": self._has_privileged}
        parts = {name: arrays[name].numpy()[rows].copy() for name, is_shown in has_more.items() if is_shown}
        return parts if len(parts) > 1 else parts["vector"]

    def last_seen(self, is_ended: NDArray[np.bool_]) -> Observation:
        """A copy of the observations; of the rows that have ended, of what they saw last."""
        now = self.observation()
        if is_ended.any():
            last = self.observation(is_ended, is_final=True)
            for there, here in zip(_parts(now), _parts(last), strict=True):
                there[is_ended] = here
        return now

    def final_observations(self, is_over: NDArray[np.bool_]) -> Array:
        """What the rows that have ended saw last; of dicts an array of one each, as of SyncVectorEnv."""
        last = self.observation(is_final=True)
        if not isinstance(last, dict):
            return last
        each = np.full(len(is_over), None, dtype=object)
        for i in np.flatnonzero(is_over):
            each[i] = {name: part[i] for name, part in last.items()}
        return each

    def cut(self, limit: int, is_running: NDArray[np.bool_]) -> None:
        """Truncates episodes of the running rows that have lasted so many decisions."""
        is_late = is_running & ~self.is_over & (self.steps >= limit)
        if is_late.any():
            cut_rows(self._task, is_late)

    def act(self, actions: Any, is_held: NDArray[np.bool_] | None = None, *, is_single: bool = False) -> None:
        """Writes the actions: the kernels trust what they are given.

        Args:
            actions: one row per environment.
            is_held: rows whose actions are not looked at, shape (envs,).
            is_single: whether it is the action of one environment, and no batch.

        Raises:
            ValueError: another shape, a choice that a branch has not, or a number that is none.
        """
        has_branches = bool(self._task.layout.branches)
        shape = self.branches.shape if has_branches else self.continuous.shape
        given = np.asarray(actions)
        _check_actions(given, shape[1:] if is_single else shape, are_choices=has_branches)
        if has_branches:
            choices = given.reshape(shape).copy()
            if is_held is not None:
                choices[is_held] = 0
            if ((choices < 0) | (choices >= self._sizes)).any():
                raise ValueError(f"action: choices must be at least 0 and below {self._sizes.tolist()}")
            self.branches[:] = choices
        else:
            pushes = given.reshape(shape).astype(np.float32)
            if is_held is not None:
                pushes[is_held] = 0.0
            if not np.isfinite(pushes).all():
                raise ValueError("action: must be finite")
            self.continuous[:] = np.clip(pushes, -1.0, 1.0)


def _check_actions(given: Array, shape: tuple[int, ...], *, are_choices: bool) -> None:
    """Refuses actions of another shape, which NumPy would stretch, or of another kind; a single choice is a number."""
    is_one_choice = are_choices and shape[-1] == 1
    if given.shape != shape and not (is_one_choice and given.shape == shape[:-1]):
        raise ValueError(f"action: must have shape {shape[:-1] if is_one_choice else shape}, not {given.shape}")
    if given.dtype.kind not in ("biu" if are_choices else "biuf"):
        raise ValueError(f"action: must be {'whole ' * are_choices}numbers, not {given.dtype}")


def _parts(observation: Observation) -> list[Array]:
    return list(observation.values()) if isinstance(observation, dict) else [observation]


def observation_space(layout: Layout, *, has_privileged: bool = False) -> Any:
    """Of one environment.

    Raises:
        UnknownTask: what critics alone may see is asked for, and there is none.
    """
    if has_privileged and not layout.privileged:
        raise UnknownTask(f"{layout.task}: has_privileged: as it is set it has no privileged elements")
    vector = Box(-np.inf, np.inf, shape=(layout.observation_size,), dtype=np.float32)
    parts: dict[str, Any] = {}
    if layout.image is not None:
        parts["image"] = Box(0, 255, shape=layout.image.shape, dtype=np.uint8)
    parts["vector"] = vector
    if has_privileged:
        parts["privileged"] = Box(-np.inf, np.inf, shape=(len(layout.privileged),), dtype=np.float32)
    return Dict(parts) if len(parts) > 1 else vector


def action_space(layout: Layout) -> Any:
    """Of one environment: a box, or the discrete branches."""
    if not layout.branches:
        return Box(-1.0, 1.0, shape=(len(layout.continuous),), dtype=np.float32)
    sizes = layout.branch_sizes
    return Discrete(sizes[0]) if len(sizes) == 1 else MultiDiscrete(np.array(sizes))
