"""Encoders of images, `vis_encode_type`: bytes in, features out. All but `compact` are ML-Agents', layer by layer.

Layers are those of the exported network too (`policies/learn/export/onnx_export.py`). Images are bytes with channels
last, and are only made floats of 0 to 1 here.
"""

import math
from collections.abc import Iterator, Mapping

import torch
from torch import Tensor, nn

from policies.learn.config.network import Encoder
from policies.learn.networks.dense_layers import dense

DENSE_GAIN = 1.41  # of dense layers behind convolutions, ML-Agents' number
LEAST_SIDES: Mapping[Encoder, int] = {  # [px], of either side
    "simple": 20,
    "nature_cnn": 36,
    "resnet": 15,
    "match3": 5,
    "fully_connected": 1,
    "compact": 29,
}
_Convolution = tuple[int, int, int]  # channels, kernel, stride
_CONVOLUTIONS: Mapping[Encoder, tuple[_Convolution, ...]] = {
    "simple": ((16, 8, 4), (32, 4, 2)),
    "nature_cnn": ((32, 8, 4), (64, 4, 2), (64, 3, 1)),
    "match3": ((35, 3, 1), (144, 3, 1)),
    "fully_connected": (),
    "compact": ((16, 5, 4), (32, 3, 2), (32, 3, 2)),
}
_RESNET_CHANNELS = (16, 32, 32)  # of its stacks
_RESNET_BLOCKS = 2  # in each stack


class ImageEncoder(nn.Module):
    """Features of images."""

    def __init__(self, kind: Encoder, shape: tuple[int, int, int], outputs: int, generator: torch.Generator) -> None:
        """An encoder with weights drawn from `generator`.

        Args:
            kind: which one.
            shape: height, width, channels; sides of at least `LEAST_SIDES`.
            outputs: features.
            generator: on the CPU.
        """
        super().__init__()
        height, width, channels = shape
        layers = _resnet(channels, generator) if kind == "resnet" else _plain(kind, channels, generator)
        self.layers = nn.Sequential(*layers, nn.Flatten())
        with torch.no_grad():
            flat = self.layers(torch.zeros(1, channels, height, width)).shape[1]
        self.layers.append(dense(flat, outputs, generator, gain=DENSE_GAIN))
        self.layers.append(nn.ReLU() if kind == "resnet" else nn.LeakyReLU())

    def forward(self, images: Tensor) -> Tensor:
        """Of bytes (..., height, width, channels), shape (..., features)."""
        rows = (
            images.flatten(0, -4).permute(0, 3, 1, 2).float().mul_(1.0 / 255.0)
        )  # one product takes three times as long
        features: Tensor = self.layers(rows)
        return features.view(*images.shape[:-3], features.shape[-1])


class Residual(nn.Module):
    """What comes in plus what two convolutions make of it."""

    def __init__(self, channels: int, generator: torch.Generator) -> None:
        super().__init__()
        first, second = (_convolution(channels, channels, 3, 1, generator, padding=1) for _ in range(2))
        self.layers = nn.Sequential(nn.SiLU(), first, nn.SiLU(), second)

    def forward(self, inputs: Tensor) -> Tensor:
        outputs: Tensor = inputs + self.layers(inputs)
        return outputs


def _plain(kind: Encoder, channels: int, generator: torch.Generator) -> Iterator[nn.Module]:
    for outputs, kernel, stride in _CONVOLUTIONS[kind]:
        yield _convolution(channels, outputs, kernel, stride, generator)
        yield nn.LeakyReLU()
        channels = outputs


def _resnet(channels: int, generator: torch.Generator) -> Iterator[nn.Module]:
    """IMPALA's (Espeholt et al. 2018, arXiv 1802.01561, figure 3, right), with swish."""
    for outputs in _RESNET_CHANNELS:
        yield _convolution(channels, outputs, 3, 1, generator, padding=1)
        yield nn.MaxPool2d(3, 2)
        for _ in range(_RESNET_BLOCKS):
            yield Residual(outputs, generator)
        channels = outputs
    yield nn.SiLU()


def _convolution(
    inputs: int, outputs: int, kernel: int, stride: int, generator: torch.Generator, padding: int = 0
) -> nn.Conv2d:
    """A convolution with torch's own initialisation, drawn from the generator."""
    layer: nn.Conv2d = nn.utils.skip_init(nn.Conv2d, inputs, outputs, kernel, stride, padding)  # type: ignore[no-untyped-call]
    bound = 1.0 / math.sqrt(inputs * kernel * kernel)
    for weights in layer.parameters():
        nn.init.uniform_(weights, -bound, bound, generator=generator)
    layer.weight.data = layer.weight.data.contiguous(memory_format=torch.channels_last)  # as images come
    return layer
