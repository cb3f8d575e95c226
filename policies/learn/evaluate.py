"""A policy judged: it plays a fixed number of episodes in every environment, and these are counted.

In: a policy and a task. Out: how the episodes ended, with a confidence interval. Short episodes are not favoured: how
many episodes each environment plays is decided before the first one begins.
"""

from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray

from common.intervals import wilson_interval
from policies.learn.networks.policy import Policy
from policies.learn.rollout.task_tensors import TaskTensors
from policies.learn.torch_threads import few_threads
from policies.tasks.catalogue import build_task
from policies.tasks.episode import Outcome
from policies.tasks.task import Task, TaskSettings
from policies.tasks.task_params import Sampler

ENVIRONMENTS = 500  # at most, side by side
LONGEST = 10_000  # decisions after which an episode counts as a timeout: some tasks have no limit of their own (guess)


@dataclass(frozen=True, slots=True)
class Evaluation:
    """What the episodes came to."""

    outcomes: dict[str, int]  # episodes by name of the outcome, in lower case
    mean_return: float
    mean_length: float  # [decisions]
    says_success: bool = True  # whether the task does; else none of its episodes is one

    @property
    def episodes(self) -> int:
        return sum(self.outcomes.values())

    @property
    def success_rate(self) -> float:
        return self.outcomes["success"] / self.episodes

    @property
    def worth(self) -> tuple[bool, float]:
        """What policies are compared by: the success rate, or, where none succeeds, below that the mean return."""
        succeeds = self.says_success and self.success_rate > 0.0
        return succeeds, self.success_rate if succeeds else self.mean_return

    @property
    def interval(self) -> tuple[float, float]:
        """Of the success rate, 95 %."""
        return wilson_interval(self.outcomes["success"], self.episodes)


def evaluate(
    policy: Policy,
    name: str,
    settings: TaskSettings,
    *,
    episodes: int,
    seed: int,
    params: Mapping[str, float | Sampler] | None = None,
    is_greedy: bool = True,
    longest: int = LONGEST,
    source: str = "policy",
    progress: Callable[[int], None] | None = None,
) -> Evaluation:
    """Plays exactly so many episodes.

    Args:
        policy: what acts; it is not changed.
        name: the task.
        settings: of the task; its `split` says on which positions.
        episodes: how many count.
        seed: of the episodes, and of the actions if they are drawn.
        params: of the task, if they are not the settings' own.
        is_greedy: takes the most probable action; else it is drawn.
        longest: decisions after which an episode is cut and counts as a timeout.
        source: what messages call the policy.
        progress: is told now and then how many have ended.

    Raises:
        LayoutError: the policy was made for another task, or for other settings of it.
        NumberError: a number that the task has not.
    """
    device = next(policy.parameters()).device
    env_count = min(episodes, settings.env_count_max or ENVIRONMENTS, ENVIRONMENTS)
    with closing(build_task(name, env_count, settings, str(device))) as task:
        task.layout.require(policy.layout, source)
        task.set_params(params or {})
        task.reset(seed)
        generator = None if is_greedy else torch.Generator(device).manual_seed(seed)
        with few_threads(has_images=task.layout.image is not None):
            tally = _Tally(_quota(episodes, task.env_count), longest)
            evaluation = _play(policy, task, tally, generator, progress)
        return replace(evaluation, says_success=task.says_success)


def _quota(episodes: int, env_count: int) -> NDArray[np.int64]:
    """How many episodes of each environment count, shape (envs,)."""
    return np.array([episodes // env_count + (i < episodes % env_count) for i in range(env_count)], dtype=np.int64)


def _play(
    policy: Policy,
    task: Task,
    tally: "_Tally",
    generator: torch.Generator | None,
    progress: Callable[[int], None] | None,
) -> Evaluation:
    tensors = TaskTensors(task)
    memory = policy.start_memory(task.env_count)
    with torch.inference_mode():
        while not tally.is_complete:
            actions, memory = policy.act(tensors.observation, memory, generator)
            tensors.step(policy.bounded(actions), actions.branches)
            rewards, outcomes = tensors.rewards.cpu().numpy(), tensors.outcomes.cpu().numpy()
            is_over, is_cut = tally.count(rewards, outcomes, task.is_skipped)
            is_forgotten = is_over if task.is_skipped is None else is_over | task.is_skipped
            memory = memory.masked_fill(torch.from_numpy(is_forgotten).to(memory.device)[:, None], 0.0)
            if is_cut.any():
                task.begin(is_cut)
            if progress is not None and is_over.any():
                progress(tally.ended)
    return tally.evaluation()


class _Tally:
    """Counts episodes, as many of each environment as were asked for; shapes (envs,)."""

    def __init__(self, quota: NDArray[np.int64], longest: int) -> None:
        self._left = quota.copy()
        self._longest = longest
        self._returns = np.zeros(len(quota))
        self._steps = np.zeros(len(quota), dtype=np.int64)
        self._outcomes = np.zeros(len(Outcome), dtype=np.int64)
        self._return_sum = 0.0
        self._length_sum = 0

    @property
    def is_complete(self) -> bool:
        return not self._left.any()

    @property
    def ended(self) -> int:
        """How many episodes have been counted."""
        return int(self._outcomes.sum())

    def count(
        self,
        rewards: NDArray[np.float32],
        outcomes: NDArray[np.int32],
        is_skipped: NDArray[np.bool_] | None = None,
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Books one decision, where it was one; says where an episode is over, and where because it took too long."""
        self._returns += rewards
        self._steps += 1 if is_skipped is None else ~is_skipped
        is_ended = outcomes != Outcome.RUNNING
        is_cut = ~is_ended & (self._steps >= self._longest)
        is_over = is_ended | is_cut
        is_counted = is_over & (self._left > 0)
        ends = np.where(is_cut, Outcome.TIMEOUT, outcomes)[is_counted]
        self._outcomes += np.bincount(ends, minlength=len(Outcome))
        self._return_sum += float(self._returns[is_counted].sum())
        self._length_sum += int(self._steps[is_counted].sum())
        self._left -= is_counted
        self._returns[is_over] = 0.0
        self._steps[is_over] = 0
        return is_over, is_cut

    def evaluation(self) -> Evaluation:
        count = int(self._outcomes.sum())
        outcomes = {outcome.name.lower(): int(self._outcomes[outcome]) for outcome in Outcome if outcome}
        return Evaluation(outcomes, self._return_sum / count, self._length_sum / count)
