"""Memory of policies that look back: a causal transformer over the features of the last decisions.

The memory of a row is those features, oldest first, each with 1.0 behind it, or zeros where the episode is younger.
Acting looks at them and at the new one. Learning passes whole stretches, and looks at just as much; no decision looks
beyond its episode's start, or further back than `context`. What counts is how long ago something was, not when.
"""

import math

import torch
import torch.nn.functional as F  # noqa: N812  (the name of the field)
from torch import Tensor, nn

from policies.learn.networks.dense_layers import dense

MASKED = -1e9  # score of what must not be looked at
_WIDENING = 4  # of the dense layers between, as in Vaswani et al. 2017 (arXiv 1706.03762)


class Attention(nn.Module):
    """One layer: attention, then two dense layers, each added to what came in (pre-norm)."""

    def __init__(self, width: int, heads: int, context: int, generator: torch.Generator) -> None:
        super().__init__()
        self.heads = heads
        self.first_norm, self.second_norm = nn.LayerNorm(width), nn.LayerNorm(width)
        self.queries, self.keys, self.values, self.mix = (dense(width, width, generator) for _ in range(4))
        self.ago = nn.Parameter(torch.zeros(heads, context))  # added to the score of what was so many decisions ago
        self.nothing = nn.Parameter(torch.zeros(heads, 1, 1))  # score of looking at nothing: tells one past from none
        self.widen = dense(width, _WIDENING * width, generator)
        self.narrow = dense(_WIDENING * width, width, generator, gain=0.5)

    def forward(self, tokens: Tensor, forbidden: Tensor, distances: Tensor) -> Tensor:
        """Tokens of sequences (sequences, length, width).

        Args:
            tokens: what comes in.
            forbidden: 0 where the second may be looked at from the first, else MASKED; (sequences, length, length).
            distances: how many decisions the second was before the first, within the context, (length, length).
        """
        inputs = self.first_norm(tokens)
        queries, keys, values = (self._split(layer(inputs)) for layer in (self.queries, self.keys, self.values))
        scores = queries @ keys.transpose(-1, -2) / math.sqrt(queries.shape[-1])
        scores = scores + self.ago[:, distances] + forbidden[:, None]
        nothing = self.nothing.expand(len(scores), -1, scores.shape[2], -1)
        weights = torch.cat((scores, nothing), dim=-1).softmax(dim=-1)[..., :-1]
        mixed = (weights @ values).transpose(1, 2).flatten(2)
        tokens = tokens + self.mix(mixed)
        outputs: Tensor = tokens + self.narrow(F.silu(self.widen(self.second_norm(tokens))))
        return outputs

    def _split(self, inputs: Tensor) -> Tensor:
        """By head, shape (sequences, heads, length, width of a head)."""
        return inputs.view(*inputs.shape[:2], self.heads, -1).transpose(1, 2)


class History(nn.Module):
    """Takes the place of an LSTM: see `policies.learn.networks.lstm.Recurrence`."""

    def __init__(self, width: int, context: int, layers: int, heads: int, generator: torch.Generator) -> None:
        """An untrained transformer.

        Args:
            width: of features that come in and go out; a multiple of the heads.
            context: decisions that one looks at, itself included.
            layers: of attention.
            heads: of each layer.
            generator: draws the weights, on the CPU.
        """
        super().__init__()
        self.size, self.context = width, context
        self.memory_size = (context - 1) * (width + 1)
        self.layers = nn.ModuleList(Attention(width, heads, context, generator) for _ in range(layers))

    def step(self, inputs: Tensor, memory: Tensor) -> tuple[Tensor, Tensor]:
        """Outputs of one decision (rows, width), and the memory after it (rows, memory)."""
        before = memory.view(len(inputs), self.context - 1, self.size + 1)
        newest = torch.cat((inputs, torch.ones_like(inputs[:, :1])), dim=1)
        slots = torch.cat((before, newest[:, None]), dim=1)
        is_there = slots[:, :, -1] > 0.0
        outputs = self._looked_back(slots[:, :, :-1], is_there[:, None].expand(-1, self.context, -1))
        return outputs[:, -1], slots[:, 1:].flatten(1)

    def forward(self, inputs: Tensor, memory: Tensor, is_start: Tensor) -> Tensor:
        """Outputs of whole stretches, (steps, sequences, width), each as `step` has it.

        Args:
            inputs: shape (steps, sequences, width); of several layers at most `context` steps.
            memory: before the first step, shape (sequences, memory).
            is_start: where an episode starts with that decision, shape (steps, sequences).
        """
        steps, sequences, width = inputs.shape
        episode = is_start.T.cumsum(dim=1)
        if not memory.any():  # then all that a decision looks at lies in its stretch: one pass
            is_same = episode[:, :, None] == episode[:, None]
            return self._looked_back(inputs.transpose(0, 1), is_same).transpose(0, 1)
        before = memory.view(sequences, self.context - 1, width + 1)
        tokens = torch.cat((before[:, :, :-1], inputs.transpose(0, 1)), dim=1)
        older = torch.where(before[:, :, -1] > 0.0, 0, -1)  # of the episode that goes on with the stretch, or nothing
        windows = tokens.unfold(1, self.context, 1).transpose(2, 3).flatten(0, 1)
        episodes = torch.cat((older, episode), dim=1).unfold(1, self.context, 1).flatten(0, 1)
        is_same = (episodes == episodes[:, -1:])[:, None].expand(-1, self.context, -1)
        outputs = self._looked_back(windows, is_same)[:, -1]
        return outputs.view(sequences, steps, width).transpose(0, 1)

    def distances(self, length: int, device: torch.device | str = "cpu") -> tuple[Tensor, Tensor]:
        """How long ago the second was, seen from the first, and where that is within the context; (length, length)."""
        position = torch.arange(length, device=device)
        apart = position[:, None] - position
        return apart.clamp(0, self.context - 1), (apart >= 0) & (apart < self.context)

    def _looked_back(self, tokens: Tensor, may_look: Tensor) -> Tensor:
        """Of sequences (sequences, length, width); `may_look` leaves time aside, (sequences, length, length)."""
        distances, is_past = self.distances(tokens.shape[1], tokens.device)
        forbidden = torch.where(may_look & is_past, 0.0, MASKED)
        for layer in self.layers:
            tokens = layer(tokens, forbidden, distances)
        return tokens
