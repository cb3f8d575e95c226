"""Curiosity (ICM, Pathak et al. 2017), ML-Agents' way: reward for transitions that a forward model foresees badly.

In: transitions. Out: rewards. Observations become features; an inverse model guesses the action from two of them, so
that features keep what the agent controls; a forward model guesses the next features from the action.
"""

from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor, nn

from policies.learn.config.signals import CuriositySettings
from policies.learn.networks.dense_layers import dense
from policies.learn.networks.normalizer import Normalizer
from policies.learn.signals.network_parts import build_body, flat_actions, restore, snapshot
from policies.learn.signals.signal import Transitions
from policies.learn.signals.signal_losses import half_squared_error, inverse_loss
from policies.tasks.layout import Layout

HEAD_UNITS = 256  # all numbers here are ML-Agents'
FORWARD_FRACTION = 0.2
LOSS_WEIGHT = 10.0


class _Models(nn.Module):
    def __init__(self, layout: Layout, settings: CuriositySettings, generator: torch.Generator) -> None:
        super().__init__()
        width = settings.network_settings.hidden_units
        self.continuous_size = len(layout.continuous)
        self.branch_sizes = layout.branch_sizes
        action_size = self.continuous_size + sum(self.branch_sizes)
        self.normalizer = Normalizer(layout.observation_size) if settings.network_settings.normalize else None
        self.body = build_body(layout.observation_size, settings.network_settings, generator)
        self.inverse = nn.Sequential(
            dense(2 * width, HEAD_UNITS, generator), nn.SiLU(), dense(HEAD_UNITS, action_size, generator)
        )
        self.forward_model = nn.Sequential(
            dense(width + action_size, HEAD_UNITS, generator), nn.SiLU(), dense(HEAD_UNITS, width, generator)
        )

    def features(self, observations: Tensor) -> Tensor:
        if self.normalizer is not None:
            observations = self.normalizer(observations)
        features: Tensor = self.body(observations)
        return features

    def forward_errors(self, before: Tensor, after: Tensor, transitions: Transitions) -> Tensor:
        """Half the squared distance of the foreseen features to those that came, (...)."""
        action = flat_actions(transitions, self.branch_sizes)
        return half_squared_error(self.forward_model(torch.cat([before, action], dim=-1)), after)

    def inverse_loss(self, before: Tensor, after: Tensor, transitions: Transitions) -> Tensor:
        guessed = self.inverse(torch.cat([before, after], dim=-1))
        continuous, logits = guessed[..., : self.continuous_size], guessed[..., self.continuous_size :]
        return inverse_loss(continuous, logits, transitions.continuous, transitions.branches, self.branch_sizes)


class CuriositySignal:
    """The signal. It pays nothing before its first update, and at most 1 after strength."""

    name = "curiosity"
    is_episodic = False

    def __init__(
        self, layout: Layout, settings: CuriositySettings, seed: int, device: torch.device | str = "cpu"
    ) -> None:
        """Networks that know nothing yet, on a device; `seed` draws their weights."""
        self.gamma = settings.gamma
        self.strength = settings.strength
        self.network = _Models(layout, settings, torch.Generator().manual_seed(seed)).to(device)
        self.optimizer = torch.optim.Adam(self.network.parameters(), lr=settings.learning_rate)
        self._has_updated = False

    @torch.no_grad()
    def rewards(self, transitions: Transitions) -> Tensor:
        if not self._has_updated:
            return torch.zeros_like(transitions.rewards)
        network = self.network
        before, after = network.features(transitions.observations), network.features(transitions.next_observations)
        errors = network.forward_errors(before, after, transitions)
        return errors.clamp(max=1.0 / self.strength) if self.strength > 0.0 else errors

    def update(self, batch: Transitions) -> dict[str, float]:
        network = self.network
        if network.normalizer is not None:
            network.normalizer.update(batch.observations)
        before, after = network.features(batch.observations), network.features(batch.next_observations)
        forward_loss = network.forward_errors(before, after, batch).mean()
        guess_loss = network.inverse_loss(before, after, batch)
        loss = LOSS_WEIGHT * (FORWARD_FRACTION * forward_loss + (1.0 - FORWARD_FRACTION) * guess_loss)
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        self.optimizer.step()
        self._has_updated = True
        return {
            "Losses/Curiosity Forward Loss": forward_loss.item(),
            "Losses/Curiosity Inverse Loss": guess_loss.item(),
        }

    def state(self) -> dict[str, Any]:
        return snapshot(self.network, self.optimizer) | {"has_updated": self._has_updated}

    def load_state(self, state: Mapping[str, Any]) -> None:
        restore(state, self.network, self.optimizer)
        self._has_updated = state["has_updated"]
