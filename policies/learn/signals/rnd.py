"""RND (Burda et al. 2018, arXiv 1810.12894): reward for observations that were seen rarely.

In: transitions. Out: how badly a trained network foretells what a fixed random one makes of an observation. Two forms:
the paper's (`normalize_reward`), which looks at where a decision led, normalises observations, and divides rewards by
the running deviation of their discounted sums; and ML-Agents', which looks at where it was taken and does neither.
"""

from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor, nn

from policies.learn.config.signals import RndSettings
from policies.learn.networks.normalizer import Normalizer
from policies.learn.signals.network_parts import build_body, restore, snapshot
from policies.learn.signals.signal import Transitions
from policies.learn.signals.signal_losses import squared_error
from policies.tasks.layout import Layout


class _Pair(nn.Module):
    """The fixed network and the one that learns to foretell it, and the running statistics of both forms."""

    def __init__(self, layout: Layout, settings: RndSettings, generator: torch.Generator) -> None:
        super().__init__()
        size = layout.observation_size
        is_normalized = settings.normalize_reward or settings.network_settings.normalize
        self.normalizer = Normalizer(size) if is_normalized else None
        self.sums = Normalizer(1) if settings.normalize_reward else None
        self.target = build_body(size, settings.network_settings, generator).requires_grad_(requires_grad=False)
        self.predictor = build_body(size, settings.network_settings, generator)

    def errors(self, observations: Tensor) -> Tensor:
        """(...) of observations (..., observation)."""
        if self.normalizer is not None:
            observations = self.normalizer(observations)
        return squared_error(self.predictor(observations), self.target(observations))


class RndSignal:
    """The signal."""

    name = "rnd"
    is_episodic = False

    def __init__(self, layout: Layout, settings: RndSettings, seed: int, device: torch.device | str = "cpu") -> None:
        """Networks that know nothing yet, on a device; `seed` draws their weights."""
        self.gamma = settings.gamma
        self.strength = settings.strength
        self.settings = settings
        self.network = _Pair(layout, settings, torch.Generator().manual_seed(seed)).to(device)
        self.optimizer = torch.optim.Adam(self.network.predictor.parameters(), lr=settings.learning_rate)
        self._running = torch.zeros(0, device=device)  # discounted sum of each environment's rewards so far

    def _observation(self, transitions: Transitions) -> Tensor:
        return transitions.next_observations if self.settings.normalize_reward else transitions.observations

    @torch.no_grad()
    def rewards(self, transitions: Transitions) -> Tensor:
        """Rewards. What is seen here also moves the statistics that observations and rewards are normalised by."""
        network, observation = self.network, self._observation(transitions)
        if network.normalizer is not None:
            network.normalizer.update(observation)
        errors = network.errors(observation)
        if network.sums is None:
            return errors
        # Rows drawn from a replay memory have no order to sum them in: there it is the rewards' own deviation.
        sums = self._discounted_sums(errors) if errors.dim() == 2 else errors
        network.sums.update(sums[..., None])
        return errors / network.sums.deviation

    def _discounted_sums(self, rewards: Tensor) -> Tensor:
        """At each decision, of all rewards so far, the newest counting most; ends are ignored, as the signal does."""
        if self._running.shape != rewards.shape[1:]:
            self._running = torch.zeros_like(rewards[0])
        sums = torch.empty_like(rewards)
        for t, row in enumerate(rewards):
            self._running = self._running * self.gamma + row
            sums[t] = self._running
        return sums

    def update(self, batch: Transitions) -> dict[str, float]:
        loss = self.network.errors(self._observation(batch)).mean()
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        self.optimizer.step()
        return {"Losses/RND Loss": loss.item()}

    def state(self) -> dict[str, Any]:
        return snapshot(self.network, self.optimizer) | {"running": self._running.clone()}

    def load_state(self, state: Mapping[str, Any]) -> None:
        restore(state, self.network, self.optimizer)
        self._running = state["running"].clone().to(self._running.device)
