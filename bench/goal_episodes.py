"""The first episode of every environment of a task with goals, played by a policy's most probable actions."""

from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray

from policies.learn.networks.policy import Policy
from policies.learn.rollout.task_tensors import TaskTensors
from policies.learn.torch_threads import few_threads
from policies.tasks.drive.drive import Drive
from policies.tasks.episode import Outcome
from policies.tasks.navigate.navigate import Navigate

Outcomes = NDArray[np.int32]


def first_episodes(
    policy: Policy,
    task: Navigate | Drive,
    longest: int,
    on_decision: Callable[[Outcomes], None] = lambda _: None,
) -> tuple[Outcomes, NDArray[np.float32]]:
    """How they ended, and the task's measures (episodes, MEASURES) of their last decisions.

    Args:
        policy: made for the task.
        task: that has been reset.
        longest: decisions of an episode; time is up before.
        on_decision: is told before each which episodes run.
    """
    task.layout.require(policy.layout, "the policy")
    count = task.env_count
    outcomes = np.zeros(count, dtype=np.int32)
    measures = np.zeros((count, task.measures.shape[1]), dtype=np.float32)
    tensors, memory = TaskTensors(task), policy.start_memory(count)
    with few_threads(), torch.inference_mode():
        for _ in range(longest):
            on_decision(outcomes)
            actions, memory = policy.act(tensors.observation, memory, None)
            tensors.step(policy.bounded(actions), actions.branches)
            ended = (outcomes == Outcome.RUNNING) & (task.buffers.outcomes.numpy() != Outcome.RUNNING)
            outcomes[ended] = task.buffers.outcomes.numpy()[ended]
            measures[ended] = task.measures.numpy()[ended]
            if (outcomes != Outcome.RUNNING).all():
                break
    return outcomes, measures
