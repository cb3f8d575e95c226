"""An ONNX graph in the making, operation by operation."""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper
from torch import Tensor, nn

OPSET = 9
IR_VERSION = 4  # the one that came with opset 9


class Graph:
    """Operations, weights, inputs and outputs; names are given in order: the same policy gives the same bytes."""

    def __init__(self) -> None:
        self._nodes: list[Any] = []
        self._weights: list[Any] = []
        self._inputs: list[Any] = []
        self._outputs: list[Any] = []

    def node(self, kind: str, *inputs: str, **attributes: Any) -> str:
        """Adds an operation with one result, and returns that."""
        return self.nodes(kind, *inputs, count=1, **attributes)[0]

    def nodes(self, kind: str, *inputs: str, count: int, **attributes: Any) -> list[str]:
        """Adds an operation, and returns its results."""
        results = [f"{kind}_{len(self._nodes)}_{k}" for k in range(count)]
        self._nodes.append(helper.make_node(kind, list(inputs), results, **attributes))
        return results

    def dense(self, inputs: str, layer: nn.Module) -> str:
        """A linear layer."""
        assert isinstance(layer, nn.Linear)  # noqa: S101  (for the type checker)
        return self.node("Gemm", inputs, self.weight(layer.weight), self.weight(layer.bias), transB=1)

    def convolution(self, images: str, layer: nn.Conv2d) -> str:
        """A convolution of (batch, channels, height, width)."""
        sizes = {"kernel_shape": layer.kernel_size, "strides": layer.stride, "pads": [*layer.padding] * 2}
        weights = [layer.weight] if layer.bias is None else [layer.weight, layer.bias]
        return self.node("Conv", images, *map(self.weight, weights), **sizes, dilations=layer.dilation)

    def batch_norm(self, images: str, layer: nn.BatchNorm2d) -> str:
        """As it is in flight: by the means and variances of training."""
        mean, var = layer.running_mean, layer.running_var
        assert mean is not None and var is not None  # noqa: S101, PT018  (for the type checker)
        numbers = map(self.weight, (layer.weight, layer.bias, mean, var))
        return self.node("BatchNormalization", images, *numbers, epsilon=layer.eps)

    def swish(self, inputs: str) -> str:
        return self.node("Mul", inputs, self.node("Sigmoid", inputs))

    def weight(self, tensor: Tensor) -> str:
        """Numbers that are part of the graph."""
        return self._stored(tensor.detach().cpu().numpy())

    def integers(self, values: list[int]) -> str:
        return self._stored(np.array(values, dtype=np.int64))

    def _stored(self, array: NDArray[Any]) -> str:
        name = f"weight_{len(self._weights)}"
        self._weights.append(numpy_helper.from_array(np.ascontiguousarray(array), name))
        return name

    def input(self, name: str, shape: list[str | int]) -> str:
        self._inputs.append(helper.make_tensor_value_info(name, TensorProto.FLOAT, shape))
        return name

    def output(self, name: str, result: str, shape: list[str | int], kind: int = TensorProto.FLOAT) -> None:
        """Names a result of the graph."""
        self._nodes.append(helper.make_node("Identity", [result], [name]))
        self._outputs.append(helper.make_tensor_value_info(name, kind, shape))

    def constant_output(self, name: str, values: Any) -> None:
        tensor = torch.tensor(values)
        self.output(name, self.weight(tensor), list(tensor.shape))

    def model(self) -> Any:
        """The whole."""
        graph = helper.make_graph(self._nodes, "policy", self._inputs, self._outputs, self._weights)
        opset = helper.make_opsetid("", OPSET)
        return helper.make_model(graph, opset_imports=[opset], ir_version=IR_VERSION, producer_name="honeyguide")
