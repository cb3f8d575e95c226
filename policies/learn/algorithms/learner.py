"""What the training loop asks of an algorithm: PPO and SAC are learners.

One iteration collects some decisions of all environments and updates the networks. Everything a learner needs to go on
bit for bit is in its state, its task's included.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from torch import Tensor, nn

from policies.learn.evaluate import Evaluation
from policies.learn.networks.policy import Policy
from policies.tasks.task import Scores


@dataclass(frozen=True, slots=True)
class Iteration:
    """What one iteration did."""

    steps: int  # decisions collected, over all environments
    scores: Scores  # of the episodes that ended meanwhile
    statistics: Mapping[str, float]  # TensorBoard tag to value, ML-Agents' names: "Losses/Policy Loss"
    evaluation: Evaluation | None = None  # of the policy, whose episodes these are: those before do not count any more


class Learner(Protocol):
    """An algorithm on a task."""

    steps: int
    """Decisions collected so far, over all environments."""
    policy: Policy
    """What acts; its parameters are those being trained."""

    def iterate(self) -> Iteration:
        """Collects and learns once."""
        ...

    def restart(self) -> None:
        """Begins an episode in every environment, whatever was going on there."""
        ...

    def state(self) -> dict[str, Any]:
        """Networks, optimisers, generators and the task's arrays: tensors, arrays and plain values only."""
        ...

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on from what `state` returned."""
        ...

    def take_critics(self, state: Mapping[str, Any]) -> None:
        """Starts from the critics in another run's state, where they fit: same algorithm, same networks."""
        ...


def means(statistics: Iterable[Mapping[str, float]]) -> dict[str, float]:
    """Of each tag over the updates that have it."""
    columns: dict[str, list[float]] = {}
    for row in statistics:
        for tag, value in row.items():
            columns.setdefault(tag, []).append(value)
    return {tag: sum(values) / len(values) for tag, values in columns.items()}


def load_if_fitting(module: nn.Module, weights: Mapping[str, Tensor]) -> None:
    """Loads weights of the same names and shapes; others are left alone."""
    shapes = {name: tensor.shape for name, tensor in weights.items()}
    if shapes == {name: tensor.shape for name, tensor in module.state_dict().items()}:
        module.load_state_dict(weights)


class Companion(Protocol):
    """What trains the policy beside an algorithm: behavioural cloning."""

    def update(self, steps: int) -> dict[str, float]:
        """Learns after the algorithm has; `steps` as `Learner.steps`. TensorBoard tag to value."""
        ...

    def state(self) -> dict[str, Any]: ...

    def load_state(self, state: Mapping[str, Any]) -> None: ...
