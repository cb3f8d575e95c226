"""IQL and TD3+BC as one writes them first: a module per network, an Adam per module, arrays indexed batch by batch.

The baseline of `python -m bench offline`: the same networks, losses and numbers as ours, in the order of d3rlpy.
"""

import copy
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from policies.offline.store import OfflineStore

GAMMA, TAU, RATE = 0.99, 0.005, 3e-4


def _net(sizes: list[int]) -> nn.Sequential:
    layers: list[nn.Module] = []
    for a, b in pairwise(sizes[:-1]):
        layers += [nn.Linear(a, b), nn.SiLU()]
    return nn.Sequential(*layers, nn.Linear(sizes[-2], sizes[-1]))


class NaiveBatches:
    """Decisions as NumPy arrays; observations are normalised beforehand."""

    def __init__(self, store: OfflineStore, batch_size: int, seed: int) -> None:
        batch = store.take(store.decisions)
        statistics = store.statistics()
        deviation = statistics.variance.sqrt().clamp(min=1e-6)
        columns = [((x.double() - statistics.mean) / deviation).float().clamp(-5, 5) for x in
                   (batch.observations, batch.next_observations)]  # fmt: skip
        self._arrays = [x.numpy() for x in (*columns, batch.continuous, batch.rewards, batch.is_terminated)]
        self._batch_size, self._rng = batch_size, np.random.default_rng(seed)

    def __call__(self) -> list[Tensor]:
        """Observations, next ones, actions, rewards and ends."""
        rows = self._rng.integers(len(self._arrays[0]), size=self._batch_size)
        return [torch.tensor(array[rows]) for array in self._arrays]


class NaiveIql:
    """Implicit Q-learning."""

    def __init__(self, sizes: tuple[int, int], hidden: int, batches: NaiveBatches) -> None:
        n, c = sizes
        self.policy = _net([n, hidden, hidden, c])
        self.log_std = nn.Parameter(torch.zeros(c))
        self.critics = nn.ModuleList(_net([n + c, hidden, hidden, 1]) for _ in range(2))
        self.targets = copy.deepcopy(self.critics)
        self.value = _net([n, hidden, hidden, 1])
        self._batches = batches
        self._actor_adam = torch.optim.Adam([*self.policy.parameters(), self.log_std], lr=RATE)
        self._critic_adam = torch.optim.Adam([*self.critics.parameters(), *self.value.parameters()], lr=RATE)

    def step(self) -> dict[str, float]:
        """One update of everything."""
        seen, after, actions, rewards, ends = self._batches()
        both = torch.cat((seen, actions), dim=1)
        with torch.no_grad():
            target = rewards + GAMMA * (1.0 - ends) * self.value(after)[:, 0]
            best = torch.stack([each(both)[:, 0] for each in self.targets]).min(dim=0).values
        critic_loss = sum(functional.mse_loss(each(both)[:, 0], target) for each in self.critics)
        apart = best - self.value(seen)[:, 0]
        value_loss = (torch.where(apart > 0, 0.7, 0.3) * apart**2).mean()
        self._critic_adam.zero_grad()
        (critic_loss + value_loss).backward()
        self._critic_adam.step()
        with torch.no_grad():
            best = torch.stack([each(both)[:, 0] for each in self.targets]).min(dim=0).values
            weights = (3.0 * (best - self.value(seen)[:, 0])).exp().clamp(max=100.0)
        normal = torch.distributions.Normal(self.policy(seen).tanh(), self.log_std.clamp(-5, 2).exp())
        policy_loss = -(weights * normal.log_prob(actions).sum(dim=1)).mean()
        self._actor_adam.zero_grad()
        policy_loss.backward()
        self._actor_adam.step()
        _follow(self.targets, self.critics)
        return {"critic": critic_loss.item(), "value": value_loss.item(), "policy": policy_loss.item()}


class NaiveTd3Bc:
    """TD3+BC."""

    def __init__(self, sizes: tuple[int, int], hidden: int, batches: NaiveBatches) -> None:
        n, c = sizes
        self.policy = _net([n, hidden, hidden, c])
        self.critics = nn.ModuleList(_net([n + c, hidden, hidden, 1]) for _ in range(2))
        self.target_policy, self.targets = copy.deepcopy(self.policy), copy.deepcopy(self.critics)
        self._batches = batches
        self._actor_adam = torch.optim.Adam(self.policy.parameters(), lr=RATE)
        self._critic_adam = torch.optim.Adam(self.critics.parameters(), lr=RATE)
        self._count = 0

    def step(self) -> dict[str, float]:
        """One update of the critics, every second time also of the policy."""
        seen, after, actions, rewards, ends = self._batches()
        with torch.no_grad():
            mean = self.target_policy(after).tanh()
            noise = (0.2 * torch.randn_like(mean)).clamp(-0.5, 0.5)
            both = torch.cat((after, (mean + noise).clamp(-1, 1)), dim=1)
            least = torch.stack([each(both)[:, 0] for each in self.targets]).min(dim=0).values
            target = rewards + GAMMA * (1.0 - ends) * least
        both = torch.cat((seen, actions), dim=1)
        critic_loss = sum(functional.mse_loss(each(both)[:, 0], target) for each in self.critics)
        self._critic_adam.zero_grad()
        critic_loss.backward()
        self._critic_adam.step()
        losses = {"critic": critic_loss.item()}
        self._count += 1
        if self._count % 2 == 0:
            mean = self.policy(seen).tanh()
            values = self.critics[0](torch.cat((seen, mean), dim=1))[:, 0]
            scale = 2.5 / values.abs().mean().detach()
            policy_loss = functional.mse_loss(mean, actions) - scale * values.mean()
            self._actor_adam.zero_grad()
            policy_loss.backward()
            self._actor_adam.step()
            _follow(self.targets, self.critics)
            _follow(self.target_policy, self.policy)
            losses["policy"] = policy_loss.item()
        return losses


def _follow(target: nn.Module, source: nn.Module) -> None:
    with torch.no_grad():
        for there, here in zip(target.parameters(), source.parameters(), strict=True):
            there.mul_(1.0 - TAU).add_(TAU * here)


def weights_of(policy: Any) -> list[Tensor]:
    """Weights and biases, layer by layer."""
    return [parameter.detach().clone() for parameter in policy.parameters()]
