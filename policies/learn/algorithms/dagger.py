"""DAgger (Ross, Gordon and Bagnell 2011, arXiv 1011.0686): a student learns what a teacher does wherever it gets to.

One iteration is a round: student and teacher drive some environments each, the teacher says what it would do in every
state that comes up, and the student takes gradient steps on stretches of all rounds so far, its memory going along.
The teacher sees the truth, the student what flies; beside the actions the student learns to say what it believes of
the truth (`policies/learn/networks/perception.py`).
"""

import copy
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from policies.learn.algorithms.learner import Iteration, means
from policies.learn.algorithms.schedule import RATE_FLOOR, scheduled
from policies.learn.algorithms.teacher import Teacher
from policies.learn.config.behavior import Behavior, DaggerHyperparameters
from policies.learn.networks.action_distributions import CLIP, ActionDistribution, Actions
from policies.learn.networks.observations import Observation
from policies.learn.networks.policy import Policy
from policies.learn.rollout.image_augmentation import augmented
from policies.learn.rollout.sequence_buffer import SequenceRing, Stretches
from policies.learn.rollout.task_tensors import TaskTensors
from policies.learn.signals.episode_rewards import EpisodeRewards
from policies.learn.signals.signal_losses import cloning_loss
from policies.tasks.task import Task

_SIGMA_FLOOR = 0.1  # of an action before it is clipped at 3: what PPO still explores with afterwards; guess


class Dagger:
    """A learner: see `policies/learn/algorithms/learner.py`."""

    def __init__(self, task: Task, policy: Policy, behavior: Behavior, teacher: Teacher, *, seed: int) -> None:
        """Resets the task.

        Args:
            task: its environments all belong to the learner.
            policy: the student, for the task's layout; trained in place.
            behavior: with DAgger's hyperparameters.
            teacher: for the task's privileged elements.
            seed: of the task's episodes, of who drives, of the draws of actions and stretches.
        """
        if not isinstance(behavior.hyperparameters, DaggerHyperparameters):
            raise TypeError("hyperparameters are not DAgger's")
        self.steps = 0
        self.hyperparameters = hyperparameters = behavior.hyperparameters
        self.behavior = behavior
        self.teacher = teacher
        self.task = TaskTensors(task)
        self.policy = policy.to(self.task.device)
        self.optimizer = torch.optim.Adam(self.policy.parameters(), lr=hyperparameters.learning_rate, fused=True)
        self._generator = torch.Generator(self.task.device).manual_seed(seed)
        memory = policy.settings.memory
        self.ring = SequenceRing(
            task.layout,
            hyperparameters.buffer_size,
            task.env_count,
            length=memory.sequence_length if memory else 1,
            memory_size=policy.memory_size,
            device=self.task.device,
        )
        self._round = 0
        self._memory = policy.start_memory(task.env_count)
        self._is_start = torch.ones(task.env_count, dtype=torch.bool, device=self.task.device)
        self._episode_rewards = EpisodeRewards(["extrinsic"], task.env_count, self.task.device)
        task.reset(seed)

    def iterate(self) -> Iteration:
        """One round: collects and learns."""
        teacher_fraction = self.hyperparameters.mixing**self._round
        stretches = self._stretches_per_round
        tags = [self._collect(teacher_fraction) for _ in range(stretches)]
        self._round += 1
        count = stretches * self.ring.length * self.task.task.env_count
        self.steps += count
        statistics = means(tags) | self._improve(count) | {"Policy/Teacher Share": teacher_fraction}
        return Iteration(count, self.task.task.take_scores(), statistics)

    def restart(self) -> None:
        """Begins an episode in every environment; what was remembered of the running ones is forgotten."""
        self.task.task.begin(np.ones(len(self._memory), dtype=np.bool_))
        self._memory = torch.zeros_like(self._memory)
        self._is_start = torch.ones_like(self._is_start)
        self._episode_rewards.clear()

    @property
    def _stretches_per_round(self) -> int:
        """Stretches of every environment that make a round: at least one, at most what the ring holds."""
        wanted = self.hyperparameters.steps_per_round // (self.ring.length * self.task.task.env_count)
        return min(max(wanted, 1), self.ring.slots)

    @torch.inference_mode()
    def _collect(self, teacher_fraction: float) -> dict[str, float]:
        """One stretch of every environment; who drives an environment drives the whole stretch."""
        task, ring = self.task, self.ring
        slot = ring.open(self._memory)
        draws = torch.rand(task.task.env_count, generator=self._generator, device=task.device)
        is_taught = (draws < teacher_fraction)[:, None]
        rewards, ends = [], []
        for t in range(ring.length):
            labels = self.teacher.actions(task.privileged)
            ring.record(slot, t, task.observation, labels, self._is_start)
            actions, memory = self.policy.act(task.observation, self._memory, self._generator)
            task.step(
                torch.where(is_taught, labels.continuous, self.policy.bounded(actions)),
                torch.where(is_taught, labels.branches, actions.branches),
            )
            self._is_start = task.is_terminated | task.is_truncated
            self._memory = memory.masked_fill(self._is_start[:, None], 0.0) if memory.shape[1] else memory
            rewards.append(task.rewards[:, None].clone())
            ends.append(self._is_start)
        self.policy.body.normalize(ring.vectors(slot))
        return self._episode_rewards.add(torch.stack(rewards), torch.stack(ends))

    def _improve(self, count: int) -> dict[str, float]:
        """Gradient steps on stretches of all rounds, as many as `num_epoch` asks for after so many new decisions."""
        hyperparameters, length = self.hyperparameters, self.ring.length
        rate = scheduled(
            hyperparameters.learning_rate,
            RATE_FLOOR,
            hyperparameters.learning_rate_schedule,
            self.steps / self.behavior.max_steps,
        )
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        size = max(hyperparameters.batch_size // length, 1)
        updates = max(round(hyperparameters.num_epoch * count / (size * length)), 1)
        rows = [self._learn(self.ring.draw(size, self._generator)) for _ in range(updates)]
        names = ("Losses/Imitation Loss", "Losses/Perception Loss")
        losses = torch.stack(rows).mean(0).tolist()
        return {**dict(zip(names, losses, strict=True)), "Policy/Learning Rate": rate}

    def _learn(self, stretches: Stretches) -> Tensor:
        """One gradient step; losses of actions and of beliefs, shape (2,)."""
        hyperparameters, observation = self.hyperparameters, stretches.observation
        image = (
            augmented(observation.image, hyperparameters.augmentation, self._generator)
            if observation.image is not None
            else None
        )
        shown = Observation(observation.vector, image)
        if self.policy.memory_size:
            features = self.policy.body(shown, stretches.memory, stretches.is_start)
        else:
            features = self.policy.body(shown)
        distribution = self.policy.heads(features)
        labels = stretches.actions
        actions_loss = cloning_loss(
            distribution.mean / CLIP, distribution.choice_logs, labels.continuous, labels.branches
        )
        beliefs_loss = actions_loss.new_zeros(())
        if self.policy.perception is not None and observation.privileged is not None:
            beliefs_loss = self.policy.perception.loss(features, observation.privileged)
        loss = actions_loss + hyperparameters.perception_strength * beliefs_loss + _sigma_loss(distribution, labels)
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        if hyperparameters.max_grad_norm is not None:
            nn.utils.clip_grad_norm_(self.policy.parameters(), hyperparameters.max_grad_norm)
        self.optimizer.step()
        return torch.stack((actions_loss.detach(), beliefs_loss.detach()))

    def state(self) -> dict[str, Any]:
        """A copy of all that going on takes; without the ring unless the settings ask for it."""
        state = {
            "steps": self.steps,
            "round": self._round,
            "policy": copy.deepcopy(self.policy.state_dict()),
            "optimizer": copy.deepcopy(self.optimizer.state_dict()),
            "generator": self._generator.get_state(),
            "memory": self._memory.clone(),
            "is_start": self._is_start.clone(),
            "running_sums": self._episode_rewards.sums.clone(),
            "task": self.task.task.state(),
        }
        return state | ({"ring": self.ring.state()} if self.hyperparameters.save_replay_buffer else {})

    def take_critics(self, state: Mapping[str, Any]) -> None:
        """A student has none."""

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on from a state of the same settings: bit for bit if the ring is in it."""
        self.steps = state["steps"]
        self._round = state["round"]
        self.policy.load_state_dict(state["policy"])
        self.optimizer.load_state_dict(copy.deepcopy(state["optimizer"]))
        self._generator.set_state(state["generator"].cpu())
        self._memory = state["memory"].clone().to(self.task.device)
        self._is_start = state["is_start"].clone().to(self.task.device)
        self._episode_rewards.load(state["running_sums"])
        self.task.task.load_state(state["task"])
        if "ring" in state:
            self.ring.load_state(state["ring"])


def _sigma_loss(distribution: ActionDistribution, labels: Actions) -> Tensor:
    """Fits a deviation to how far the student is off, without moving its means."""
    if not labels.continuous.shape[-1]:
        return distribution.mean.new_zeros(())
    off = CLIP * labels.continuous - distribution.mean.detach()
    log_sigma = distribution.log_sigma
    variance = off.square().mean(tuple(range(off.dim() - 1))).clamp(min=_SIGMA_FLOOR**2)
    return (0.5 * variance * (-2.0 * log_sigma).exp() + log_sigma).mean()
