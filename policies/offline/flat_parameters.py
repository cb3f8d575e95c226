"""Parameters of several networks as views of one vector: one gradient, one step of Adam, one move of a target.

This is the only place where offline training takes a gradient and makes a step; several processes that train together
average the gradient between the two.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import torch
from torch import Tensor, nn

from policies.learn.averaging import averaged


def flatten(parameters: Iterable[nn.Parameter]) -> Tensor:
    """Moves parameters into one new vector, whose views they become; shape (numbers,)."""
    parameters = list(parameters)
    vector = torch.cat([parameter.detach().flatten() for parameter in parameters])
    for parameter, part in zip(parameters, torch.split(vector, [each.numel() for each in parameters]), strict=True):
        parameter.data = part.view_as(parameter)
    return vector


class FlatOptimizer:
    """Adam on the parameters of networks, which become views of one vector."""

    def __init__(
        self, parameters: Iterable[nn.Parameter], learning_rate: float, max_grad_norm: float | None = None
    ) -> None:
        """An optimiser that has made no step.

        Args:
            parameters: of all networks that learn together.
            learning_rate: of Adam.
            max_grad_norm: the gradient is scaled down to this norm; none: not at all.
        """
        self._parameters = list(parameters)
        self.vector = nn.Parameter(flatten(self._parameters))
        self._max_grad_norm = max_grad_norm
        self._adam = torch.optim.Adam([self.vector], lr=learning_rate, fused=True)

    def step(self, loss: Tensor) -> None:
        """One step down the slope of a loss, the mean of all processes'; parameters that none depends on stay."""
        self._apply(averaged(self._gradient(loss)))

    def set_learning_rate(self, learning_rate: float) -> None:
        """Of the next steps."""
        for group in self._adam.param_groups:
            group["lr"] = learning_rate

    def _gradient(self, loss: Tensor) -> Tensor:
        """Of a loss, shape (numbers,)."""
        gradients = torch.autograd.grad(loss, self._parameters, allow_unused=True, materialize_grads=True)
        return torch.cat([gradient.reshape(-1) for gradient in gradients])

    def _apply(self, gradient: Tensor) -> None:
        self.vector.grad = gradient
        if self._max_grad_norm is not None:
            nn.utils.clip_grad_norm_([self.vector], self._max_grad_norm)
        self._adam.step()

    def state(self) -> dict[str, Any]:
        """Of Adam; the networks have the parameters."""
        return self._adam.state_dict()

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on from what `state` returned."""
        self._adam.load_state_dict(dict(state))
