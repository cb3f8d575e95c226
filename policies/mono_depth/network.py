"""Monocular depth: an image's colours in, how far away each part of it is out, and whether that is of somebody.

It is trained on images alone, by no policy and with no reward. Blocks of two by two pixels have one depth, the nearest
in them, as a distribution over bins of the depth channel's bytes: of the edge of a trunk half is trunk and half is what
stands behind it, and no mean of both is there. How high the camera is, and how it leans, sets the scale.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from common.attitude import Vector, inverse, rotated
from policies.image_layers import as_flown, conv_block, load_weights
from policies.tasks.follow_me.observe import DEPTH_HALF_M, HFOV_DEG, IMAGE_SIZE, camera_mount

BINS = 32
BIN_BYTES = 8  # of the depth channel
BLOCK = 2  # pixels
BLOCKS = IMAGE_SIZE // BLOCK
WEIGHTS = Path(__file__).parent / "weights.pt"
_QUANTILE = 0.4  # nearer than the median: what may be there is taken to be there


@dataclass(frozen=True, slots=True)
class SeenDepth:
    """What an image's colours say; each of shape (IMAGE_SIZE, IMAGE_SIZE)."""

    depth: NDArray[np.uint8]
    """As a depth camera's channel; 255: far."""
    is_person: NDArray[np.bool_]


class DepthNetwork(nn.Module):
    """Colours (n, height, width, 3) and flat ground (n, height, width) in; logits (n, BINS + 1, BLOCKS, BLOCKS) out.

    The last logit is of a person. A U-Net (Ronneberger et al. 2015) of four scales.
    """

    def __init__(self) -> None:
        super().__init__()
        self.halves = conv_block(4, 24, stride=2, size=5)
        self.quarters = nn.Sequential(conv_block(24, 40, stride=2), conv_block(40, 40))
        self.eighths = nn.Sequential(conv_block(40, 64, stride=2), conv_block(64, 64), conv_block(64, 64, dilation=2))
        self.narrow = nn.Sequential(conv_block(64, 64), conv_block(64, 32, size=1), _doubled())
        self.up_quarters = nn.Sequential(conv_block(72, 40), conv_block(40, 24, size=1), _doubled())
        self.up_halves = nn.Sequential(conv_block(48, 32), nn.Conv2d(32, BINS + 1, 1))

    def forward(self, colours: Tensor, ground: Tensor) -> Tensor:
        levels = colours.permute(0, 3, 1, 2).float()
        levels = levels - levels.mean(dim=(1, 2, 3), keepdim=True)
        levels = levels / (levels.std(dim=(1, 2, 3), keepdim=True) + 1.0)
        halves = self.halves(torch.cat((levels, ground[:, None]), dim=1))
        quarters = self.quarters(halves)
        wide = self.narrow(self.eighths(quarters))
        wide = self.up_quarters(torch.cat((wide, quarters), dim=1))
        out: Tensor = self.up_halves(torch.cat((wide, halves), dim=1))
        return out


def _doubled() -> nn.Upsample:
    return nn.Upsample(scale_factor=2, mode="nearest")


class MonoDepth:
    """The network as it flies: one image at a time.

    Args:
        network: trained; None: the one that ships.
    """

    def __init__(self, network: DepthNetwork | None = None) -> None:
        self._network = as_flown(network or shipped())

    def see(self, pixels: NDArray[np.uint8], down_frd: Vector, height_m: float) -> SeenDepth:
        """How far away everything in an image is.

        Args:
            pixels: of the policy's camera, (height, width, 3 or 4).
            down_frd: the unit vector down in the body frame.
            height_m: of the lens above the ground; NaN: not known.
        """
        down_rdf = rotated(inverse(camera_mount()), down_frd)
        with torch.inference_mode():
            ground = flat_ground(
                torch.tensor([down_rdf], dtype=torch.float32), torch.tensor([height_m], dtype=torch.float32)
            )
            logits = self._network(torch.tensor(pixels[None, ..., :3]), ground)[0].numpy()
        return SeenDepth(_full(quantile_byte(logits[:BINS])), _full(logits[BINS] > 0.0))


def flat_ground(down_rdf: Tensor, height_m: Tensor) -> Tensor:
    """Where level ground would be seen: 0 at the lens, 1/2 at 4 m, 1 from the horizon up, and if no height is known.

    Args:
        down_rdf: unit vectors down in the camera frame, (n, 3).
        height_m: of the lens above the ground, (n,); NaN: not known.
    """
    half = float(np.tan(np.radians(0.5 * HFOV_DEG)))
    steps = (torch.arange(IMAGE_SIZE, device=down_rdf.device) + 0.5 - 0.5 * IMAGE_SIZE) * (2.0 * half / IMAGE_SIZE)
    right, down, ahead = down_rdf.T[:, :, None, None]
    sinks = right * steps[None, None, :] + down * steps[None, :, None] + ahead  # of a ray of depth 1
    height = height_m[:, None, None]
    is_ground = (sinks > 0.0) & torch.isfinite(height)
    shown = height / (height + float(DEPTH_HALF_M) * torch.where(is_ground, sinks, 1.0))
    return torch.where(is_ground, shown, 1.0)


def quantile_byte(logits: NDArray[np.float32], quantile: float = _QUANTILE) -> NDArray[np.uint8]:
    """The byte of depth below which so much of the probability lies, of shape (BINS, …) without its first axis."""
    reached = np.exp(logits - logits.max(0))
    reached /= reached.sum(0)
    for k in range(1, len(reached)):  # np.cumsum along the first axis takes several times as long
        reached[k] += reached[k - 1]
    at = np.argmax(reached >= quantile, 0)
    before = np.take_along_axis(reached, np.maximum(at - 1, 0)[None], 0)[0] * (at > 0)
    within = np.take_along_axis(reached, at[None], 0)[0] - before
    byte = BIN_BYTES * (at + (quantile - before) / np.maximum(within, 1e-6))
    return np.where(at == BINS - 1, 255, np.floor(byte)).astype(np.uint8)


def _full(blocks: NDArray[Any]) -> NDArray[Any]:
    return blocks.repeat(BLOCK, 0).repeat(BLOCK, 1)


def shipped() -> DepthNetwork:
    """The network that ships."""
    network = DepthNetwork()
    load_weights(network, WEIGHTS)
    return network
