"""A policy that looks back, as ONNX: one decision of `policies.learn.networks.history.History`."""

import math

import torch
from torch import nn

from policies.learn.export.onnx_graph import Graph
from policies.learn.networks.history import MASKED, Attention, History


def add_history(graph: Graph, history: History, features: str) -> str:
    """Adds inputs and outputs of the memory; returns what comes out of the newest decision, (batch, width)."""
    width, context = history.size, history.context
    memory = graph.input("recurrent_in", ["batch", 1, history.memory_size])
    before = graph.node("Reshape", memory, graph.integers([-1, context - 1, width + 1]))
    ones = graph.node("Add", graph.node("Mul", _first(graph, features), _constant(graph, 0.0)), _constant(graph, 1.0))
    newest = graph.node("Unsqueeze", graph.node("Concat", features, ones, axis=1), axes=[1])
    slots = graph.node("Concat", before, newest, axis=1)
    after = graph.node("Slice", slots, axes=[1], starts=[1], ends=[context])
    after = graph.node("Reshape", after, graph.integers([-1, 1, history.memory_size]))
    graph.output("recurrent_out", after, ["batch", 1, history.memory_size])
    tokens = graph.node("Slice", slots, axes=[2], starts=[0], ends=[width])
    is_there = graph.node("Slice", slots, axes=[2], starts=[width], ends=[width + 1])  # (batch, context, 1)
    distances, is_past = history.distances(context)
    seen = graph.node("Mul", graph.node("Transpose", is_there, perm=[0, 2, 1]), graph.weight(is_past.float()))
    forbidden = graph.node("Mul", graph.node("Sub", _constant(graph, 1.0), seen), _constant(graph, MASKED))
    forbidden = graph.node("Unsqueeze", forbidden, axes=[1])
    for layer in history.layers:
        assert isinstance(layer, Attention)  # noqa: S101  (for the type checker)
        tokens = _attention(graph, layer, tokens, forbidden, distances)
    last = graph.node("Slice", tokens, axes=[1], starts=[context - 1], ends=[context])
    return graph.node("Squeeze", last, axes=[1])


def _attention(graph: Graph, layer: Attention, tokens: str, forbidden: str, distances: torch.Tensor) -> str:
    width = layer.queries.in_features
    inputs = _normed(graph, tokens, layer.first_norm)

    def split(dense: nn.Linear, perm: list[int]) -> str:
        shape = graph.integers([0, 0, layer.heads, width // layer.heads])
        return graph.node("Transpose", graph.node("Reshape", _dense(graph, inputs, dense), shape), perm=perm)

    queries, keys = split(layer.queries, [0, 2, 1, 3]), split(layer.keys, [0, 2, 3, 1])
    values = split(layer.values, [0, 2, 1, 3])
    scale = _constant(graph, math.sqrt(width // layer.heads))
    scores = graph.node("Div", graph.node("MatMul", queries, keys), scale)
    scores = graph.node("Add", graph.node("Add", scores, graph.weight(layer.ago[:, distances])), forbidden)
    blank = graph.node("Mul", graph.node("Slice", scores, axes=[3], starts=[0], ends=[1]), _constant(graph, 0.0))
    nothing = graph.node("Add", blank, graph.weight(layer.nothing))
    weights = graph.node("Softmax", graph.node("Concat", scores, nothing, axis=3), axis=3)
    weights = graph.node("Slice", weights, axes=[3], starts=[0], ends=[len(distances)])
    mixed = graph.node("MatMul", weights, values)
    mixed = graph.node("Reshape", graph.node("Transpose", mixed, perm=[0, 2, 1, 3]), graph.integers([0, 0, width]))
    tokens = graph.node("Add", tokens, _dense(graph, mixed, layer.mix))
    wide = graph.swish(_dense(graph, _normed(graph, tokens, layer.second_norm), layer.widen))
    return graph.node("Add", tokens, _dense(graph, wide, layer.narrow))


def _normed(graph: Graph, tokens: str, norm: nn.LayerNorm) -> str:
    centred = graph.node("Sub", tokens, graph.node("ReduceMean", tokens, axes=[2], keepdims=1))
    var = graph.node("ReduceMean", graph.node("Mul", centred, centred), axes=[2], keepdims=1)
    deviation = graph.node("Sqrt", graph.node("Add", var, _constant(graph, norm.eps)))
    scaled = graph.node("Mul", graph.node("Div", centred, deviation), graph.weight(norm.weight))
    return graph.node("Add", scaled, graph.weight(norm.bias))


def _dense(graph: Graph, tokens: str, layer: nn.Linear) -> str:
    """A linear layer on each token of (batch, length, width)."""
    return graph.node("Add", graph.node("MatMul", tokens, graph.weight(layer.weight.T)), graph.weight(layer.bias))


def _first(graph: Graph, features: str) -> str:
    return graph.node("Slice", features, axes=[1], starts=[0], ends=[1])


def _constant(graph: Graph, value: float) -> str:
    return graph.weight(torch.tensor([value]))
