"""A dense layer whose weights are made from the goal (hyper-network), ML-Agents' `goal_conditioning_type: hyper`.

In: activations and goal elements. Out: activations of the next layer. Two dense swish layers, a layer norm without
parameters and a linear layer make one weight matrix per row; the bias is a plain parameter.
"""

import math

import torch
import torch.nn.functional as F  # noqa: N812  (the name of the field)
from torch import Tensor, nn

from policies.learn.networks.dense_layers import dense


class HyperDense(nn.Module):
    """A linear layer for each goal."""

    def __init__(self, inputs: int, outputs: int, goal_size: int, generator: torch.Generator) -> None:
        super().__init__()
        self._shape = (inputs, outputs)
        self.first = dense(goal_size, outputs, generator)
        self.second = dense(outputs, outputs, generator)
        self.weights = dense(outputs, inputs * outputs, generator)
        bound = math.sqrt(1.0 / (outputs * inputs))
        nn.init.uniform_(self.weights.weight, -bound, bound, generator=generator)
        self.bias = nn.Parameter(torch.zeros(outputs))

    def forward(self, activations: Tensor, goals: Tensor) -> Tensor:
        """Activations of the next layer, before its non-linearity, shape (..., outputs)."""
        hidden = F.silu(self.second(F.silu(self.first(goals))))
        hidden = F.layer_norm(hidden, hidden.shape[-1:])
        weights: Tensor = self.weights(hidden)
        matrices = weights.view(*weights.shape[:-1], *self._shape)
        return (activations.unsqueeze(-2) @ matrices).squeeze(-2) + self.bias
