"""What the networks that look at images share: a layer of theirs, and their weights as files of half precision."""

from io import BytesIO
from pathlib import Path

import torch
from torch import nn

from common.files import write_whole


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
