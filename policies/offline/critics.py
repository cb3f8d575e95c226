"""Twin critics with targets that follow slowly: what IQL, TD3+BC and AWAC have in common."""

import copy
from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from policies.learn.algorithms.sac_losses import action_values, expected_values
from policies.learn.networks.policy import Policy
from policies.offline.flat_parameters import FlatOptimizer, flatten
from policies.offline.stacked_networks import twin_critics


class TwinCritics:
    """Two critics of observations and actions, and their targets."""

    def __init__(self, policy: Policy, tau: float, generator: torch.Generator) -> None:
        """Untrained critics.

        Args:
            policy: whose observations, actions and network settings they share.
            tau: how far the targets follow at each step.
            generator: draws the weights.
        """
        device = next(policy.parameters()).device
        self.networks = twin_critics(policy.layout, policy.settings, generator).to(device)
        self.targets = copy.deepcopy(self.networks).requires_grad_(False)
        self._target_vector = flatten(self.targets.parameters())
        self._tau = tau

    def values(self, inputs: Tensor, branches: Tensor, *, of_targets: bool = False) -> Tensor:
        """Of actions, shape (critics, B).

        Args:
            inputs: normalised observations and continuous actions side by side.
            branches: the choices, shape (B, branches).
            of_targets: by the targets, in place of the critics that learn.
        """
        outputs: Tensor = (self.targets if of_targets else self.networks)(inputs)
        if outputs.shape[-1] == 1:
            return outputs[..., 0]
        return action_values(outputs[:, :, None], branches)[..., 0]

    def expected(self, inputs: Tensor, choice_logs: Tensor, *, of_targets: bool = False) -> Tensor:
        """Of the policy's actions by the lesser critic, exact over choices, shape (B,).

        Args:
            inputs: normalised observations and the policy's continuous actions side by side.
            choice_logs: log-probabilities of all choices, shape (B, branches, choices).
            of_targets: by the targets.
        """
        outputs: Tensor = (self.targets if of_targets else self.networks)(inputs)
        if outputs.shape[-1] == 1:
            return outputs[..., 0].amin(dim=0)
        return expected_values(outputs[:, :, None], choice_logs)[:, 0]

    def follow(self, optimizer: FlatOptimizer) -> None:
        """Moves the targets; the critics are the first parameters of that optimiser."""
        self._target_vector.lerp_(optimizer.vector.detach()[: len(self._target_vector)], self._tau)

    def state(self) -> dict[str, Any]:
        """Critics and targets as SAC names them, so that it can go on with them."""
        return {"critics": self.networks.sac_record(), "targets": self.targets.sac_record()}

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on from what `state` returned."""
        self.networks.load_sac_record(state["critics"])
        self.targets.load_sac_record(state["targets"])

    def takes(self, state: Mapping[str, Any]) -> bool:
        """Whether critics of another run, as `state` returned them, fit."""
        pairs = ((self.networks, "critics"), (self.targets, "targets"))
        return all(_shapes(network.sac_record()) == _shapes(state.get(name, {})) for network, name in pairs)


def _shapes(record: Mapping[str, Tensor]) -> dict[str, torch.Size]:
    return {name: tensor.shape for name, tensor in record.items()}
