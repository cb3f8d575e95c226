"""A task as Stable-Baselines3's `VecEnv`: the peer trains on the very batch that ours trains on."""

from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv

from policies.tasks.gym import TaskVectorEnv
from policies.tasks.gym_arrays import action_space, observation_space


class BatchVecEnv(VecEnv):  # type: ignore[misc]  # its package has no types
    """Environments of one task, ended and begun in the same step, as Stable-Baselines3 expects."""

    def __init__(self, task: str, count: int, seed: int = 0, **settings: Any) -> None:
        self.envs = TaskVectorEnv(task, count, **settings)
        layout = self.envs.task.layout
        super().__init__(count, observation_space(layout), action_space(layout))
        self._first_seed = seed
        self._actions: Any = None

    def reset(self) -> Any:
        return self.envs.reset(seed=self._first_seed)[0]

    def step_async(self, actions: Any) -> None:
        self._actions = actions

    def step_wait(self) -> Any:
        observations, rewards, is_terminated, is_truncated, info = self.envs.step(self._actions)
        is_over = is_terminated | is_truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(is_over):
            infos[i] = {
                "terminal_observation": info["final_obs"][i],
                "TimeLimit.truncated": bool(is_truncated[i]),
                "is_success": bool(info["outcome"][i] == 1),
            }
        return observations, rewards.astype(np.float32), is_over, infos

    def close(self) -> None:
        """There is nothing to close."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:  # noqa: ARG002  (as its parent declares it)
        return [getattr(self, attr_name, None)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise NotImplementedError

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        raise NotImplementedError

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:  # noqa: ARG002
        return [False] * self.num_envs
