"""A policy's continuous actions in [-1, 1], as offline algorithms see them: a Gaussian around a bounded mean.

Its deviation is the same everywhere while a dataset is learnt from, as IQL's authors have it: of a squashed policy,
whose deviation may depend on the observation, only the bias learns. SAC frees the rest later.
"""

import math
from collections.abc import Iterator

import torch
from torch import Tensor, nn

from policies.learn.averaging import own_noise
from policies.learn.networks.action_distributions import CLIP, ActionDistribution
from policies.learn.networks.policy import Policy
from policies.offline.losses import LOG_DEVIATION_LIMITS, choice_log_probs, gaussian_log_probs


class ActionModel:
    """The actions of a policy without memory that sees no image."""

    def __init__(self, policy: Policy, deviation: float) -> None:
        """Sets the policy's deviation.

        Args:
            policy: an untrained one.
            deviation: of continuous actions, which are in -1 to 1.
        """
        self.policy = policy
        self._scale = 1.0 if policy.is_squashed else CLIP
        sigma = policy.heads.log_sigma
        log_deviation = math.log(deviation * self._scale)
        with torch.no_grad():
            if isinstance(sigma, nn.Linear):
                sigma.weight.zero_()
                sigma.bias.fill_(log_deviation)
            elif sigma is not None:
                sigma.fill_(log_deviation)

    def parameters(self) -> Iterator[nn.Parameter]:
        """What learns."""
        sigma = self.policy.heads.log_sigma
        held = sigma.weight if isinstance(sigma, nn.Linear) else None
        return (parameter for parameter in self.policy.parameters() if parameter is not held)

    def __call__(self, inputs: Tensor) -> ActionDistribution:
        """Of normalised observations (B, elements)."""
        distribution: ActionDistribution = self.policy.heads(self.policy.body.hidden(inputs))
        return distribution

    def mean(self, distribution: ActionDistribution) -> Tensor:
        """Of continuous actions; that of a clipped policy may lie outside of [-1, 1], so that it has a slope there."""
        return distribution.mean.tanh() if self.policy.is_squashed else distribution.mean / CLIP

    def log_deviation(self, distribution: ActionDistribution) -> Tensor:
        """Of continuous actions."""
        return (distribution.log_sigma - math.log(self._scale)).clamp(*LOG_DEVIATION_LIMITS)

    def draw(self, distribution: ActionDistribution, generator: torch.Generator) -> Tensor:
        """Continuous actions in [-1, 1]."""
        mean = self.mean(distribution)
        return (mean + own_noise(mean, generator) * self.log_deviation(distribution).exp()).clamp(-1.0, 1.0)

    def log_probs(self, distribution: ActionDistribution, continuous: Tensor, branches: Tensor) -> Tensor:
        """Of whole actions, shape (B,)."""
        log_probs = choice_log_probs(distribution.choice_logs, branches)
        if continuous.shape[-1]:
            mean, log_deviation = self.mean(distribution), self.log_deviation(distribution)
            log_probs = log_probs + gaussian_log_probs(mean, log_deviation, continuous)
        return log_probs
