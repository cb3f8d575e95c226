"""Weights that offline training begins with: drawn as torch draws those of linear layers, smaller than ML-Agents'.

Policies and critics that begin smaller are smoother functions of what they see, and follow the noise of a small dataset
less: on 25,000 disturbed decisions of Hover they flew better by far (`python -m bench offline` shows what they reach).
"""

import math

import torch
from torch import Tensor, nn

from policies.learn.networks.policy import Policy


def uniform(shape: tuple[int, ...], inputs: int, generator: torch.Generator) -> Tensor:
    """Between -1 and 1, over the root of a layer's inputs."""
    return (2.0 * torch.rand(shape, generator=generator) - 1.0) / math.sqrt(inputs)


@torch.no_grad()
def draw_policy(policy: Policy, generator: torch.Generator) -> None:
    """Draws the dense layers and the mean of continuous actions anew; a mixture's means stay apart as they are."""
    layers: list[nn.Module] = list(policy.body.layers)
    if policy.heads.mean is not None and policy.heads.mixture is None:
        layers.append(policy.heads.mean)
    for layer in layers:
        if isinstance(layer, nn.Linear):
            for parameter in (layer.weight, layer.bias):
                parameter.copy_(uniform(tuple(parameter.shape), layer.in_features, generator))
