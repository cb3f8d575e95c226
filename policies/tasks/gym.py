"""Tasks as Gymnasium environments: one (`TaskEnv`) or a batch (`TaskVectorEnv`), the same kernels.

    env = gymnasium.make("policies:honeyguide/RollerBall-v0", preset="as-coded", render_mode="rgb_array")
    envs = gymnasium.make_vec("policies:honeyguide/RollerBall-v0", num_envs=1024)

Keyword arguments are the task's settings. Of a task that shows images an observation is a dict of `image` and `vector`.
`info["outcome"]` names how an episode ended. Arrays that are returned are copies; whoever wants none takes a `Task` and
its buffers.
"""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict, Discrete, MultiDiscrete
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.layout import Layout
from policies.tasks.task import Task

Array = NDArray[Any]
Observation = Array | dict[str, Array]


class TaskEnv(gymnasium.Env[Observation, Any]):
    """One environment of a task."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}  # noqa: RUF012  (as Gymnasium declares it)

    def __init__(self, task: str, render_mode: str | None = None, **settings: Any) -> None:
        self.task = build_task(task, 1, task_settings(task, settings))
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": max(1, round(1.0 / self.task.decision_s))}
        self.observation_space = observation_space(self.task.layout)
        self.action_space = action_space(self.task.layout)
        self._views = _Views(self.task)
        self._is_next_begun = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts an episode, after an end the one that the task has begun by itself; `options` are not used."""
        super().reset(seed=seed, options=options)
        if seed is not None or not self._views.is_begun:
            self._views.reset(int(self.np_random.integers(2**31)))
        elif not self._is_next_begun:  # to begin it again would lose what a task carries over from the last episode
            self.task.begin(np.ones(1, dtype=np.bool_))
        self._is_next_begun = False
        return self._views.observation(0), {}

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One decision. What ends an episode begins the next; `reset` shows it."""
        views = self._views
        views.act(np.asarray(action)[None])
        is_over = self._is_next_begun = bool(views.is_terminated[0] or views.is_truncated[0])
        info = {"outcome": Outcome(int(views.outcomes[0])).name.lower()} if is_over else {}
        return (
            views.observation(0, is_final=is_over),
            float(views.rewards[0]),
            bool(views.is_terminated[0]),
            bool(views.is_truncated[0]),
            info,
        )

    def render(self) -> Any:
        """What is seen from above, RGB."""
        return self.task.top_view(0) if self.render_mode == "rgb_array" else None


class TaskVectorEnv(VectorEnv[Observation, Array, Array]):
    """Many environments in one launch. An episode that ends is followed by the next in the same step."""

    metadata: dict[str, Any] = {  # noqa: RUF012  (as Gymnasium declares it)
        "render_modes": ["rgb_array"],
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }

    def __init__(self, task: str, num_envs: int = 1, render_mode: str | None = None, **settings: Any) -> None:
        self.task = build_task(task, num_envs, task_settings(task, settings))
        self.num_envs = num_envs
        self.render_mode = render_mode
        self.single_observation_space = observation_space(self.task.layout)
        self.single_action_space = action_space(self.task.layout)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._views = _Views(self.task)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts an episode of every environment; `options` are not used."""
        super().reset(seed=seed, options=options)
        self._views.reset(int(self.np_random.integers(2**31)))
        return self._views.observation(), {}

    def step(self, actions: Array) -> tuple[Observation, Array, Array, Array, dict[str, Any]]:
        """One decision each; `final_obs` of the info holds what the ended episodes saw last."""
        views = self._views
        views.act(actions)
        is_over = views.is_terminated | views.is_truncated
        info: dict[str, Any] = {}
        if is_over.any():
            info = {"final_obs": views.observation(is_final=True), "_final_obs": is_over}
            info |= {"outcome": views.outcomes.copy(), "_outcome": is_over}
        rewards = views.rewards.astype(np.float64)
        return views.observation(), rewards, views.is_terminated.copy(), views.is_truncated.copy(), info

    def render(self) -> Any:
        """A tuple of images, RGB."""
        return tuple(self.task.top_view(i) for i in range(self.num_envs)) if self.render_mode == "rgb_array" else None


class _Views:
    """A task's buffers as NumPy arrays: live on the CPU."""

    def __init__(self, task: Task) -> None:
        buffers = task.buffers
        self._task = task
        self.is_begun = False
        self._sizes = np.array(task.layout.branch_sizes)
        self.continuous: Array = buffers.continuous.numpy()
        self.branches: Array = buffers.branches.numpy()
        self.observations: Array = buffers.observations.numpy()
        self.final_observations: Array = buffers.final_observations.numpy()
        self.images: Array = buffers.images.numpy()
        self.final_images: Array = buffers.final_images.numpy()
        self.rewards: Array = buffers.rewards.numpy()
        self.outcomes: Array = buffers.outcomes.numpy()
        self.is_terminated: Array = buffers.is_terminated.numpy()
        self.is_truncated: Array = buffers.is_truncated.numpy()

    def reset(self, seed: int) -> None:
        self.is_begun = True
        self._task.reset(seed)

    def observation(self, rows: Any = slice(None), *, is_final: bool = False) -> Observation:
        """A copy of the observations of rows, or of what their last ended episodes saw last."""
        vector = (self.final_observations if is_final else self.observations)[rows].copy()
        if self._task.layout.image is None:
            return vector
        return {"image": (self.final_images if is_final else self.images)[rows].copy(), "vector": vector}

    def act(self, actions: Array) -> None:
        """Writes the actions, one row per environment, and steps.

        Raises:
            ValueError: a choice that a branch has not, or a number that is none: the kernels trust what they are given.
        """
        if self._task.layout.branches:
            choices = np.asarray(actions).reshape(self.branches.shape)
            if ((choices < 0) | (choices >= self._sizes)).any():
                raise ValueError(f"action: choices must be at least 0 and below {self._sizes.tolist()}")
            self.branches[:] = choices
        else:
            if not np.isfinite(actions).all():
                raise ValueError("action: must be finite")
            self.continuous[:] = np.clip(actions, -1.0, 1.0)
        self._task.step()


def observation_space(layout: Layout) -> Any:
    """Of one environment."""
    vector = Box(-np.inf, np.inf, shape=(layout.observation_size,), dtype=np.float32)
    if layout.image is None:
        return vector
    return Dict({"image": Box(0, 255, shape=layout.image.shape, dtype=np.uint8), "vector": vector})


def action_space(layout: Layout) -> Any:
    """Of one environment: a box, or the discrete branches."""
    if not layout.branches:
        return Box(-1.0, 1.0, shape=(len(layout.continuous),), dtype=np.float32)
    sizes = layout.branch_sizes
    return Discrete(sizes[0]) if len(sizes) == 1 else MultiDiscrete(np.array(sizes))
