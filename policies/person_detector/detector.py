"""The person detector: a image in, people out, each with a probability, a direction and a range.

It is trained on images alone, by no policy and with no reward, and knows nothing of what a policy believes. A cell of
its map of 16 x 16 is a person if the middle of somebody's chest is in it.
"""

from dataclasses import dataclass
from math import dist, exp, log, sqrt
from pathlib import Path
from typing import cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from common.attitude import Vector, levelled, rotated
from policies.image_layers import as_flown, conv_block, load_weights
from policies.tasks.follow_me.observe import HFOV_DEG, LENS_FRD, camera_mount, depth_of

CELLS = 16  # of the map, in rows and columns
STRIDE = 4  # pixels of a cell
RANGE_M = (0.4, 16.0)  # that it tells apart
SURE = 0.7  # probability from which its word counts, in flight and where it is judged
_NO_RETURN = 255.0
_APART = 2  # cells between two people
_AGREES = (-0.9, 0.45)  # by how much depth may differ from the range by colours, in logarithms
_SAME_BODY = 0.15  # likewise, of pixels of one body
_BODY_PX = (8, 4)  # to either side of a chest, where its body is looked for
_COLOURS_SHORT = 1.12  # by which ranges by colours alone are too short; measured in flights
_HALF_BODY_M = 0.09  # from the skin to the middle; measured in flights
_ONE_BODY_M = 0.4  # two chests are farther apart than this, level
_CHEST_M = (0.3, 0.3, 0.4)  # aside, up and down of its middle: nearly all of the body there is shirt
_COLOURS_WITHIN_M = 6.0  # farther off, too few pixels are of nothing else
_DARK = 0.2  # of the image's brightness: darker than this, a colour is noise
WEIGHTS = Path(__file__).parent / "weights.pt"
LOW_WEIGHTS = Path(__file__).parent / "weights-low.pt"  # of cameras near the ground: rovers'
_HALF_WIDTH = np.tan(np.radians(0.5 * HFOV_DEG))


@dataclass(frozen=True, slots=True)
class Detection:
    """Somebody in a image."""

    probability: float
    """That somebody is there: calibrated on worlds that it was not trained in."""
    chest_hfrd: Vector
    """[m] The middle of their chest from the vehicle: ahead, right, down; level."""
    pixel: tuple[float, float]
    """Column and row of it."""
    has_depth: bool = True
    """The range is of depth; else of how large they look."""
    colours: NDArray[np.float64] | None = None
    """Of their chest: logarithms of red and blue over green, and of brightness over the image's; None: too far off."""


class DetectorNetwork(nn.Module):
    """Images (n, height, width, 4) in; logits of a chest, log ranges, logits of any limb out, (n, CELLS, CELLS)."""

    def __init__(self) -> None:
        super().__init__()
        self.layers = nn.Sequential(
            *conv_block(5, 24, stride=2, size=5),
            *conv_block(24, 32, stride=2),
            *conv_block(32, 48),
            *conv_block(48, 48, dilation=2),
            *conv_block(48, 48, dilation=4),
            *conv_block(48, 48),
            nn.Conv2d(48, 3, 1),
        )
        self.register_buffer("calibration", torch.tensor([1.0, 0.0]))  # of logits: factor and offset

    def forward(self, images: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        levels = images.permute(0, 3, 1, 2).float()
        colours, depth = levels[:, :3], levels[:, 3:]
        colours = colours - colours.mean(dim=(1, 2, 3), keepdim=True)
        colours = colours / (colours.std(dim=(1, 2, 3), keepdim=True) + 1.0)
        is_return = (depth < _NO_RETURN).float()
        out = self.layers(torch.cat((colours, is_return * depth * (2.0 / 255.0), is_return), dim=1))
        factor, offset = cast(Tensor, self.calibration)
        return factor * out[:, 0] + offset, out[:, 1], out[:, 2]


class PersonDetector:
    """The detector as it flies: one image at a time.

    Args:
        network: trained; None: the one that ships.
        least: probability below which nobody is reported.
    """

    def __init__(self, network: DetectorNetwork | None = None, least: float = 0.2) -> None:
        torch.set_num_threads(1)  # one small image: more threads only wait for each other
        self._network = as_flown(network or shipped())
        self._least = log(least / (1.0 - least))

    def find(self, pixels: NDArray[np.uint8], down_frd: tuple[float, float]) -> list[Detection]:
        """Who is in a image, the most probable first.

        Args:
            pixels: of the policy's camera, (height, width, 4).
            down_frd: the first two elements of the unit vector down in the body frame: how the vehicle leans.
        """
        with torch.inference_mode():
            logits, log_ranges, _ = self._network(torch.tensor(pixels)[None])
        scores = logits[0].numpy()
        ranges = log_ranges[0].exp().numpy()
        found = []
        for row, column in peaks(scores, self._least):
            guess_m = float(np.clip(ranges[row, column], *RANGE_M))
            range_m = _checked_range(guess_m, pixels[..., 3], row, column)
            if range_m is None:
                continue
            at = _middle(scores, row, column)
            if range_m != guess_m:  # depth has shown it
                at, range_m = _on_body(pixels[..., 3], range_m, at)
                range_m += _HALF_BODY_M
            else:
                range_m *= _COLOURS_SHORT
            chest = _chest_hfrd(at, range_m, pixels.shape[1], down_frd)
            probability = 1.0 / (1.0 + exp(-float(scores[row, column])))
            has_depth = range_m != guess_m * _COLOURS_SHORT
            found.append(Detection(probability, chest, at, has_depth, _chest_colours(pixels, at, range_m)))
        return _bodies(sorted(found, key=lambda detection: -detection.probability))


def peaks(scores: NDArray[np.float32], least: float) -> list[tuple[int, int]]:
    """Row and column of cells that score at least so much, and than which none within two cells scores more."""
    found = []
    for row, column in np.argwhere(scores >= least).tolist():
        beside = scores[max(row - _APART, 0) : row + _APART + 1, max(column - _APART, 0) : column + _APART + 1]
        if scores[row, column] >= beside.max():
            found.append((row, column))
    return found


def _bodies(found: list[Detection]) -> list[Detection]:
    """Those without what is of the body of one before: who is near is wider than two cells."""
    kept: list[Detection] = []
    for one in found:
        if all(dist(one.chest_hfrd[:2], other.chest_hfrd[:2]) > _ONE_BODY_M for other in kept):
            kept.append(one)
    return kept


def _checked_range(range_m: float, depth: NDArray[np.uint8], row: int, column: int) -> float | None:
    """The range that depth shows, if it agrees with what the colours say; None: it does not, and nobody is there.

    Of what agrees the nearest: round a body there is ground, and nobody is to be thought farther off than they are.
    """
    first_row, first_column = STRIDE * row, STRIDE * column
    byte = depth[first_row : first_row + STRIDE, first_column : first_column + STRIDE].astype(np.float64)
    returns = byte[byte < _NO_RETURN]
    if len(returns) < STRIDE:
        return range_m
    shown_m = depth_of(returns) * _ray_m((first_column + 0.5 * STRIDE, first_row + 0.5 * STRIDE), depth.shape[1])
    off = np.log(shown_m / range_m)
    agrees = (off > _AGREES[0]) & (off < _AGREES[1])
    return float(shown_m[agrees].min()) if agrees.any() else None


def _middle(scores: NDArray[np.float32], row: int, column: int) -> tuple[float, float]:
    """Column and row of pixels of a peak, finer than cells: the mean of those round it, by their probabilities."""
    rows, columns = slice(max(row - 1, 0), row + 2), slice(max(column - 1, 0), column + 2)
    weights = 1.0 / (1.0 + np.exp(-scores[rows, columns].astype(np.float64)))
    at_row, at_column = np.mgrid[rows, columns][:, : weights.shape[0], : weights.shape[1]]
    total = weights.sum()
    return (
        STRIDE * (float((weights * at_column).sum() / total) + 0.5),
        STRIDE * (float((weights * at_row).sum() / total) + 0.5),
    )


def _shown_m(depth: NDArray[np.uint8]) -> NDArray[np.float64]:
    """What bytes of the depth channel stand for [m]; inf: no return."""
    byte = depth.astype(np.float64)
    return np.where(byte < _NO_RETURN, depth_of(np.minimum(byte, _NO_RETURN - 1.0)), np.inf)


def _on_body(depth: NDArray[np.uint8], range_m: float, at: tuple[float, float]) -> tuple[tuple[float, float], float]:
    """Where the body that depth shows about a pixel has its middle, and its range: of all pixels of that depth."""
    column, row = round(at[0]), round(at[1])
    columns = slice(max(column - _BODY_PX[0], 0), column + _BODY_PX[0])
    rows = slice(max(row - _BODY_PX[1], 0), row + _BODY_PX[1])
    shown_m = _shown_m(depth[rows, columns])
    is_body = np.abs(np.log(shown_m / (range_m / _ray_m(at, depth.shape[1])))) < _SAME_BODY
    if is_body.sum() < STRIDE:
        return at, range_m
    aside = columns.start + 0.5 + float(np.nonzero(is_body)[1].mean())
    return (aside, at[1]), float(np.median(shown_m[is_body])) * _ray_m((aside, at[1]), depth.shape[1])


def _ray_m(at: tuple[float, float], width: int) -> float:
    """How long the ray of a pixel is, of depth 1 along the optical axis."""
    steps = (np.array(at) - 0.5 * width) * (2.0 * _HALF_WIDTH / width)
    return sqrt(1.0 + float(steps @ steps))


def _chest_hfrd(at: tuple[float, float], range_m: float, width: int, down_frd: tuple[float, float]) -> Vector:
    """The place that a pixel and a range show, from the vehicle's middle, level."""
    per_pixel = 2.0 * float(_HALF_WIDTH) / width
    ray = np.array([(at[0] - 0.5 * width) * per_pixel, (at[1] - 0.5 * width) * per_pixel, 1.0])
    ray *= range_m / np.linalg.norm(ray)
    at_lens = rotated(camera_mount(), ray.tolist())
    return levelled([a + b for a, b in zip(at_lens, LENS_FRD, strict=True)], down_frd)


def _chest_colours(pixels: NDArray[np.uint8], at: tuple[float, float], range_m: float) -> NDArray[np.float64] | None:
    """What their chest looks like: of the middle one of each colour of the pixels there that are as far off."""
    if range_m > _COLOURS_WITHIN_M:
        return None
    width = pixels.shape[1]
    per_m = 0.5 * width / (_HALF_WIDTH * range_m)
    aside, up, down = (max(m * per_m, 1.0) for m in _CHEST_M)
    columns = slice(max(round(at[0] - aside), 0), round(at[0] + aside))
    rows = slice(max(round(at[1] - up), 0), round(at[1] + down))
    skin_m = (range_m - _HALF_BODY_M) / _ray_m(at, width)
    is_body = np.abs(np.log(_shown_m(pixels[rows, columns, 3]) / skin_m)) < _SAME_BODY
    chest = pixels[rows, columns, :3][is_body]
    if len(chest) == 0:
        return None
    brightness = float(pixels[..., :3].mean()) + 1.0
    red, green, blue = np.log(np.median(chest, axis=0) / brightness + _DARK)
    return np.array([red - green, blue - green, (red + green + blue) / 3.0])


def shipped(weights: Path = WEIGHTS) -> DetectorNetwork:
    """A network that ships."""
    network = DetectorNetwork()
    load_weights(network, weights)
    return network
