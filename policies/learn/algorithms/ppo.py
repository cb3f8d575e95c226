"""PPO (Schulman et al. 2017, arXiv 1707.06347) in ML-Agents' form, on many environments at once.

One iteration: T decisions of N environments are collected, the critic estimates their returns by reward signal,
advantages are averaged over the signals, and actor and critic take some epochs of minibatches. Options of ours that
ML-Agents does not have are off by default (`policies/learn/config/behavior.py` says which they are).
"""

import copy
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from policies.learn.algorithms import ppo_losses
from policies.learn.algorithms.gae import advantages, cut_at_horizon
from policies.learn.algorithms.learner import Companion, Iteration, load_if_fitting, means
from policies.learn.algorithms.schedule import BETA_FLOOR, EPSILON_FLOOR, RATE_FLOOR, scheduled, sharpened
from policies.learn.config.behavior import Behavior, PpoHyperparameters
from policies.learn.networks.action_distributions import CLIP
from policies.learn.networks.networks import Body, Critic, policy_body, privileged_body
from policies.learn.networks.observations import Observation
from policies.learn.networks.policy import Policy
from policies.learn.rollout.rollout import Batch, Rollout
from policies.learn.rollout.task_tensors import TaskTensors
from policies.learn.signals.episode_rewards import EpisodeRewards
from policies.learn.signals.extrinsic import ExtrinsicSignal
from policies.learn.signals.signal import RewardSignal, Transitions
from policies.tasks.task import Task

_CRITIC_SEED = 1_000_003  # apart from the policy's: their bodies are to begin with other weights
_ROWS = 8192  # observations the critic values at once: what they pass through stays in the processor's cache
_IMAGES = 256  # the same of images


class Ppo:
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
    ) -> None:
        """Resets the task and makes the critic.

        Args:
            task: its environments all belong to the learner.
            policy: for the task's layout; trained in place.
            behavior: with PPO's hyperparameters.
            signals: what is rewarded; their order is that of the value heads.
            seed: of the task's episodes, the critic's weights, the draws of actions and of minibatches.
            cloning: of demonstrations, on the same policy; none: off.
        """
        if not isinstance(behavior.hyperparameters, PpoHyperparameters):
            raise TypeError("hyperparameters are not PPO's")
        self.steps = 0
        self._is_warming_up = False
        self.hyperparameters = behavior.hyperparameters
        self.behavior = behavior
        self.signals = list(signals)
        self.cloning = cloning
        self.task = TaskTensors(task)
        device = self.task.device
        self.policy = policy.to(device)
        self.critic = self._critic(torch.Generator().manual_seed(seed + _CRITIC_SEED)).to(device)
        parameters = dict.fromkeys([*self.policy.parameters(), *self.critic.parameters()])  # a shared body once
        self._parameters: list[nn.Parameter] = list(parameters)
        self.optimizer = torch.optim.Adam(self._parameters, lr=self.hyperparameters.learning_rate, fused=True)
        self._generator = torch.Generator(device).manual_seed(seed)
        self._rollout = self._store(task)
        self._memory = policy.start_memory(task.env_count)
        self._critic_memory = policy.start_memory(task.env_count)
        self._gammas = torch.tensor([signal.gamma for signal in self.signals], device=device)
        self._is_episodic = torch.tensor([signal.is_episodic for signal in self.signals], device=device)
        self._episode_rewards = EpisodeRewards([signal.name for signal in self.signals], task.env_count, device)
        task.reset(seed)

    def iterate(self) -> Iteration:
        """Collects, estimates and learns once."""
        rollout = self._rollout
        before = self.steps
        self._is_warming_up = before < self.hyperparameters.critic_warm_up
        self._collect(rollout)
        while not (count := rollout.decision_count):  # every environment has just begun by itself
            self._collect(rollout)
        self.steps += count
        has_learned_signals = any(not isinstance(signal, ExtrinsicSignal) for signal in self.signals)
        transitions = rollout.transitions() if has_learned_signals else None
        rewards = self._rewards(rollout, transitions)
        statistics = self._estimate(rollout, rewards) | self._improve(rollout, transitions)
        if self.cloning is not None and not self._is_warming_up:
            statistics |= self.cloning.update(self.steps)
        most = self.behavior.max_steps
        self.policy.heads.sharpen(sharpened(self.hyperparameters.sharpening, before / most, self.steps / most))
        return Iteration(count, self.task.task.take_scores(), statistics)

    def restart(self) -> None:
        """Begins an episode in every environment; what was remembered of the running ones is forgotten."""
        self.task.task.begin(np.ones(len(self._memory), dtype=np.bool_))
        self._memory = torch.zeros_like(self._memory)
        self._critic_memory = torch.zeros_like(self._critic_memory)
        self._episode_rewards.clear()

    @torch.inference_mode()
    def _collect(self, rollout: Rollout) -> None:
        """T decisions of all environments."""
        rollout.begin(self.task)
        for t in range(len(rollout.rewards)):
            if t % rollout.sequence_length == 0:
                rollout.memories[t // rollout.sequence_length] = self._memory
            features, memory = self.policy.body.step(rollout.observation[t], self._memory)
            distribution = self.policy.heads(features)
            actions = distribution.draw(self._generator)
            self.task.step(self.policy.bounded(actions), actions.branches)
            rollout.record(t, actions, distribution.log_probs(actions), self.task)
            is_cut, is_skipped = self.task.is_terminated | self.task.is_truncated, self.task.is_skipped
            if is_skipped is not None:
                rollout.skip(t, is_skipped)
                is_cut = is_cut | is_skipped
            self._memory = memory.masked_fill(is_cut[:, None], 0.0) if memory.shape[1] else memory
        if not rollout.decision_count:
            return
        seen = rollout.observation[:-1].mapped(rollout.decided)
        if not self._is_warming_up:
            self.policy.body.normalize(seen)  # the critic's too, unless it sees something else
        if self.critic.body.is_privileged:
            self.critic.body.normalize(seen)

    def _rewards(self, rollout: Rollout, transitions: Transitions | None) -> Tensor:
        """Of every signal times its strength, shape (T, N, signals)."""
        streams = [rollout.rewards if transitions is None else signal.rewards(transitions) for signal in self.signals]
        rewards = torch.stack([s.strength * stream for s, stream in zip(self.signals, streams, strict=True)], dim=-1)
        return rewards if rollout.is_skipped is None else rewards.masked_fill(rollout.is_skipped[..., None], 0.0)

    @torch.inference_mode()
    def _estimate(self, rollout: Rollout, rewards: Tensor) -> dict[str, float]:
        """Values, advantages and returns of the whole rollout."""
        values, next_values = self._recurrent_values(rollout) if self.policy.memory_size else self._values(rollout)
        is_over = rollout.is_over
        is_final = rollout.is_terminated[..., None] & self._is_episodic
        is_cut = cut_at_horizon(rollout.is_cut, self.behavior.time_horizon)
        streams = advantages(rewards, values, next_values, is_final, is_cut, self._gammas, self.hyperparameters.lambd)
        returns = streams + values
        if self.critic.normalizer is not None:
            self.critic.normalizer.update(rollout.decided(returns))
        rollout.values.copy_(self.critic.own_unit(values))
        rollout.returns.copy_(self.critic.own_unit(returns))
        combined = streams.mean(-1)
        over_buffer = self.hyperparameters.normalize_advantages == "buffer"
        decided = rollout.decided(combined)
        rollout.advantages.copy_(ppo_losses.standardized(combined, decided) if over_buffer else combined)
        estimates = {
            f"Policy/{signal.name.capitalize()} Value Estimate": value
            for signal, value in zip(self.signals, rollout.decided(values).mean((0, 1)).tolist(), strict=True)
        }
        return estimates | self._episode_rewards.add(rewards, is_over)

    def _values(self, rollout: Rollout) -> tuple[Tensor, Tensor]:
        """Of what each decision saw, and of what came of it, shape (T, N, signals) each."""
        observation = rollout.observation.mapped(lambda part: part.flatten(0, 1))
        values = self._valued(observation).view(*rollout.observations.shape[:2], -1)
        next_values = values[1:].clone()
        next_values[rollout.is_over] = self._valued(rollout.last_seen())
        return values[:-1], next_values

    def _valued(self, observation: Observation) -> Tensor:
        """What the critic says of rows, shape (rows, signals)."""
        size = _ROWS if self.critic.body.encoder is None else _IMAGES
        count = len(observation.vector)
        return torch.cat([self.critic(observation[first : first + size]) for first in range(0, max(count, 1), size)])

    def _recurrent_values(self, rollout: Rollout) -> tuple[Tensor, Tensor]:
        """As `_values`, with the critic's memory going along, forgetting where episodes end."""
        values, next_values = [], []
        for t, is_cut in enumerate(rollout.is_cut):
            if t % rollout.sequence_length == 0:
                rollout.critic_memories[t // rollout.sequence_length] = self._critic_memory
            value, memory = self.critic.step(rollout.observation[t], self._critic_memory)
            values.append(value)
            next_values.append(self.critic.step(rollout.next_observation(t), memory)[0])
            self._critic_memory = memory.masked_fill(is_cut[:, None], 0.0)
        return torch.stack(values), torch.stack(next_values)

    def _improve(self, rollout: Rollout, transitions: Transitions | None) -> dict[str, float]:
        """Epochs of minibatches on actor and critic, and on the signals that learn."""
        hyperparameters = self.hyperparameters
        done = self.steps / self.behavior.max_steps
        rate = scheduled(hyperparameters.learning_rate, RATE_FLOOR, hyperparameters.learning_rate_schedule, done)
        beta = scheduled(hyperparameters.beta, BETA_FLOOR, hyperparameters.beta_schedule, done)
        epsilon = scheduled(hyperparameters.epsilon, EPSILON_FLOOR, hyperparameters.epsilon_schedule, done)
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        sums = torch.zeros(3, device=self.task.device)
        of_signals: list[dict[str, float]] = []
        update_count = 0
        for _epoch in range(hyperparameters.num_epoch):
            moved = []
            for batch in rollout.minibatches(hyperparameters.batch_size, self._generator):
                parts, divergence = self._learn(batch, epsilon, beta)
                sums += parts
                moved.append(divergence)
                update_count += 1
                if transitions is not None:
                    of_signals.append(self._teach_signals(transitions, batch))
            if hyperparameters.target_kl is not None and torch.stack(moved).mean() > hyperparameters.target_kl:
                break
        policy_loss, value_loss, entropy = (sums / update_count).tolist()
        return means(of_signals) | {
            "Losses/Policy Loss": policy_loss,
            "Losses/Value Loss": value_loss,
            "Policy/Entropy": entropy,
            "Policy/Learning Rate": rate,
            "Policy/Epsilon": epsilon,
            "Policy/Beta": beta,
        }

    def _learn(self, batch: Batch, epsilon: float, beta: float) -> tuple[Tensor, Tensor]:
        """One gradient step; size of policy loss, value loss, entropy, shape (3,), and how far the policy had moved."""
        features = self._features(self.policy.body, batch)
        distribution = self.policy.heads(features)
        believed = self._beliefs_loss(features, batch)
        if not self.hyperparameters.shared_critic:
            features = self._features(self.critic.body, batch)
        log_probs, old_log_probs = distribution.log_probs(batch.actions), batch.log_probs
        if self.hyperparameters.joint_ratio:
            log_probs, old_log_probs = log_probs.sum(-1, keepdim=True), old_log_probs.sum(-1, keepdim=True)
        weights = batch.advantages
        if self.hyperparameters.normalize_advantages == "minibatch":
            weights = ppo_losses.standardized(weights)
        policy_loss = ppo_losses.policy_loss(log_probs, old_log_probs, weights, epsilon)
        reach = math.inf if self._is_warming_up else epsilon  # a new critic has far to go
        value_loss = ppo_losses.value_loss(self.critic.heads(features), batch.values, batch.returns, reach)
        entropy = distribution.entropy().mean()
        loss = 0.5 * value_loss
        if not self._is_warming_up:
            loss = loss + policy_loss - beta * entropy + self.hyperparameters.perception_strength * believed
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        if self.hyperparameters.max_grad_norm is not None:
            nn.utils.clip_grad_norm_(self._parameters, self.hyperparameters.max_grad_norm)
        self.optimizer.step()
        with torch.no_grad():
            return torch.stack((policy_loss.abs(), value_loss, entropy)), ppo_losses.divergence(
                log_probs, old_log_probs
            )

    def _beliefs_loss(self, features: Tensor, batch: Batch) -> Tensor | float:
        """Of a policy that says what it believes: else its beliefs would go astray as its features change."""
        perception, privileged = self.policy.perception, batch.observation.privileged
        if privileged is not None and batch.counted is not None:
            privileged = privileged[batch.counted]
        return perception.loss(features, privileged) if perception is not None and privileged is not None else 0.0

    def _features(self, body: Body, batch: Batch) -> Tensor:
        """Of the decisions of a minibatch, flat, shape (B, features)."""
        sequences, counted = batch.sequences, batch.counted
        if sequences is None:
            features: Tensor = body(batch.observation)
            return features if counted is None else features[counted]
        memory = sequences.memory if body is self.policy.body else sequences.critic_memory
        observation = batch.observation.mapped(lambda part: part.view(*sequences.is_start.shape, *part.shape[1:]))
        outputs: Tensor = body(observation, memory, sequences.is_start)
        return outputs.flatten(0, 1) if counted is None else outputs.flatten(0, 1)[counted]

    def _teach_signals(self, transitions: Transitions, batch: Batch) -> dict[str, float]:
        """One update of every signal that learns, on the decisions of a minibatch."""
        envs = transitions.rewards.shape[1]
        chosen = transitions[batch.rows // envs, batch.rows % envs]
        statistics: dict[str, float] = {}
        for signal in self.signals:
            statistics |= signal.update(chosen)
        return statistics

    def _critic(self, generator: torch.Generator) -> Critic:
        """With a body of its own unless it is shared; one normaliser serves both where they see the same."""
        policy, hyperparameters = self.policy, self.hyperparameters
        if hyperparameters.privileged_critic:
            body = privileged_body(policy.layout, policy.settings, generator)
        else:
            body = (
                policy.body if hyperparameters.shared_critic else policy_body(policy.layout, policy.settings, generator)
            )
            body.normalizer = policy.body.normalizer
        return Critic(body, len(self.signals), generator, normalizes=hyperparameters.normalize_returns)

    def _store(self, task: Task) -> Rollout:
        """Room for buffer_size decisions, in whole rounds of all environments and in whole sequences."""
        steps = math.ceil(self.hyperparameters.buffer_size / task.env_count)
        memory = self.policy.settings.memory
        length = min(memory.sequence_length, steps) if memory else 1
        steps = math.ceil(steps / length) * length
        sizes = (self.policy.memory_size, length)
        return Rollout(task.layout, (steps, task.env_count), len(self.signals), sizes, self.task.device)

    def state(self) -> dict[str, Any]:
        """A copy of all that going on takes."""
        return copy.deepcopy(
            {
                "steps": self.steps,
                "policy": self.policy.state_dict(),
                "critic": self.critic.state_dict(),
                "optimizer": self.optimizer.state_dict(),
                "generator": self._generator.get_state(),
                "memory": self._memory.clone(),
                "critic_memory": self._critic_memory.clone(),
                "running_sums": self._episode_rewards.sums.clone(),
                "signals": [signal.state() for signal in self.signals],
                "cloning": self.cloning.state() if self.cloning is not None else {},
                "task": self.task.task.state(),
            }
        )

    def take_critics(self, state: Mapping[str, Any]) -> None:
        """Starts from another run's critic if it fits, and explores around its policy no more than is asked for."""
        load_if_fitting(self.critic, state.get("critic", {}))
        deviation, log_sigma = self.hyperparameters.start_deviation, self.policy.heads.log_sigma
        if deviation is not None and isinstance(log_sigma, nn.Parameter):
            log_sigma.data.clamp_(max=math.log(CLIP * deviation))

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on bit for bit from a state of the same settings."""
        state = copy.deepcopy(dict(state))
        self.steps = state["steps"]
        self.policy.load_state_dict(state["policy"])
        self.critic.load_state_dict(state["critic"])
        self.optimizer.load_state_dict(state["optimizer"])
        self._generator.set_state(state["generator"].cpu())
        self._memory = state["memory"].to(self.task.device)
        self._critic_memory = state["critic_memory"].to(self.task.device)
        self._episode_rewards.load(state["running_sums"])
        for signal, its_state in zip(self.signals, state["signals"], strict=True):
            signal.load_state(its_state)
        if self.cloning is not None:
            self.cloning.load_state(state["cloning"])
        self.task.task.load_state(state["task"])
