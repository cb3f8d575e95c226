"""Fitted Q evaluation: what a policy would return, learnt from decisions of others (Le, Voloshin and Yue 2019).

In: a store and a policy that has no memory. Out: its mean discounted return from where the recorded episodes began,
with an interval. Each of several networks learns from episodes of its own, drawn anew of the recorded ones (bootstrap);
how much they differ and how much the beginnings differ make the interval. Nothing is simulated. Where the policy does
what was never recorded, it is a guess, and `away` says how far off that is.
"""

import copy
from dataclasses import dataclass

import torch
from torch import Tensor

from policies.learn.networks.policy import Policy
from policies.offline.flat_parameters import FlatOptimizer, flatten
from policies.offline.stacked_networks import StackedNetworks
from policies.offline.store import OfflineStore

MEMBERS = 5
_TAU, _RATE, _BATCH, _ROWS = 0.01, 1.0e-3, 512, 8192
_T = 2.776  # Student's, 95 % of MEMBERS - 1 degrees of freedom


@dataclass(frozen=True, slots=True)
class Estimate:
    """Of the mean discounted return of an episode."""

    mean: float
    low: float  # 95 %
    high: float
    away: float  # [1] root mean square of what the policy's actions differ from the recorded ones, in action ranges


class FittedQ:
    """Values of a policy, learnt from recorded decisions.

    Args:
        store: what was recorded, of continuous actions.
        policy: what is judged, without memory; its most probable actions count.
        gamma: discount of the rewards.
        seed: of all draws.
        hidden: units of each of two layers.
        width: of a Gaussian around those actions, clipped to the bounds, that is judged instead; 0: none.

    Raises:
        ValueError: a policy with memory, images or choices.
    """

    def __init__(
        self,
        store: OfflineStore,
        policy: Policy,
        gamma: float,
        *,
        seed: int = 0,
        hidden: int = 128,
        width: float = 0.0,
    ) -> None:
        if policy.memory_size or policy.layout.image is not None or policy.layout.branches:
            raise ValueError("fitted Q evaluation is for policies of continuous actions without memory or images")
        self._store, self._gamma, self._width = store, gamma, width
        self._generator = torch.Generator().manual_seed(seed)
        statistics = store.statistics()
        self._mean, self._scale = statistics.mean.float(), (statistics.variance.float() + 1e-6).rsqrt()
        size = store.layout.observation_size + len(store.layout.continuous)
        self._networks = StackedNetworks(MEMBERS, [size, hidden, hidden, 1], self._generator)
        self._targets = copy.deepcopy(self._networks).requires_grad_(False)
        self._target_vector = flatten(self._targets.parameters())
        self._optimizer = FlatOptimizer(self._networks.parameters(), _RATE)
        self.actions = _actions_of(policy, store)  # (rows, actions) the policy's own
        drawn = torch.randint(store.episode_count, (MEMBERS, store.episode_count), generator=self._generator)
        counts = torch.stack([torch.bincount(each, minlength=store.episode_count) for each in drawn]).float()
        self._counts = torch.repeat_interleave(counts, store.lengths, dim=1)  # (members, decisions)
        self._unit = max(_return_size(store, gamma), statistics.reward_deviation, 1e-6)  # values are learnt as about 1
        rewards = store.rewards[store.decisions]
        self._bounds = float(rewards.min()) / (1.0 - gamma), float(rewards.max()) / (1.0 - gamma)

    def fit(self, steps: int) -> None:
        """So many gradient steps."""
        low, high = self._bounds[0] / self._unit - 1.0, self._bounds[1] / self._unit + 1.0  # room: else noise is bias
        for _ in range(steps):
            drawn = torch.randint(len(self._store), (_BATCH,), generator=self._generator)
            rows = self._store.decisions[drawn]
            batch = self._store.take(rows)
            with torch.no_grad():
                next_values = self._targets(
                    self._inputs(batch.next_observations, self.drawn(rows + 1, self._generator))
                )[..., 0]
                goes_on = 1.0 - batch.is_terminated
                wanted = batch.rewards / self._unit + self._gamma * goes_on * next_values.clamp(low, high)
            values = self._networks(self._inputs(batch.observations, batch.continuous))[..., 0]
            self._optimizer.step((self._counts[:, drawn] * (values - wanted).square()).mean(dim=1).sum())
            self._target_vector.lerp_(self._optimizer.vector.detach(), _TAU)

    @torch.no_grad()
    def estimate(self) -> Estimate:
        """From the first decisions of all episodes."""
        first = self._store.starts
        inputs = self._inputs(self._store.observations[first], self.actions[first])
        values = self._unit * self._targets(inputs)[..., 0]  # (members, episodes)
        mean = float(values.mean())
        beginnings = float(values.mean(dim=0).var()) / len(first) if len(first) > 1 else 0.0
        half = _T * (float(values.mean(dim=1).var()) + beginnings) ** 0.5
        decisions = self._store.decisions
        apart = self.actions[decisions] - self._store.continuous[decisions]
        return Estimate(mean, mean - half, mean + half, float(apart.square().mean().sqrt()))

    def drawn(self, rows: Tensor, generator: torch.Generator) -> Tensor:
        """Actions of what is judged at the observations of some rows (B,), shape (B, actions)."""
        actions = self.actions[rows]
        if self._width == 0.0:
            return actions
        return (actions + self._width * torch.randn(actions.shape, generator=generator)).clamp(-1.0, 1.0)

    @torch.no_grad()
    def values(self, rows: Tensor, actions: Tensor) -> Tensor:
        """What each network says actions (B, actions) are worth at the observations of some rows (B,), (members, B)."""
        parts = zip(torch.split(rows, _ROWS), torch.split(actions, _ROWS), strict=True)
        found = [self._targets(self._inputs(self._store.observations[a], b))[..., 0] for a, b in parts]
        return self._unit * torch.cat(found, dim=1)

    def _inputs(self, observations: Tensor, actions: Tensor) -> Tensor:
        return torch.cat([((observations - self._mean) * self._scale).clamp(-10.0, 10.0), actions], dim=-1)


def _return_size(store: OfflineStore, gamma: float) -> float:
    """The root mean square of the discounted returns of the recorded episodes."""
    episodes = torch.repeat_interleave(torch.arange(store.episode_count), store.lengths)
    passed = (store.decisions - store.starts[episodes]).double()
    paid = store.rewards[store.decisions].double() * gamma**passed
    returns = torch.zeros(store.episode_count, dtype=torch.float64).index_add_(0, episodes, paid)
    return float(returns.square().mean().sqrt())


@torch.no_grad()
def _actions_of(policy: Policy, store: OfflineStore) -> Tensor:
    """The policy's most probable action in every row of a store, shape (rows, actions)."""
    chosen = []
    for part in torch.split(store.observations, _ROWS):
        actions, _ = policy.act(part.contiguous(), policy.start_memory(len(part)))
        chosen.append(policy.bounded(actions))
    return torch.cat(chosen)
