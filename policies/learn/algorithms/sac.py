"""Soft actor-critic as a learner: decisions of all environments go into a replay buffer, batches of it into updates.

The form is the later one (Haarnoja et al. 2018, arXiv 1812.05905): the target of the two critics is a slowly following
copy of themselves. ML-Agents has the first form, whose target is that of a third, separate value network. The keys mean
what they mean there:

    buffer_size, batch_size     decisions the buffer holds, and decisions per update
    buffer_init_steps           decisions, drawn evenly from all possible ones, before the first update
    steps_per_update            decisions of all environments together per update, on average over the run
    reward_signal_steps_per_update   the same for the reward signals
    tau                         how far the target follows at each update (there: the target of the value network)
    init_entcoef                first temperature of the continuous part and of each branch; then each is adjusted
    save_replay_buffer          whether a state holds the buffer. With it a run goes on bit for bit; without, it goes on
                                with an empty buffer and updates wait until `batch_size` decisions lie in it

Different from there: the ring gives up its oldest round when it is full, not a fifth of it at once; entropy counts for
the first reward signal, not for each; a choice is worth a base value plus values of its branches, not their mean.
"""

import copy
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
import warp as wp
from torch import Tensor

from policies.learn.algorithms.learner import Companion, Iteration, load_if_fitting, means
from policies.learn.algorithms.sac_update import SoftActorCritic
from policies.learn.algorithms.schedule import RATE_FLOOR, scheduled
from policies.learn.config.behavior import Behavior, SacHyperparameters
from policies.learn.networks.policy import Policy
from policies.learn.rollout.hindsight import Hindsight
from policies.learn.rollout.replay_buffer import Replay, ReplayBatch
from policies.learn.rollout.task_tensors import TaskTensors
from policies.learn.signals.episode_rewards import EpisodeRewards
from policies.learn.signals.extrinsic import ExtrinsicSignal
from policies.learn.signals.signal import RewardSignal, Transitions
from policies.offline.conservative_start import ConservativeStart
from policies.tasks.episode import Outcome
from policies.tasks.task import Task

_ITERATION_STEPS = 1000  # decisions, at least, between two turns of the training loop


class SacError(ValueError):
    """What soft actor-critic does not do; the message is one sentence for the user."""


class Sac:
    """A learner: see `policies/learn/algorithms/learner.py`."""

    def __init__(
        self,
        task: Task,
        policy: Policy,
        behavior: Behavior,
        signals: Sequence[RewardSignal],
        *,
        seed: int,
        cloning: Companion | None = None,
        start: ConservativeStart | None = None,
    ) -> None:
        """Resets the task and makes critics and a buffer.

        Args:
            task: its environments all belong to the learner.
            policy: for the task's layout, squashed; trained in place.
            behavior: with SAC's hyperparameters.
            signals: what is rewarded.
            seed: of the task's episodes, the critics' weights, the draws of actions and of batches.
            cloning: of demonstrations, on the same policy; none: off.
            start: a dataset that the buffer begins with, and whose actions the policy is held at; none: neither.

        Raises:
            SacError: a policy with memory, a buffer that never holds a batch, or hindsight where the observation tells
                too little of the goal, or beside a dataset.
        """
        if not isinstance(behavior.hyperparameters, SacHyperparameters) or not policy.is_squashed:
            raise TypeError("hyperparameters or policy are not SAC's")
        if policy.memory_size:
            raise SacError("network_settings: memory: is not supported with trainer_type sac; stack observations")
        self.steps = 0
        self.hyperparameters = behavior.hyperparameters
        self.signals = list(signals)
        self.cloning = cloning
        self._behavior = behavior
        self.task = TaskTensors(task)
        device = self.task.device
        self.policy = policy.to(device)
        weights = torch.Generator().manual_seed(seed)
        self.networks = SoftActorCritic(self.policy, self.hyperparameters, self.signals, weights)
        self._generator = torch.Generator(device).manual_seed(seed)
        self.replay = _replay(task, self.hyperparameters, device)
        self._start = start
        if start is not None:
            if self.hyperparameters.hindsight:
                raise SacError("hyperparameters: hindsight: cannot be with a dataset, whose goals it does not know")
            start.fill(self.replay, self._generator)
        self._hindsight = _hindsight(task, self.replay, self.hyperparameters.hindsight)
        self._radii = _task_param(task, self._hindsight.goal.radius) if self._hindsight is not None else None
        self._update_count = 0
        self._signal_update_count = 0
        self._is_episodic = torch.tensor([signal.is_episodic for signal in signals], device=device)
        self._strengths = torch.tensor([signal.strength for signal in signals], device=device)
        self._episode_rewards = EpisodeRewards([signal.name for signal in self.signals], task.env_count, device)
        self._no_memory = policy.start_memory(task.env_count)
        task.reset(seed)

    def iterate(self) -> Iteration:
        """Rounds of one decision of all environments, each with the updates that are then due."""
        hyperparameters = self.hyperparameters
        statistics: list[dict[str, float]] = []
        collected: list[tuple[Tensor, Tensor]] = []
        before, rounds = self.steps, -(-_ITERATION_STEPS // self.replay.env_count)
        for _round in range(rounds):
            collected.append(self._collect())
            self.networks.set_learning_rate(self._learning_rate())
            due = self._due(hyperparameters.steps_per_update, self._update_count)
            statistics.extend(self._update() for _ in range(due))
            due = self._due(hyperparameters.reward_signal_steps_per_update, self._signal_update_count)
            statistics.extend(self._update_signals() for _ in range(due))
        rewards, is_ended = (torch.stack(column) for column in zip(*collected, strict=True))
        now = self.networks.temperatures() | {"Policy/Learning Rate": self._learning_rate()}
        now |= self._episode_rewards.add(rewards, is_ended)
        return Iteration(self.steps - before, self.task.task.take_scores(), means(statistics) | now)

    def restart(self) -> None:
        """Begins an episode in every environment; hindsight takes it for another than the running one."""
        self.task.task.begin(np.ones(self.replay.env_count, dtype=np.bool_))
        self._episode_rewards.clear()
        if self._hindsight is not None:
            self._hindsight.cut()

    @torch.no_grad()
    def _collect(self) -> tuple[Tensor, Tensor]:
        """One decision of all environments, into the buffer; what the signals paid (envs, signals), and which ended."""
        task = self.task
        observations = task.observations.clone()
        continuous, branches = self._decide(observations)
        radii = None if self._radii is None else self._radii.clone()  # of this episode, not of the next
        task.step(continuous, branches)
        is_ended = task.is_terminated | task.is_truncated
        if self._hindsight is not None and radii is not None:
            self._hindsight.add(radii, is_ended, task.outcomes == int(Outcome.SUCCESS))
        made = ReplayBatch(
            observations=observations,
            next_observations=torch.where(is_ended[:, None], task.final_observations, task.observations),
            continuous=continuous,
            branches=branches,
            rewards=task.rewards,
            is_terminated=task.is_terminated,
            is_ended=is_ended,
        )
        is_skipped = task.is_skipped
        is_decided = slice(None) if is_skipped is None else ~is_skipped
        if count := len(observations[is_decided]):
            self.replay.add(made, is_skipped)
            self.policy.body.normalize(observations[is_decided])
        self.steps += count
        rewards = self._rewards(made.transitions())
        return rewards if is_skipped is None else rewards.masked_fill(is_skipped[:, None], 0.0), is_ended

    def _rewards(self, transitions: Transitions) -> Tensor:
        """Of every signal times its strength, shape (B, signals)."""
        return torch.stack([signal.rewards(transitions) for signal in self.signals], dim=1) * self._strengths

    def _decide(self, observations: Tensor) -> tuple[Tensor, Tensor]:
        """The policy's draws; before the first updates any action is as likely as any other."""
        if self.steps >= self.hyperparameters.buffer_init_steps:
            actions, _ = self.policy.act(observations, self._no_memory, self._generator)
            return self.policy.bounded(actions), actions.branches
        layout = self.policy.layout
        chance = torch.rand(
            len(observations),
            len(layout.continuous) + len(layout.branches),
            generator=self._generator,
            device=observations.device,
        )
        dimensions = len(layout.continuous)
        sizes = torch.tensor(layout.branch_sizes, device=observations.device)
        return 2.0 * chance[:, :dimensions] - 1.0, (chance[:, dimensions:] * sizes).long()

    def _due(self, steps_per_update: float, update_count: int) -> int:
        """Updates that the steps since the buffer's first filling call for."""
        if len(self.replay) < self.hyperparameters.batch_size:
            return 0
        return max(0, int((self.steps - self.hyperparameters.buffer_init_steps) / steps_per_update) - update_count)

    def _drawn(self) -> ReplayBatch:
        """A batch from the buffer."""
        indices = self.replay.draw(self.hyperparameters.batch_size, self._generator)
        batch = self.replay.take(indices)
        return batch if self._hindsight is None else self._hindsight.relabel(batch, indices, self._generator)

    def _update(self) -> dict[str, float]:
        """Networks, and the clone if there is one."""
        batch = self._drawn()
        goes_on = 1.0 - batch.is_terminated[:, None] * self._is_episodic
        rewards, held = self._rewards(batch.transitions()), self._held()
        statistics = self.networks.update(batch, rewards, goes_on, self._generator, held)
        self._update_count += 1
        return statistics if self.cloning is None else statistics | self.cloning.update(self.steps)

    def _held(self) -> tuple[ReplayBatch, float] | None:
        """Recorded decisions, and by which weight the policy is still held at them."""
        weight = self._start.weight(self.steps) if self._start is not None else 0.0
        return (self._start.batch(self._generator), weight) if self._start is not None and weight else None

    def _update_signals(self) -> dict[str, float]:
        """Reward signals that learn."""
        self._signal_update_count += 1
        statistics: dict[str, float] = {}
        if not all(isinstance(signal, ExtrinsicSignal) for signal in self.signals):
            batch = self._drawn().transitions()
            for signal in self.signals:
                statistics |= signal.update(batch)
        return statistics

    def _learning_rate(self) -> float:
        done = self.steps / self._behavior.max_steps
        return scheduled(
            self.hyperparameters.learning_rate, RATE_FLOOR, self.hyperparameters.learning_rate_schedule, done
        )

    def state(self) -> dict[str, Any]:
        """A copy of all that going on takes; of the buffer if `save_replay_buffer` says so."""
        state = {
            "steps": self.steps,
            "update_counts": [self._update_count, self._signal_update_count],
            "networks": copy.deepcopy(self.networks.state()),
            "generator": self._generator.get_state(),
            "running_sums": self._episode_rewards.sums.clone(),
            "signals": copy.deepcopy([signal.state() for signal in self.signals]),
            "cloning": copy.deepcopy(self.cloning.state()) if self.cloning is not None else {},
            "task": self.task.task.state(),
        }
        if self.hyperparameters.save_replay_buffer:
            state["replay"] = self.replay.state()
            state["hindsight"] = self._hindsight.state() if self._hindsight is not None else {}
        return state

    def take_critics(self, state: Mapping[str, Any]) -> None:
        """Starts from another run's critics and targets if they fit."""
        networks = state.get("networks", {})
        load_if_fitting(self.networks.critics, networks.get("critics", {}))
        load_if_fitting(self.networks.targets, networks.get("targets", {}))

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on from a state of the same settings: bit for bit if the buffer is in it."""
        self.steps = state["steps"]
        self._update_count, self._signal_update_count = state["update_counts"]
        self.networks.load_state(copy.deepcopy(state["networks"]))
        self._generator.set_state(state["generator"].cpu())
        self._episode_rewards.load(state["running_sums"])
        for signal, its_state in zip(self.signals, copy.deepcopy(state["signals"]), strict=True):
            signal.load_state(its_state)
        if self.cloning is not None:
            self.cloning.load_state(copy.deepcopy(state["cloning"]))
        self.task.task.load_state(state["task"])
        if "replay" in state:
            self.replay.load_state(state["replay"])
            if self._hindsight is not None:
                self._hindsight.load_state(state["hindsight"])


def _replay(task: Task, hyperparameters: SacHyperparameters, device: torch.device) -> Replay:
    """An empty buffer."""
    layout = task.layout
    sizes = len(layout.continuous), len(layout.branches)
    replay = Replay(hyperparameters.buffer_size, task.env_count, layout.observation_size, sizes, device)
    if replay.capacity < hyperparameters.batch_size:
        raise SacError(
            f"hyperparameters: buffer_size: {hyperparameters.buffer_size} holds {replay.capacity} steps "
            f"in whole rounds of {task.env_count} environments: never a batch of {hyperparameters.batch_size}"
        )
    return replay


def _hindsight(task: Task, replay: Replay, goals_per_transition: int) -> Hindsight | None:
    if not goals_per_transition:
        return None
    if task.goal is None or task.layout.stack > 1:
        raise SacError(
            f"hyperparameters: hindsight: is not possible with {task.layout.task} as it is set: "
            "single observations must hold the goal and the place to be brought to it"
        )
    return Hindsight(task.goal, replay, goals_per_transition)


def _task_param(task: Task, name: str) -> Tensor:
    """One parameter of all running episodes, shape (envs,): live."""
    params: Tensor = wp.to_torch(task.buffers.params)
    return params[:, task.param_table.names.index(name)]
