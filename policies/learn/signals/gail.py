"""GAIL: reward for what a discriminator takes for the expert's doing (Ho and Ermon 2016), ML-Agents' way.

In: the policy's transitions and demonstrations. Out: rewards. The discriminator sees observations, and with
`use_actions` also the action and whether the episode ended; it learns once per minibatch of the policy, from as many
demonstrated rows. VAIL (Peng et al. 2018) squeezes what it sees through a noisy code of bounded information.
"""

from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor, nn

from policies.learn.config.signals import GailSettings
from policies.learn.networks.dense_layers import dense
from policies.learn.networks.normalizer import Normalizer
from policies.learn.signals.network_parts import build_body, flat_actions, restore, snapshot
from policies.learn.signals.signal import Transitions
from policies.learn.signals.signal_losses import code_divergence, discriminator_loss, gradient_penalty, imitation_reward
from policies.tasks.layout import Layout

GRADIENT_PENALTY_WEIGHT = 10.0  # this and the numbers of the code are ML-Agents'
CODE_SIZE = 128
CODE_INFORMATION = 0.5  # divergence the code is held to
BETA_RATE = 0.0005


class _Discriminator(nn.Module):
    beta: Tensor

    def __init__(self, input_size: int, settings: GailSettings, generator: torch.Generator) -> None:
        super().__init__()
        width = settings.network_settings.hidden_units
        self.body = build_body(input_size, settings.network_settings, generator)
        self.code = dense(width, CODE_SIZE, generator, gain=0.1) if settings.use_vail else None
        self.sigma = nn.Parameter(torch.ones(CODE_SIZE)) if settings.use_vail else None
        self.register_buffer("beta", torch.zeros(()))
        self.estimator = dense(CODE_SIZE if settings.use_vail else width, 1, generator, gain=0.2)

    def code_means(self, inputs: Tensor) -> Tensor:
        features: Tensor = self.body(inputs)
        return features if self.code is None else self.code(features)

    def logits(self, inputs: Tensor) -> Tensor:
        """(...) of inputs (..., I), without noise."""
        return self.estimates(self.code_means(inputs), None)

    def estimates(self, means: Tensor, generator: torch.Generator | None) -> Tensor:
        """Logits (...) of code means (..., C); with a generator the code is drawn round them."""
        if self.sigma is not None and generator is not None:
            noise = torch.randn(means.shape, generator=generator, device=means.device)
            means = means + noise * self.sigma
        logits: Tensor = self.estimator(means)
        return logits[..., 0]


class GailSignal:
    """The signal; its discriminator sees policy and expert through the same normalisation."""

    name = "gail"
    is_episodic = True

    def __init__(self, layout: Layout, settings: GailSettings, demonstrations: Transitions, seed: int) -> None:
        """A discriminator that knows nothing yet.

        Args:
            layout: of the policy and of the demonstrations.
            settings: the signal's block.
            demonstrations: (decisions,), on the device to learn on.
            seed: of weights, drawn rows, mixtures and noise.
        """
        device = demonstrations.observations.device
        self.gamma = settings.gamma
        self.strength = settings.strength
        self.settings = settings
        self.demonstrations = demonstrations
        self.generator = torch.Generator(device).manual_seed(seed)
        self._branch_sizes = layout.branch_sizes
        self._normalizer = Normalizer(layout.observation_size) if settings.network_settings.normalize else None
        if self._normalizer is not None:  # by the expert's statistics, as in ML-Agents, but all of them at once
            self._normalizer.to(device).update(demonstrations.observations)
        self._expert_inputs = self._inputs(demonstrations)
        weights = torch.Generator().manual_seed(seed)
        self.network = _Discriminator(self._expert_inputs.shape[-1], settings, weights).to(device)
        self.optimizer = torch.optim.Adam(self.network.parameters(), lr=settings.learning_rate)

    def _inputs(self, transitions: Transitions) -> Tensor:
        observation = transitions.observations
        if self._normalizer is not None:
            observation = self._normalizer(observation)
        if not self.settings.use_actions:
            return observation
        is_ended = transitions.is_ended[..., None].to(observation.dtype)
        return torch.cat([observation, flat_actions(transitions, self._branch_sizes), is_ended], dim=-1)

    @torch.no_grad()
    def rewards(self, transitions: Transitions) -> Tensor:
        return imitation_reward(self.network.logits(self._inputs(transitions)), self.settings.reward_form)

    def update(self, batch: Transitions) -> dict[str, float]:
        network, generator = self.network, self.generator
        policy = self._inputs(self._drawn(batch))
        count = len(policy)
        expert = self._expert_inputs[self._drawn_rows(len(self._expert_inputs), count)]
        fractions = torch.rand(policy.shape, generator=generator, device=policy.device)

        means = network.code_means(torch.cat([expert, policy]))
        logits = network.estimates(means, generator)
        loss = discriminator_loss(logits[:count], logits[count:])
        estimates = logits.detach().sigmoid()
        statistics = {
            "Losses/GAIL Loss": loss.item(),
            "Policy/GAIL Expert Estimate": estimates[:count].mean().item(),
            "Policy/GAIL Policy Estimate": estimates[count:].mean().item(),
        }
        penalty = GRADIENT_PENALTY_WEIGHT * gradient_penalty(
            lambda inputs: network.estimates(network.code_means(inputs), generator).sigmoid(), expert, policy, fractions
        )
        statistics["Policy/GAIL Grad Mag Loss"] = penalty.item()
        loss = loss + penalty
        if network.sigma is not None:
            divergence = code_divergence(means[:count], means[count:], network.sigma)
            excess = divergence - CODE_INFORMATION
            loss = loss + network.beta * excess  # with the beta before its update
            beta = (network.beta + BETA_RATE * excess.detach()).clamp(min=0.0)
            statistics |= {"Losses/GAIL KL Loss": divergence.item(), "Policy/GAIL Beta": beta.item()}
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        self.optimizer.step()
        if network.sigma is not None:
            network.beta = beta
        return statistics

    def _drawn(self, batch: Transitions) -> Transitions:
        """As many of a minibatch's rows as an update takes."""
        count, size = len(batch.rewards), self.settings.batch_size
        return batch if size is None or size >= count else batch[self._drawn_rows(count, size)]

    def _drawn_rows(self, total: int, count: int) -> Tensor:
        return torch.randint(total, (count,), generator=self.generator, device=self.generator.device)

    def state(self) -> dict[str, Any]:
        return snapshot(self.network, self.optimizer) | {"generator": self.generator.get_state()}

    def load_state(self, state: Mapping[str, Any]) -> None:
        restore(state, self.network, self.optimizer)
        self.generator.set_state(state["generator"])
