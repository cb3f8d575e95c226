"""TD3+BC (Fujimoto and Gu 2021, arXiv 2106.06860): TD3 whose policy stays near what was recorded."""

import copy
from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from policies.learn.averaging import averaged, own_noise
from policies.learn.config.offline import Td3BcHyperparameters
from policies.learn.networks.policy import Policy
from policies.offline.action_model import ActionModel
from policies.offline.algorithm import NormalizedBatches, OfflineError, require_plain, side_by_side
from policies.offline.critics import TwinCritics
from policies.offline.flat_parameters import FlatOptimizer, flatten
from policies.offline.losses import td3_bc_policy_loss, td_loss, td_targets

_DEVIATION = 0.1  # of the trained policy where it is drawn from: TD3's noise of exploration


class Td3Bc:
    """See `policies/offline/algorithm.py`."""

    tags: tuple[str, ...] = ("Losses/Critic Loss", "Losses/Policy Loss", "Policy/Extrinsic Value")

    def __init__(
        self,
        policy: Policy,
        batches: NormalizedBatches,
        hyperparameters: Td3BcHyperparameters,
        gamma: float,
        generators: tuple[torch.Generator, torch.Generator],
    ) -> None:
        """Untrained critics for a policy.

        Args:
            policy: untrained, of continuous actions; trained in place.
            batches: what it learns from.
            hyperparameters: of TD3+BC.
            gamma: discount of the rewards.
            generators: of the critics' weights, on the CPU, and of the noise on actions.

        Raises:
            OfflineError: a policy with memory or images, or discrete actions.
        """
        require_plain(policy, "td3_bc")
        if policy.layout.branches:
            raise OfflineError(
                f"trainer_type: td3_bc has continuous actions only, and {policy.layout.task} as it is set has choices; "
                "iql, awac and bc have both"
            )
        self._batches, self._settings, self._gamma = batches, hyperparameters, gamma
        self._generator = generators[1]
        self._actions = ActionModel(policy, _DEVIATION)
        self._critics = TwinCritics(policy, hyperparameters.tau, generators[0])
        self._target_policy = copy.deepcopy(policy).requires_grad_(False)
        self._target_actions = ActionModel(self._target_policy, _DEVIATION)
        self._target_vector = flatten(self._target_actions.parameters())
        rate, norm = hyperparameters.learning_rate, hyperparameters.max_grad_norm
        self._critic_optimizer = FlatOptimizer(self._critics.networks.parameters(), rate, norm)
        self._policy_optimizer = FlatOptimizer(self._actions.parameters(), rate, norm)
        self._step_count = 0
        self._policy_loss = torch.zeros((), device=self._target_vector.device)

    def step(self, rows: Tensor) -> Tensor:
        """One step of the critics; every `policy_interval` steps also of the policy, and the targets follow."""
        batch, actions = self._batches.take(rows), self._actions
        self._step_count += 1
        values = self._critics.values(side_by_side(batch.observations, batch.continuous), batch.branches)
        critic_loss = td_loss(values, self._targets(batch.rewards, batch.is_terminated, batch.next_observations))
        self._critic_optimizer.step(critic_loss)
        if self._step_count % self._settings.policy_interval == 0:
            mean = actions.mean(actions(batch.observations))
            seen = side_by_side(batch.observations, mean.clamp(-1.0, 1.0))
            first = self._critics.networks(seen, count=1)[0, :, 0]
            size = averaged(first.detach().abs().mean())
            loss = td3_bc_policy_loss(first, mean, batch.continuous, self._settings.alpha, size)
            self._policy_optimizer.step(loss)
            self._critics.follow(self._critic_optimizer)
            self._target_vector.lerp_(self._policy_optimizer.vector.detach(), self._settings.tau)
            self._policy_loss = averaged(loss)
        return torch.stack((critic_loss.detach(), self._policy_loss, values.detach().mean()))

    @torch.no_grad()
    def _targets(self, rewards: Tensor, is_terminated: Tensor, next_observations: Tensor) -> Tensor:
        """Of the critics: the target policy's next action, somewhat blurred, by the lesser target critic."""
        mean = self._target_actions.mean(self._target_actions(next_observations))
        noise = own_noise(mean, self._generator)
        limit = self._settings.target_noise_limit
        noise = noise.mul_(self._settings.target_noise).clamp_(-limit, limit)
        seen = side_by_side(next_observations, (mean + noise).clamp_(-1.0, 1.0))
        next_values = self._critics.targets(seen)[..., 0].amin(dim=0)
        return td_targets(rewards, is_terminated, next_values, self._gamma)

    def set_learning_rate(self, learning_rate: float) -> None:
        """Of the next steps."""
        self._critic_optimizer.set_learning_rate(learning_rate)
        self._policy_optimizer.set_learning_rate(learning_rate)

    def state(self) -> dict[str, Any]:
        """Critics, targets, both Adams and the generator of noise."""
        return {
            **self._critics.state(),
            "target_policy": self._target_policy.state_dict(),
            "critic_optimizer": self._critic_optimizer.state(),
            "policy_optimizer": self._policy_optimizer.state(),
            "step_count": self._step_count,
            "policy_loss": self._policy_loss,
            "generator": self._generator.get_state(),
        }

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on from what `state` returned."""
        self._batches.refresh()
        self._critics.load_state(state)
        self._target_policy.load_state_dict(state["target_policy"])
        self._critic_optimizer.load_state(state["critic_optimizer"])
        self._policy_optimizer.load_state(state["policy_optimizer"])
        self._step_count = state["step_count"]
        self._generator.set_state(state["generator"].cpu())
        self._policy_loss = state["policy_loss"].to(self._target_vector.device)

    def take_critics(self, state: Mapping[str, Any]) -> None:
        """Starts from another run's critics if they fit, and with the policy as its own target."""
        self._batches.refresh()
        if self._critics.takes(state):
            self._critics.load_state(state)
        self._target_policy.load_state_dict(self._actions.policy.state_dict())
