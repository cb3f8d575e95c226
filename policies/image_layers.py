"""What the networks that look at images share: a layer of theirs, weights as files of half precision, and how they fly.

In flight ONNX Runtime runs the layers, one image at a time: in about half the time that torch takes.
"""

import copy
from io import BytesIO
from pathlib import Path
from typing import TypeVar

import onnxruntime
import torch
from torch import Tensor, nn

from common.files import write_whole
from policies.learn.export.onnx_graph import Graph
from policies.learn.export.onnx_layers import add_layers

Network = TypeVar("Network", bound=nn.Module)


def conv_block(inputs: int, outputs: int, *, stride: int = 1, dilation: int = 1, size: int = 3) -> nn.Sequential:
    """A convolution that keeps the size but for its stride, batch norm, and SiLU."""
    padding = dilation * (size // 2)
    convolution = nn.Conv2d(inputs, outputs, size, stride=stride, padding=padding, dilation=dilation, bias=False)
    return nn.Sequential(convolution, nn.BatchNorm2d(outputs), nn.SiLU())


def save_weights(network: nn.Module, file: Path) -> None:
    """Writes them whole.

    Raises:
        OSError: the folder is missing or may not be written.
    """
    content = BytesIO()
    torch.save({name: value.half() for name, value in network.state_dict().items()}, content)
    write_whole(file, content.getvalue())


def load_weights(network: nn.Module, file: Path) -> None:
    """Gives a network of the same layers the weights of a file."""
    weights = torch.load(file, weights_only=True)
    network.load_state_dict({name: value.float() for name, value in weights.items()})


class Flown(nn.Module):
    """Layers as ONNX Runtime runs them, on one core.

    Args:
        layers: trained, those of `onnx_layers`, from maps to maps; copied.
    """

    def __init__(self, layers: nn.Sequential) -> None:
        super().__init__()
        graph = Graph()
        maps = add_layers(graph, layers, graph.input("images", ["batch", "channels", "height", "width"]))
        graph.output("maps", maps, ["batch", "channels out", "height out", "width out"])
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1  # more only wait for each other
        content = graph.model().SerializeToString()
        self._session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])

    def forward(self, images: Tensor) -> Tensor:
        """Images (n, channels, height, width) in, maps out."""
        return torch.from_numpy(self._session.run(None, {"images": images.contiguous().numpy()})[0])


def as_flown(network: Network) -> Network:
    """A copy of a network whose layers, each `Sequential` that it has, ONNX Runtime runs: the same but for rounding.

    Args:
        network: on the CPU.
    """
    flown = copy.deepcopy(network).eval()
    for name, layers in network.named_children():
        if isinstance(layers, nn.Sequential):
            setattr(flown, name, Flown(layers))
    return flown
