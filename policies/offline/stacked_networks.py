"""Networks of one shape side by side: their weights are stacked, so that each layer of all of them is one product.

They are those of soft actor-critic (`policies/learn/algorithms/sac_update.py`), weight by weight, which can go on with
them: a base value of observation and continuous actions, and a value for each choice of each branch.
"""

from collections.abc import Mapping
from itertools import pairwise

import torch
import torch.nn.functional as F  # noqa: N812  (the name of the field)
from torch import Tensor, nn

from policies.learn.config.network import NetworkSettings
from policies.offline.initial_weights import uniform
from policies.tasks.layout import Layout


class StackedNetworks(nn.Module):
    """Dense networks with swish and a linear last layer."""

    def __init__(self, count: int, sizes: list[int], generator: torch.Generator) -> None:
        """Untrained networks.

        Args:
            count: networks side by side.
            sizes: of inputs, of each hidden layer, of outputs.
            generator: draws the weights.
        """
        super().__init__()
        layers = [
            (uniform((count, a, b), a, generator), uniform((count, 1, b), a, generator)) for a, b in pairwise(sizes)
        ]
        self.weights = nn.ParameterList(weight for weight, _ in layers)
        self.biases = nn.ParameterList(bias for _, bias in layers)

    def forward(self, inputs: Tensor, count: int | None = None) -> Tensor:
        """What networks make of the same inputs (B, inputs), shape (networks, B, outputs): all, or the first ones."""
        features = inputs.expand(count or len(self.weights[0]), *inputs.shape)
        *hidden, (weight, bias) = self._layers(count)
        for hidden_weight, hidden_bias in hidden:
            features = F.silu(torch.baddbmm(hidden_bias, features, hidden_weight))
        if weight.shape[-1] > 1:
            return torch.baddbmm(bias, features, weight)
        return (features * weight.transpose(1, 2)).sum(dim=-1, keepdim=True) + bias  # a product of one column is slow

    def _layers(self, count: int | None) -> list[tuple[Tensor, Tensor]]:
        """Weights and biases of all networks, or of the first ones."""
        layers = list(zip(self.weights, self.biases, strict=True))
        return layers if count is None else [(weight[:count], bias[:count]) for weight, bias in layers]

    def sac_record(self) -> dict[str, Tensor]:
        """The networks as soft actor-critic names its critics."""
        return {
            name: weight[i].T if name.endswith("weight") else weight[i, 0]
            for i in range(len(self.weights[0]))
            for name, weight in self._named(i)
        }

    def load_sac_record(self, record: Mapping[str, Tensor]) -> None:
        """What `sac_record` returned."""
        with torch.no_grad():
            for i in range(len(self.weights[0])):
                for name, weight in self._named(i):
                    weight[i].copy_(record[name].T if name.endswith("weight") else record[name][None])

    def _named(self, i: int) -> list[tuple[str, Tensor]]:
        """The stacked tensors by the name that soft actor-critic has for those of network i."""
        last = len(self.weights) - 1
        named = []
        for k, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            layer = f"{i}.heads" if k == last else f"{i}.body.layers.{k}"
            named += [(f"{layer}.weight", weight.detach()), (f"{layer}.bias", bias.detach())]
        return named


def twin_critics(layout: Layout, settings: NetworkSettings, generator: torch.Generator) -> StackedNetworks:
    """Two critics of observation and action: outputs are a base value, then a value of each choice of each branch."""
    branches = layout.branch_sizes
    columns = 1 + len(branches) * max(branches, default=0)
    inputs = layout.observation_size + len(layout.continuous)
    return StackedNetworks(2, [inputs, *_hidden(settings), columns], generator)


def value_network(layout: Layout, settings: NetworkSettings, generator: torch.Generator) -> StackedNetworks:
    """What an observation is worth."""
    return StackedNetworks(1, [layout.observation_size, *_hidden(settings), 1], generator)


def _hidden(settings: NetworkSettings) -> list[int]:
    return [settings.hidden_units] * max(settings.num_layers, 1)
