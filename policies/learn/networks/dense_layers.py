"""Dense layers with ML-Agents' initialisation, drawn from a generator of the caller's."""

import torch
from torch import nn


def dense(inputs: int, outputs: int, generator: torch.Generator, gain: float = 1.0) -> nn.Linear:
    """A linear layer: Kaiming normal of linear gain, times `gain`; bias 0."""
    layer: nn.Linear = nn.utils.skip_init(nn.Linear, inputs, outputs)  # type: ignore[no-untyped-call]
    nn.init.kaiming_normal_(layer.weight, nonlinearity="linear", generator=generator)
    with torch.no_grad():
        layer.weight *= gain
    nn.init.zeros_(layer.bias)
    return layer


def value_heads(inputs: int, outputs: int, generator: torch.Generator) -> nn.Linear:
    """A linear layer: Xavier uniform, one head at a time; bias 0."""
    layer: nn.Linear = nn.utils.skip_init(nn.Linear, inputs, outputs)  # type: ignore[no-untyped-call]
    for k in range(outputs):
        nn.init.xavier_uniform_(layer.weight.data[k : k + 1], generator=generator)
    nn.init.zeros_(layer.bias)
    return layer
