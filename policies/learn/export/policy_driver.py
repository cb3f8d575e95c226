"""A trained policy as whoever drives a task, beside experts and people: for watching it, and for recording it."""

import torch

from policies.experts.expert import NewEpisodes
from policies.learn.networks.policy import Policy
from policies.learn.rollout.task_tensors import TaskTensors
from policies.tasks.task import Task


class PolicyDriver:
    """Takes the policy's most probable action in every row, and clears its memory where an episode begins."""

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self._new_episodes = NewEpisodes()
        self._memory: torch.Tensor | None = None

    def act(self, task: Task) -> None:
        """Writes the actions.

        Raises:
            LayoutError: the policy was made for another task or preset.
        """
        rows = torch.from_numpy(self._new_episodes.rows(task))
        if self._memory is None:
            task.layout.require(self._policy.layout, "policy")
            self._memory = self._policy.start_memory(task.env_count)
        with torch.inference_mode():
            memory = self._memory.clone()
            memory[rows] = 0.0
            actions, self._memory = self._policy.act(TaskTensors(task).observation, memory, None)
            task.buffers.continuous.assign(self._policy.bounded(actions).numpy())
            task.buffers.branches.assign(actions.branches.int().numpy())
