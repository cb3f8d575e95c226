"""Policies as ONNX files with ML-Agents' names, so that what runs ML-Agents' networks runs ours.

In: a policy. Out: a graph written layer by layer (opset 9, ML-Agents' own; any batch size, also with memory), which has
been compared with the policy on random observations; the layout is in its metadata. The graph is written by hand
because torch's tracing exporter is deprecated and fixes the batch size of memories, and the other needs onnxscript.

Inputs are obs_0, the floats; or obs_0, the image (batch, channels, height, width) from 0 to 1, and obs_1, the floats.
"""

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import onnxruntime
import torch
from numpy.typing import NDArray
from onnx import TensorProto, helper
from torch import Tensor, nn

from common.files import part_path, write_whole
from policies.learn.export.onnx_graph import Graph
from policies.learn.export.onnx_history import add_history
from policies.learn.export.onnx_layers import add_layers
from policies.learn.networks.action_distributions import CLIP, LOG_SIGMA_LIMITS, ActionHeads
from policies.learn.networks.history import History
from policies.learn.networks.hyper_network import HyperDense
from policies.learn.networks.networks import Body
from policies.learn.networks.normalizer import LIMIT
from policies.learn.networks.observations import Observation
from policies.learn.networks.policy import Policy
from policies.tasks.layout import Layout

API_VERSION = 3.0  # ML-Agents' number of this set of names
TOLERANCE = 1e-5
IMAGE_TOLERANCE = 1e-4  # encoders sum thousands of terms, and in another order
_MASKED = 1e8


class ExportError(ValueError):
    """An exported network that cannot be written; the message is one sentence for the user."""


class ParityError(ExportError):
    """An exported network that does not do what the policy does."""


def export_policy(policy: Policy, path: Path) -> float:
    """Writes the policy as an ONNX file, after it was found to do the same.

    Returns:
        The largest difference found between the two.

    Raises:
        ParityError: they differ by more than 1e-5; with images, 1e-4.
        ExportError: the file cannot be written.
    """
    policy = copy.deepcopy(policy).cpu()  # where the graph is compared with it; a training's own may be on a GPU
    content = onnx_bytes(policy)
    difference = largest_difference(policy, content)
    if difference > (TOLERANCE if policy.layout.image is None else IMAGE_TOLERANCE):
        raise ParityError(f"{path}: the exported network differs from the policy by {difference:.1e}")
    try:
        write_whole(path, content)
    except OSError as error:
        part_path(path).unlink(missing_ok=True)
        raise ExportError(f"{path}: cannot be written: {error.strerror}") from error
    return difference


def onnx_bytes(policy: Policy) -> bytes:
    """The policy as an ONNX model."""
    graph = Graph()
    layout = policy.layout
    features = _body(graph, policy.body, layout)
    graph.constant_output("version_number", [API_VERSION])
    graph.constant_output("memory_size", [float(policy.memory_size)])
    if layout.continuous:
        _continuous(graph, policy, features)
    if layout.branches:
        _discrete(graph, policy, features)
    model = graph.model()
    helper.set_model_props(model, {"layout": json.dumps(layout.record())})
    onnx.checker.check_model(model, full_check=True)
    content: bytes = model.SerializeToString()
    return content


def _body(graph: Graph, body: Body, layout: Layout) -> str:
    encoded = ""
    if body.encoder is not None:
        height, width, channels = layout.image_shape
        images = graph.input(_names(layout)[0], ["batch", channels, height, width])
        encoded = add_layers(graph, body.encoder.layers, images)
    features = graph.input(_names(layout)[-1], ["batch", layout.observation_size])
    if body.normalizer is not None:
        centred = graph.node("Sub", features, graph.weight(body.normalizer.mean.float()))
        scaled = graph.node("Div", centred, graph.weight(body.normalizer.deviation))
        features = graph.node("Clip", scaled, min=-LIMIT, max=LIMIT)
    goals = graph.node("Gather", features, graph.integers(body.goal_indices), axis=1) if body.goal_indices else ""
    if encoded:
        features = graph.node("Concat", encoded, features, axis=1)
    for layer in body.layers:
        features = graph.swish(graph.dense(features, layer))
    if body.hyper is not None:
        features = graph.swish(_hyper(graph, body.hyper, features, goals))
    if isinstance(body.recurrence, History):
        features = add_history(graph, body.recurrence, features)
    elif body.recurrence is not None:
        features = _lstm(graph, body.recurrence.lstm, features, body.memory_size)
    return features


def _names(layout: Layout) -> tuple[str, ...]:
    """Of the inputs: the image's, if there is one, and the floats'."""
    return ("obs_0",) if layout.image is None else ("obs_0", "obs_1")


def _hyper(graph: Graph, hyper: HyperDense, features: str, goals: str) -> str:
    hidden = graph.swish(graph.dense(graph.swish(graph.dense(goals, hyper.first)), hyper.second))
    centred = graph.node("Sub", hidden, graph.node("ReduceMean", hidden, axes=[1], keepdims=1))
    var = graph.node("ReduceMean", graph.node("Mul", centred, centred), axes=[1], keepdims=1)
    deviation = graph.node("Sqrt", graph.node("Add", var, graph.weight(torch.tensor([1e-5]))))  # of F.layer_norm
    flat = graph.dense(graph.node("Div", centred, deviation), hyper.weights)
    outputs = len(hyper.bias)
    weights = graph.node("Reshape", flat, graph.integers([-1, hyper.weights.out_features // outputs, outputs]))
    product = graph.node("MatMul", graph.node("Unsqueeze", features, axes=[1]), weights)
    return graph.node("Add", graph.node("Squeeze", product, axes=[1]), graph.weight(hyper.bias))


def _lstm(graph: Graph, lstm: nn.LSTM, features: str, memory_size: int) -> str:
    """One step. ONNX has the gates in the order input, output, forget, cell; torch: input, forget, cell, output."""
    units = lstm.hidden_size
    order = [0, 3, 1, 2]

    def gates(tensor: Any) -> Tensor:
        return torch.cat([tensor.chunk(4)[k] for k in order])

    memory = graph.input("recurrent_in", ["batch", 1, memory_size])
    hidden, cell = graph.nodes("Split", graph.node("Transpose", memory, perm=[1, 0, 2]), count=2, axis=2)
    biases = torch.cat([gates(lstm.bias_ih_l0), gates(lstm.bias_hh_l0)])
    weights = (gates(lstm.weight_ih_l0), gates(lstm.weight_hh_l0), biases)
    inputs = [graph.node("Unsqueeze", features, axes=[0]), *(graph.weight(weight[None]) for weight in weights)]
    _, hidden, cell = graph.nodes("LSTM", *inputs, "", hidden, cell, count=3, hidden_size=units)
    after = graph.node("Transpose", graph.node("Concat", hidden, cell, axis=2), perm=[1, 0, 2])
    graph.output("recurrent_out", after, ["batch", 1, memory_size])
    return graph.node("Squeeze", hidden, axes=[0])


def _continuous(graph: Graph, policy: Policy, features: str) -> None:
    heads, size = policy.heads, len(policy.layout.continuous)
    assert heads.mean is not None  # noqa: S101  (for the type checker)
    mean = _likeliest(graph, heads, features, graph.dense(features, heads.mean))
    if isinstance(heads.log_sigma, nn.Linear):
        low, high = LOG_SIGMA_LIMITS
        log_sigma = _likeliest(graph, heads, features, graph.dense(features, heads.log_sigma))
        log_sigma = graph.node("Clip", log_sigma, min=low, max=high)
        sigma = graph.node("Exp", log_sigma)
    else:
        assert heads.log_sigma is not None  # noqa: S101  (for the type checker)
        sigma = graph.weight(heads.log_sigma.exp())
    drawn = graph.node("Add", mean, graph.node("Mul", graph.node("RandomNormalLike", mean), sigma))
    for name, unbounded in (("continuous_actions", drawn), ("deterministic_continuous_actions", mean)):
        if policy.is_squashed:
            bounded = graph.node("Tanh", unbounded)
        else:
            clipped = graph.node("Clip", unbounded, min=-CLIP, max=CLIP)
            bounded = graph.node("Div", clipped, graph.weight(torch.tensor([CLIP])))
        graph.output(name, bounded, ["batch", size])
    graph.constant_output("continuous_action_output_shape", [float(size)])


def _likeliest(graph: Graph, heads: ActionHeads, features: str, outputs: str) -> str:
    """Of a mixture the outputs of its likeliest component, (batch, continuous); else the outputs themselves."""
    if heads.mixture is None:
        return outputs
    count = heads.component_count
    best = graph.node("ArgMax", graph.dense(features, heads.mixture), axis=1, keepdims=1)
    hot = graph.node("OneHot", best, graph.integers([count]), graph.weight(torch.tensor([0.0, 1.0])), axis=2)
    parts = graph.node("Reshape", outputs, graph.integers([0, count, -1]))
    return graph.node("Squeeze", graph.node("MatMul", hot, parts), axes=[1])  # (batch, 1, count) x (batch, count, C)


def _discrete(graph: Graph, policy: Policy, features: str) -> None:
    sizes = policy.layout.branch_sizes
    assert policy.heads.logits is not None  # noqa: S101  (for the type checker)
    masks = graph.input("action_masks", ["batch", sum(sizes)])  # 1: may be chosen
    forbidden = graph.node("Sub", masks, graph.weight(torch.tensor([1.0])))
    penalty = graph.node("Mul", forbidden, graph.weight(torch.tensor([_MASKED])))
    logits = graph.node("Add", graph.dense(features, policy.heads.logits), penalty)
    parts = graph.nodes("Split", logits, count=len(sizes), axis=1, split=list(sizes)) if len(sizes) > 1 else [logits]
    drawn = [graph.node("Multinomial", part, dtype=TensorProto.INT64) for part in parts]
    best = [graph.node("ArgMax", part, axis=1, keepdims=1) for part in parts]
    for name, columns in (("discrete_actions", drawn), ("deterministic_discrete_actions", best)):
        graph.output(name, graph.node("Concat", *columns, axis=1), ["batch", len(sizes)], TensorProto.INT64)
    graph.constant_output("discrete_action_output_shape", [[float(size) for size in sizes]])


def largest_difference(policy: Policy, content: bytes, row_count: int = 64, decisions: int = 8) -> float:
    """By how much the graph's most probable actions and memories differ from the policy's, over random observations.

    Differences of numbers above 1 are relative. A branch counts by how much less probable the policy finds the graph's
    choice than its own: a tie may fall either way.
    """
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    names = {node.name for node in session.get_inputs()}
    generator = torch.Generator().manual_seed(0)
    memory = policy.start_memory(row_count)
    graph_memory = memory[:, None].numpy()
    most = 0.0
    for _ in range(decisions):
        observations = torch.randn(row_count, policy.layout.observation_size, generator=generator)
        if policy.body.normalizer is not None:  # as wide as those that the policy has seen
            observations = policy.body.normalizer.inverse(observations)
        observation, images = Observation(observations), observations[:, :0]
        if policy.layout.image is not None:
            bytes_ = torch.randint(0, 256, (row_count, *policy.layout.image_shape), generator=generator)
            observation = Observation(observations, bytes_.to(torch.uint8))
            images = bytes_.permute(0, 3, 1, 2) / 255.0
        given = {
            _names(policy.layout)[0]: images.numpy(),
            _names(policy.layout)[-1]: observations.numpy(),
            "action_masks": np.ones((row_count, sum(policy.layout.branch_sizes)), dtype=np.float32),
            "recurrent_in": graph_memory,
        }
        values = session.run(None, {name: value for name, value in given.items() if name in names})
        results = dict(zip([node.name for node in session.get_outputs()], values, strict=True))
        with torch.inference_mode():
            features, memory = policy.body.step(observation, memory)
            distribution = policy.heads(features)
            actions = distribution.mode()
        if policy.layout.continuous:
            most = max(most, _apart(results["deterministic_continuous_actions"], policy.bounded(actions)))
        if policy.layout.branches:
            chosen = torch.from_numpy(results["deterministic_discrete_actions"])
            lost = distribution.choice_logs.amax(-1) - distribution.choice_logs.gather(-1, chosen[..., None])[..., 0]
            most = max(most, float(lost.max()))
        if policy.memory_size:
            graph_memory = results["recurrent_out"]
            most = max(most, _apart(graph_memory[:, 0], memory))
    return most


def _apart(graph: NDArray[np.float32], policy: Tensor) -> float:
    there = policy.numpy()
    return float((np.abs(graph - there) / np.maximum(1.0, np.abs(there))).max())
