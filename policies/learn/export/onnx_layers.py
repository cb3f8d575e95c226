"""Layers of networks that look at images, in an ONNX graph."""

import torch
from torch import nn

from policies.learn.export.onnx_graph import Graph
from policies.learn.networks.vision import Residual


def add_layers(graph: Graph, layers: nn.Sequential, images: str) -> str:
    """Adds layer by layer, and returns the last one's result.

    Raises:
        TypeError: a layer that such networks do not have.
    """
    for layer in layers:
        match layer:
            case nn.Sequential():
                images = add_layers(graph, layer, images)
            case nn.Conv2d():
                images = graph.convolution(images, layer)
            case nn.BatchNorm2d():
                images = graph.batch_norm(images, layer)
            case nn.LeakyReLU():
                images = graph.node("LeakyRelu", images, alpha=layer.negative_slope)
            case nn.ReLU():
                images = graph.node("Relu", images)
            case nn.SiLU():
                images = graph.swish(images)
            case nn.MaxPool2d():
                sizes = {"kernel_shape": [layer.kernel_size] * 2, "strides": [layer.stride] * 2}
                images = graph.node("MaxPool", images, **sizes)
            case nn.Upsample(mode="nearest"):
                factors = graph.weight(torch.tensor([1.0, 1.0, layer.scale_factor, layer.scale_factor]))
                images = graph.node("Upsample", images, factors, mode="nearest")
            case Residual():
                images = graph.node("Add", images, add_layers(graph, layer.layers, images))
            case nn.Flatten():
                images = graph.node("Flatten", images, axis=1)
            case nn.Linear():
                images = graph.dense(images, layer)
            case _:
                raise TypeError(f"no such layer in a graph: {layer}")
    return images
