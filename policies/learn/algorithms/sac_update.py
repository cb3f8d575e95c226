"""One gradient step of soft actor-critic: critics, policy and temperatures together, then the targets follow.

Transitions and their rewards in, changed networks out. The losses are those of `sac_losses`; all three are taken before
any network changes, as ML-Agents takes them.
"""

import copy
from collections.abc import Mapping, Sequence
from typing import Any

import torch
from torch import Tensor, nn

from policies.learn.algorithms.sac_losses import (
    action_values,
    critic_losses,
    critic_targets,
    entropies,
    expected_values,
    policy_loss,
    target_entropies,
    temperature_loss,
)
from policies.learn.config.behavior import SacHyperparameters
from policies.learn.networks.action_distributions import ActionDistribution
from policies.learn.networks.dense_layers import value_heads
from policies.learn.networks.networks import Body
from policies.learn.networks.policy import Policy
from policies.learn.rollout.replay_buffer import ReplayBatch
from policies.learn.signals.signal import RewardSignal
from policies.learn.signals.signal_losses import cloning_loss

_LOSS_TAGS = ("Losses/Q1 Loss", "Losses/Q2 Loss", "Losses/Policy Loss")


class ActionCritic(nn.Module):
    """What observation and continuous actions are worth, and each choice of each branch: as `sac_losses` reads it."""

    def __init__(self, policy: Policy, signal_count: int, generator: torch.Generator) -> None:
        super().__init__()
        layout, settings = policy.layout, policy.settings
        sizes = layout.branch_sizes
        self._columns = 1 + len(sizes) * max(sizes, default=0)
        raw = settings.model_copy(update={"normalize": False})  # what the policy sees is normalised already
        self.body = Body(
            layout.observation_size + len(layout.continuous), raw, generator, tuple(policy.body.goal_indices)
        )
        self.heads = value_heads(self.body.size, signal_count * self._columns, generator)

    def forward(self, inputs: Tensor) -> Tensor:
        """Of observations and continuous actions side by side, shape (B, signals, 1 + branches x choices)."""
        outputs: Tensor = self.heads(self.body(inputs))
        return outputs.reshape(len(inputs), -1, self._columns)


class SoftActorCritic:
    """Policy, two critics, their targets, and a temperature for the continuous part and for each branch."""

    def __init__(
        self,
        policy: Policy,
        hyperparameters: SacHyperparameters,
        signals: Sequence[RewardSignal],
        generator: torch.Generator,
    ) -> None:
        """Untrained critics for a policy.

        Args:
            policy: squashed, without memory.
            hyperparameters: learning rate, tau, the first temperature.
            signals: what is rewarded.
            generator: draws the critics' weights.
        """
        device = next(policy.parameters()).device
        layout = policy.layout
        self.policy = policy
        self._value_tags = [f"Policy/{signal.name.capitalize()} Value" for signal in signals]
        self.critics = nn.ModuleList(ActionCritic(policy, len(signals), generator) for _ in range(2)).to(device)
        self.targets = copy.deepcopy(self.critics).requires_grad_(False)
        targets = target_entropies(len(layout.continuous), layout.branch_sizes)
        self._entropy_targets = torch.tensor(targets, device=device)
        self._split = [int(bool(layout.continuous)), len(layout.branches)]
        self.log_temperatures = torch.full_like(self._entropy_targets, hyperparameters.init_entcoef).log_()
        self.log_temperatures.requires_grad_()
        self._gammas = torch.tensor([signal.gamma for signal in signals], device=device)
        self._tau = hyperparameters.tau
        self._max_grad_norm = hyperparameters.max_grad_norm
        self._parts: list[list[Tensor]] = [
            list(self.critics.parameters()),
            list(policy.parameters()),
            [self.log_temperatures],
        ]
        parameters = [parameter for part in self._parts for parameter in part]
        self.optimizer = torch.optim.Adam(parameters, lr=hyperparameters.learning_rate, fused=True)

    def update(
        self,
        batch: ReplayBatch,
        rewards: Tensor,
        goes_on: Tensor,
        generator: torch.Generator,
        held: tuple[ReplayBatch, float] | None = None,
    ) -> dict[str, float]:
        """One step.

        Args:
            batch: B transitions.
            rewards: of each signal times its strength, shape (B, signals).
            goes_on: 0.0 where a signal expects nothing afterwards, shape (B, signals).
            generator: draws what the policy would do.
            held: recorded decisions that the policy is held at, and by which weight against the critics' values,
                were those of mean size 1; none: it is not.

        Returns:
            TensorBoard tags to values.
        """
        temperatures = self.log_temperatures.detach().exp()
        next_values = self._next_values(batch.next_observations, temperatures, generator)
        observation = self._observation(batch.observations)
        values = _values(self.critics, observation, batch.continuous)
        critic = critic_losses(
            action_values(values, batch.branches), critic_targets(rewards, goes_on, next_values, self._gammas)
        )
        distribution: ActionDistribution = self.policy(batch.observations)
        drawn, entropy = _drawn(distribution, generator)
        if drawn.shape[1]:
            values = _values(self.critics, observation, drawn)
        else:
            values = values.detach()  # of all choices: the same for any action
        expected = expected_values(values, distribution.choice_logs)
        policy = policy_loss(expected, entropy, temperatures)
        if held is not None:
            policy = policy + held[1] * expected.detach().abs().mean() * self._apart(held[0])
        temperature = temperature_loss(self.log_temperatures, entropy, self._entropy_targets)
        self._step((critic.sum(), policy, temperature))
        hyperparameters = torch.cat((critic, policy.abs()[None], next_values.mean(dim=0))).tolist()
        return dict(zip((*_LOSS_TAGS, *self._value_tags), hyperparameters, strict=True))

    def _apart(self, recorded: ReplayBatch) -> Tensor:
        """How far the policy is from recorded actions."""
        distribution: ActionDistribution = self.policy(recorded.observations)
        return cloning_loss(distribution.mean.tanh(), distribution.choice_logs, recorded.continuous, recorded.branches)

    @torch.no_grad()
    def _next_values(self, observations: Tensor, temperatures: Tensor, generator: torch.Generator) -> Tensor:
        """What the policy expects from here on, shape (B, signals); entropy counts as reward of the first signal."""
        distribution: ActionDistribution = self.policy(observations)
        drawn, entropy = _drawn(distribution, generator)
        values = expected_values(
            _values(self.targets, self._observation(observations), drawn), distribution.choice_logs
        )
        values[:, 0] += entropy @ temperatures
        return values

    def _observation(self, observations: Tensor) -> Tensor:
        """Observations as critics see them: normalised as the policy normalises them."""
        normalizer = self.policy.body.normalizer
        return observations if normalizer is None else normalizer(observations)

    def _step(self, losses: Sequence[Tensor]) -> None:
        """Each part goes down its own loss; the targets follow the critics."""
        for loss, parameters in zip(losses, self._parts, strict=True):
            gradients = torch.autograd.grad(loss, parameters)
            for parameter, gradient in zip(parameters, gradients, strict=True):
                parameter.grad = gradient
            if self._max_grad_norm is not None:
                torch.nn.utils.clip_grad_norm_(parameters, self._max_grad_norm)
        self.optimizer.step()
        for target, parameter in zip(self.targets.parameters(), self._parts[0], strict=True):
            target.lerp_(parameter.detach(), self._tau)

    def set_learning_rate(self, learning_rate: float) -> None:
        """Of the next steps."""
        for group in self.optimizer.param_groups:
            group["lr"] = learning_rate

    def temperatures(self) -> dict[str, float]:
        """By TensorBoard tag; of several branches the mean."""
        continuous, branches = torch.split(self.log_temperatures.detach().exp(), self._split)
        tags = {"Policy/Continuous Entropy Coeff": continuous, "Policy/Discrete Entropy Coeff": branches}
        return {tag: float(values.mean()) for tag, values in tags.items() if len(values)}

    def state(self) -> dict[str, Any]:
        """Networks, temperatures and optimiser."""
        return {
            "policy": self.policy.state_dict(),
            "critics": self.critics.state_dict(),
            "targets": self.targets.state_dict(),
            "log_temperatures": self.log_temperatures.detach(),
            "optimizer": self.optimizer.state_dict(),
        }

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on from what `state` returned."""
        self.policy.load_state_dict(state["policy"])
        self.critics.load_state_dict(state["critics"])
        self.targets.load_state_dict(state["targets"])
        self.log_temperatures.data.copy_(state["log_temperatures"])
        self.optimizer.load_state_dict(state["optimizer"])


def _drawn(distribution: ActionDistribution, generator: torch.Generator) -> tuple[Tensor, Tensor]:
    """Continuous actions that the policy draws, and the entropy of each part, shape (B, parts)."""
    actions = distribution.draw(generator)
    dimensions = actions.continuous.shape[1]
    log_probs = distribution.squashed_log_probs(actions)[:, :dimensions]
    return actions.continuous.tanh(), entropies(log_probs, distribution.choice_logs)


def _values(critics: nn.ModuleList, observation: Tensor, continuous: Tensor) -> Tensor:
    """What all critics say, shape (critics, B, signals, 1 + branches x choices)."""
    inputs = torch.cat((observation, continuous), dim=1)
    return torch.stack([critic(inputs) for critic in critics])
