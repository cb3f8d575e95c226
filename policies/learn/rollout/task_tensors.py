"""A task as torch sees it: views of its buffers, no copies. Actions in, one launch, observations and rewards out."""

from typing import Any

import torch
import warp as wp
from torch import Tensor

from policies.learn.networks.observations import Observation
from policies.tasks.task import Task


class TaskTensors:
    """The buffers of a task. What the task writes shows in these tensors at once."""

    def __init__(self, task: Task) -> None:
        buffers = task.buffers
        self.task = task
        self.device = torch.device(task.device)
        self.observations: Tensor = wp.to_torch(buffers.observations)  # (envs, observation)
        self.final_observations: Tensor = wp.to_torch(buffers.final_observations)
        self.images = _tensor(buffers.images)  # (envs, height, width, channels) uint8
        self.final_images = _tensor(buffers.final_images)
        self.privileged = _tensor(buffers.privileged)  # (envs, privileged elements)
        self.final_privileged = _tensor(buffers.final_privileged)
        layout = task.layout
        image, final_image = (self.images, self.final_images) if layout.image is not None else (None, None)
        privileged, final_privileged = (self.privileged, self.final_privileged) if layout.privileged else (None, None)
        self.observation = Observation(self.observations, image, privileged)
        self.final_observation = Observation(self.final_observations, final_image, final_privileged)
        self.rewards: Tensor = wp.to_torch(buffers.rewards)  # (envs,)
        self.outcomes: Tensor = wp.to_torch(buffers.outcomes)
        self.is_terminated: Tensor = wp.to_torch(buffers.is_terminated)
        self.is_truncated: Tensor = wp.to_torch(buffers.is_truncated)
        self._continuous = _actions(buffers.continuous)
        self._branches = _actions(buffers.branches)

    @property
    def is_skipped(self) -> Tensor | None:
        """In which rows the last step was no decision, shape (envs,); None: in no row of any step."""
        is_skipped = self.task.is_skipped
        return None if is_skipped is None else torch.from_numpy(is_skipped).to(self.device)

    def step(self, continuous: Tensor, branches: Tensor) -> None:
        """One decision of all environments.

        Args:
            continuous: in [-1, 1], shape (envs, continuous actions).
            branches: the choice of each branch, shape (envs, branches).
        """
        if self._continuous is not None:
            self._continuous.copy_(continuous)
        if self._branches is not None:
            self._branches.copy_(branches)
        if self.device.type == "cuda":
            with wp.ScopedStream(wp.stream_from_torch(torch.cuda.current_stream(self.device))):
                self.task.step()
        else:
            self.task.step()


def _tensor(array: Any) -> Tensor:
    """A view of an array, which may be one of no elements."""
    tensor: Tensor = wp.to_torch(array) if array.size else torch.from_numpy(array.numpy()).to(str(array.device))
    return tensor


def _actions(array: Any) -> Tensor | None:
    """A view of actions, if the task has any."""
    tensor: Tensor | None = wp.to_torch(array) if array.size else None
    return tensor
