"""What the networks of reward signals share: a body, the action as numbers, and saving to the bit."""

import copy
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from policies.learn.config.network import NetworkSettings
from policies.learn.networks.dense_layers import dense
from policies.learn.signals.signal import Transitions


def build_body(inputs: int, settings: NetworkSettings, generator: torch.Generator) -> nn.Sequential:
    """Dense layers with swish. As in ML-Agents, memory and goal conditioning have no effect on signals."""
    sizes = [inputs, *[settings.hidden_units] * max(settings.num_layers, 1)]
    layers = [(dense(a, b, generator), nn.SiLU()) for a, b in pairwise(sizes)]
    return nn.Sequential(*(part for layer in layers for part in layer))


def flat_actions(transitions: Transitions, branch_sizes: Sequence[int]) -> Tensor:
    """Continuous actions, then each branch as one-hot: (..., continuous + sum of branch sizes)."""
    parts = [functional.one_hot(transitions.branches[..., k], size) for k, size in enumerate(branch_sizes)]
    return torch.cat([transitions.continuous, *(part.to(transitions.continuous.dtype) for part in parts)], dim=-1)


def snapshot(network: nn.Module, optimizer: torch.optim.Optimizer) -> dict[str, Any]:
    """A copy of both."""
    return copy.deepcopy({"network": network.state_dict(), "optimizer": optimizer.state_dict()})


def restore(state: Mapping[str, Any], network: nn.Module, optimizer: torch.optim.Optimizer) -> None:
    """Puts back what `snapshot` copied."""
    network.load_state_dict(state["network"])
    optimizer.load_state_dict(copy.deepcopy(state["optimizer"]))
