"""Bodies of actors and critics, and the critic: observations in, features and values out; ML-Agents' shapes.

A body normalises floats (if asked to), puts the features of an image before them, passes dense layers with swish, and
an LSTM or a transformer if it has memory. What is seen has the shape (..., observation) without memory and (steps,
sequences, observation) with it.
"""

from collections.abc import Sequence
from itertools import pairwise

import torch
import torch.nn.functional as F  # noqa: N812  (the name of the field)
from torch import Tensor, nn

from policies.learn.config.network import NetworkSettings
from policies.learn.networks.dense_layers import dense, value_heads
from policies.learn.networks.history import History
from policies.learn.networks.hyper_network import HyperDense
from policies.learn.networks.lstm import Recurrence
from policies.learn.networks.normalizer import Normalizer
from policies.learn.networks.observations import Observation, as_observation
from policies.learn.networks.vision import ImageEncoder
from policies.tasks.layout import ImageElement, Layout


class Body(nn.Module):
    """What turns observations into features."""

    def __init__(
        self,
        inputs: int,
        settings: NetworkSettings,
        generator: torch.Generator,
        goal_indices: Sequence[int] = (),
        *,
        image: ImageElement | None = None,
        is_privileged: bool = False,
    ) -> None:
        """A body with weights drawn from `generator`.

        Args:
            inputs: floats of an observation, with the privileged ones if it sees them.
            settings: its shape.
            generator: on the CPU.
            goal_indices: elements that make the last layer's weights; none: a plain layer.
            image: that it sees; none: it sees none, even where there is one.
            is_privileged: whether it sees privileged elements, behind the others.
        """
        super().__init__()
        width = settings.hidden_units
        self.is_privileged = is_privileged
        self.normalizer = Normalizer(inputs) if settings.normalize and inputs else None
        self.encoder = ImageEncoder(settings.vis_encode_type, image.shape, width, generator) if image else None
        self.goal_indices = list(goal_indices)
        count = max(settings.num_layers, 1) - bool(self.goal_indices)
        sizes = [inputs + width * bool(image), *[width] * count]
        self.layers = nn.ModuleList(dense(a, b, generator) for a, b in pairwise(sizes))
        self.hyper = HyperDense(sizes[-1], width, len(self.goal_indices), generator) if self.goal_indices else None
        self.recurrence = _recurrence(width, settings, generator)
        self.memory_size = self.recurrence.memory_size if self.recurrence else 0
        self.size = self.recurrence.size if self.recurrence else width

    def normalize(self, observations: Tensor | Observation) -> None:
        """Takes observations into account, shape (..., observation), if this body normalises."""
        if self.normalizer is not None:
            self.normalizer.update(self._floats(as_observation(observations)))

    def encode(self, observations: Tensor | Observation) -> Tensor:
        """Features before the memory, shape (..., hidden units)."""
        observation = as_observation(observations)
        floats = self._floats(observation)
        features = floats if self.normalizer is None else self.normalizer(floats)
        goals = features[..., self.goal_indices] if self.hyper is not None else None
        if self.encoder is not None:
            if observation.image is None:
                raise ValueError("this network sees an image, and was given none")
            features = torch.cat((self.encoder(observation.image), features), dim=-1)
        features = self.hidden(features)
        return features if self.hyper is None else F.silu(self.hyper(features, goals))

    def hidden(self, features: Tensor) -> Tensor:
        """What the dense layers make of normalised floats, behind the image's features, shape (..., hidden units)."""
        for layer in self.layers:
            features = F.silu(layer(features))
        return features

    def step(self, observations: Tensor | Observation, memory: Tensor) -> tuple[Tensor, Tensor]:
        """Features (rows, size) and the memory after them (rows, memory); no columns without memory."""
        features = self.encode(observations)
        return (features, memory) if self.recurrence is None else self.recurrence.step(features, memory)

    def forward(
        self, observations: Tensor | Observation, memory: Tensor | None = None, is_start: Tensor | None = None
    ) -> Tensor:
        """Features, shape (..., size); `memory` and `is_start` as `Recurrence.forward` has them."""
        features = self.encode(observations)
        if self.recurrence is None or memory is None or is_start is None:
            return features
        outputs: Tensor = self.recurrence(features, memory, is_start)
        return outputs

    def _floats(self, observation: Observation) -> Tensor:
        if not self.is_privileged:
            return observation.vector
        if observation.privileged is None:
            raise ValueError("this network sees privileged elements, and was given none")
        return torch.cat((observation.vector, observation.privileged), dim=-1)


def _recurrence(width: int, settings: NetworkSettings, generator: torch.Generator) -> Recurrence | History | None:
    memory = settings.memory
    if memory is None:
        return None
    if memory.memory_type == "transformer":
        return History(width, memory.sequence_length, memory.layers, memory.heads, generator)
    return Recurrence(width, memory.memory_size, generator)


def policy_body(layout: Layout, settings: NetworkSettings, generator: torch.Generator) -> Body:
    """The body of an actor or a critic for a layout.

    Its goal drives a hyper-network only where the settings call it a goal signal: most tasks mark goal elements, for
    hindsight, while ML-Agents' environments seldom declare a goal sensor, so that its default `hyper` does nothing.
    """
    return Body(layout.observation_size, settings, generator, _goal(layout, settings), image=layout.image)


def privileged_body(layout: Layout, settings: NetworkSettings, generator: torch.Generator) -> Body:
    """The body of a critic that sees privileged elements in place of the image."""
    inputs = layout.observation_size + len(layout.privileged)
    return Body(inputs, settings, generator, _goal(layout, settings), is_privileged=True)


def _goal(layout: Layout, settings: NetworkSettings) -> Sequence[int]:
    is_hyper = settings.goal_signal and settings.goal_conditioning_type == "hyper"
    return layout.goal_indices if is_hyper else ()


class Critic(nn.Module):
    """Estimates the return of each reward signal."""

    def __init__(self, body: Body, signal_count: int, generator: torch.Generator, *, normalizes: bool = False) -> None:
        """A critic on a body of its own, or on the actor's.

        Args:
            body: what makes its features.
            signal_count: reward signals, one head each.
            generator: draws the heads' weights.
            normalizes: whether the heads learn returns brought to mean 0 and deviation 1.
        """
        super().__init__()
        self.body = body
        self.heads = value_heads(body.size, signal_count, generator)
        self.normalizer = Normalizer(signal_count) if normalizes else None

    def forward(self, observations: Tensor | Observation) -> Tensor:
        """Estimated returns in the rewards' unit, shape (..., signals); without memory."""
        return self._in_rewards(self.body(observations))

    def step(self, observations: Tensor | Observation, memory: Tensor) -> tuple[Tensor, Tensor]:
        """Estimated returns (rows, signals), and the memory after them."""
        features, memory = self.body.step(observations, memory)
        return self._in_rewards(features), memory

    def own_unit(self, returns: Tensor) -> Tensor:
        """Returns as the heads are to give them."""
        return returns if self.normalizer is None else self.normalizer.unbounded(returns)

    def _in_rewards(self, features: Tensor) -> Tensor:
        outputs: Tensor = self.heads(features)
        return outputs if self.normalizer is None else self.normalizer.inverse(outputs)
