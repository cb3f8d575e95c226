"""Distributions of actions: a diagonal Gaussian for continuous ones, a categorical one for each discrete branch.

Features in, a distribution out. All branches come from one tensor and are drawn in one call. A head is one continuous
dimension or one branch: log-probabilities have a column for each, continuous ones first.
"""

import math
from dataclasses import dataclass

import torch
import torch.nn.functional as F  # noqa: N812  (the name of the field)
from torch import Tensor, nn

from policies.learn.networks.dense_layers import dense

CLIP = 3.0  # ML-Agents' PPO clips draws to ±3 and divides them by 3
_MASKED = -1e8  # ML-Agents' logit of a choice that does not exist
_LOG_SQRT_2PI = 0.5 * math.log(2.0 * math.pi)
_ENTROPY_OF_1 = 0.5 * math.log(2.0 * math.pi * math.e)
LOG_SIGMA_LIMITS = (-20.0, 2.0)  # ML-Agents' SAC


@dataclass(frozen=True, slots=True)
class Actions:
    """One decision per row."""

    continuous: Tensor  # (..., continuous) as drawn: `bounded` brings them to what the task takes
    branches: Tensor  # (..., branches) int64


def bounded(continuous: Tensor) -> Tensor:
    """What the task takes, [-1, 1], of PPO's draws."""
    return continuous.clamp(-CLIP, CLIP) / CLIP


@dataclass(frozen=True, slots=True)
class ActionDistribution:
    """What a policy may do, one distribution per row."""

    mean: Tensor  # (..., continuous)
    log_sigma: Tensor  # (..., continuous), or (continuous,) for all rows
    choice_logs: Tensor  # (..., branches, choices), log-probabilities

    def draw(self, generator: torch.Generator) -> Actions:
        """A draw of each row; continuous ones are differentiable."""
        noise = torch.randn(self.mean.shape, generator=generator, device=self.mean.device)
        race = torch.empty_like(self.choice_logs).exponential_(generator=generator)
        return Actions(self.mean + noise * self.log_sigma.exp(), _greatest(self.choice_logs - race.log()))

    def mode(self) -> Actions:
        """The most probable actions."""
        return Actions(self.mean, _greatest(self.choice_logs))

    def log_probs(self, actions: Actions) -> Tensor:
        """Of each head, shape (..., heads)."""
        off = (actions.continuous - self.mean) * (-self.log_sigma).exp()
        gaussian = -0.5 * off.square() - self.log_sigma - _LOG_SQRT_2PI
        chosen = self.choice_logs.gather(-1, actions.branches[..., None])[..., 0]
        return torch.cat((gaussian, chosen), dim=-1)

    def entropy(self) -> Tensor:
        """Shape (...): the mean of the continuous dimensions plus the sum of the branches, as ML-Agents adds them."""
        entropy = -(self.choice_logs.exp() * self.choice_logs).sum((-2, -1))
        if self.mean.shape[-1]:
            entropy = entropy + (self.log_sigma + _ENTROPY_OF_1).mean(-1)
        return entropy

    def squashed_log_probs(self, actions: Actions) -> Tensor:
        """Of each head, where the task gets the tangent hyperbolic of the continuous draws, shape (..., heads)."""
        drawn = actions.continuous
        shrink = 2.0 * (math.log(2.0) - drawn - F.softplus(-2.0 * drawn))  # log(1 - tanh(u)^2) without cancellation
        log_probs = self.log_probs(actions)
        count = drawn.shape[-1]
        return torch.cat((log_probs[..., :count] - shrink, log_probs[..., count:]), dim=-1)


class ActionHeads(nn.Module):
    """Last layers of a policy."""

    def __init__(
        self,
        features: int,
        continuous_size: int,
        branch_sizes: tuple[int, ...],
        generator: torch.Generator,
        *,
        is_sigma_learned_by_state: bool = False,
        components: int = 1,
    ) -> None:
        """Untrained heads.

        Args:
            features: that they see.
            continuous_size: continuous actions.
            branch_sizes: choices of each branch.
            generator: draws the weights.
            is_sigma_learned_by_state: whether the deviation depends on the features.
            components: Gaussians of a mixture, whose likeliest acts in each row; their deviations depend on features.
        """
        super().__init__()
        self.branch_sizes = branch_sizes
        self.component_count = components if continuous_size else 1
        outputs = continuous_size * self.component_count
        self.mean = dense(features, outputs, generator, gain=0.2) if continuous_size else None
        self.log_sigma: nn.Parameter | nn.Linear | None = None
        if continuous_size:
            by_state = is_sigma_learned_by_state or self.component_count > 1
            sigma = dense(features, outputs, generator, gain=0.2) if by_state else None
            self.log_sigma = sigma or nn.Parameter(torch.zeros(continuous_size))
        is_mixture = self.component_count > 1
        self.mixture = dense(features, self.component_count, generator, gain=0.1) if is_mixture else None
        if is_mixture and self.mean is not None:  # components that began alike would stay alike
            nn.init.normal_(self.mean.bias, std=0.5, generator=generator)
        self.logits = dense(features, sum(branch_sizes), generator, gain=0.1) if branch_sizes else None

    def forward(self, features: Tensor) -> ActionDistribution:
        empty = features[..., :0]
        if self.mixture is not None:
            logs, means, log_sigmas = self.components(features)
            best = logs.argmax(-1)[..., None, None].expand(*means.shape[:-2], 1, means.shape[-1])
            mean, log_sigma = means.gather(-2, best)[..., 0, :], log_sigmas.gather(-2, best)[..., 0, :]
            return ActionDistribution(mean, log_sigma, self._choice_logs(features))
        mean = self.mean(features) if self.mean is not None else empty
        if isinstance(self.log_sigma, nn.Linear):
            log_sigma = self.log_sigma(features).clamp(*LOG_SIGMA_LIMITS)
        else:
            log_sigma = empty if self.log_sigma is None else self.log_sigma
        return ActionDistribution(mean, log_sigma, self._choice_logs(features))

    def components(self, features: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """The mixture: log-probabilities (..., components), means and log-deviations (..., components, continuous)."""
        if self.mixture is None or self.mean is None or not isinstance(self.log_sigma, nn.Linear):
            raise ValueError("these heads have no mixture")
        shape = (*features.shape[:-1], self.component_count, -1)
        log_sigmas = self.log_sigma(features).clamp(*LOG_SIGMA_LIMITS)
        return self.mixture(features).log_softmax(-1), self.mean(features).view(shape), log_sigmas.view(shape)

    @torch.no_grad()
    def sharpen(self, factor: float) -> None:
        """Scales the logits of the discrete choices: draws come nearer to the most probable ones, which stay."""
        if self.logits is not None:
            self.logits.weight.mul_(factor)
            self.logits.bias.mul_(factor)

    def _choice_logs(self, features: Tensor) -> Tensor:
        """Log-probabilities, shape (..., branches, choices of the largest branch)."""
        if self.logits is None:
            return features[..., :0, None]
        logits: Tensor = self.logits(features)
        sizes = self.branch_sizes
        most = max(sizes)
        if min(sizes) == most:
            logits = logits.view(*logits.shape[:-1], len(sizes), most)
        else:
            parts = torch.split(logits, list(sizes), dim=-1)
            logits = torch.stack([F.pad(part, (0, most - part.shape[-1]), value=_MASKED) for part in parts], dim=-2)
        return logits.log_softmax(-1)


def _greatest(scores: Tensor) -> Tensor:
    return scores.argmax(-1) if scores.shape[-2] else scores[..., 0].long()
