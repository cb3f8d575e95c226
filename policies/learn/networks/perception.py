"""What a policy says it believes of things it is never shown: named privileged elements, with how sure it is of each.

In: the features that actions are made of. Out: a mean and a deviation of each element, or a probability where its name
is a claim (`is_…`). Labels are free in simulation; in flight a tracker takes these beliefs as measurements.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from policies.learn.networks.dense_layers import dense
from policies.tasks.layout import Layout, LayoutError

_LOG_SIGMA_LIMITS = (-4.0, 2.0)  # of scaled elements: 2 % of a scale to 7 scales; guess
_BETA = 0.5  # Seitzer et al. 2022 (arXiv 2203.09168), who recommend it: badly known elements keep their weight


@dataclass(frozen=True, slots=True)
class Beliefs:
    """Of so many rows; elements in the order of `Perception.names`, scaled as the layout says."""

    means: Tensor  # (..., elements); of claims the probability that they hold
    sigmas: Tensor  # (..., elements); of claims nothing


class Perception(nn.Module):
    """A linear layer beside that of the actions."""

    def __init__(self, features: int, layout: Layout, names: Sequence[str], generator: torch.Generator) -> None:
        """Heads for some elements.

        Args:
            features: what they see.
            layout: whose privileged elements are meant.
            names: of the elements.
            generator: draws the weights.

        Raises:
            LayoutError: no such privileged element.
        """
        super().__init__()
        self.columns = require_privileged(layout, names)
        self.names = tuple(names)
        self._claims = [name.startswith("is_") for name in names]
        self.layer = dense(features, 2 * len(names), generator, gain=0.2)

    def forward(self, features: Tensor) -> Beliefs:
        """What is believed, shapes (..., elements)."""
        outputs, log_sigmas = self._outputs(features)
        is_claim = torch.tensor(self._claims, device=features.device)
        return Beliefs(torch.where(is_claim, outputs.sigmoid(), outputs), log_sigmas.exp())

    def loss(self, features: Tensor, privileged: Tensor) -> Tensor:
        """How unlikely the beliefs make what is true, mean over rows and elements.

        Args:
            features: shape (..., features).
            privileged: all privileged elements, shape (..., privileged).
        """
        outputs, log_sigmas = self._outputs(features)
        truth = privileged[..., self.columns]
        off = (truth - outputs) * (-log_sigmas).exp()
        gaussian = (0.5 * off.square() + log_sigmas) * log_sigmas.detach().exp() ** (2.0 * _BETA)
        crossed = functional.binary_cross_entropy_with_logits(outputs, truth.clamp(0.0, 1.0), reduction="none")
        is_claim = torch.tensor(self._claims, device=features.device)
        return torch.where(is_claim, crossed, gaussian).mean()

    def _outputs(self, features: Tensor) -> tuple[Tensor, Tensor]:
        """Means or logits, and logarithms of deviations."""
        outputs, log_sigmas = self.layer(features).chunk(2, dim=-1)
        return outputs, log_sigmas.clamp(*_LOG_SIGMA_LIMITS)


def require_privileged(layout: Layout, names: Sequence[str]) -> list[int]:
    """Where the privileged elements of these names lie.

    Raises:
        LayoutError: there is none of a name.
    """
    known = [element.name for element in layout.privileged]
    for name in names:
        if name not in known:
            raise LayoutError(f"{layout.task} has no privileged element {name}; there are {', '.join(known) or 'none'}")
    return [known.index(name) for name in names]
