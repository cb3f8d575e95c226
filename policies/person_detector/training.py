"""`python -m policies.person_detector.training`: trains the person detector from nothing and judges it on other worlds.

Images are rendered, labels come from the renderer; no policy, no flight, no reward. Focal loss (Lin et al. 2017) for
who is in which cell, an absolute error of the logarithm for how far away, then a line through the logits (Platt 1999)
that makes probabilities true on validation worlds. The judgement is on worlds of a further seed.
"""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from torch import Tensor
from torch.nn import functional

from common.intervals import rate
from policies.image_layers import save_weights
from policies.person_detector.detector import LOW_WEIGHTS, SURE, WEIGHTS, DetectorNetwork, PersonDetector, shipped
from policies.person_detector.scenes import HEIGHTS_M, Scenes, scenes

BATCH = 128
RATE = 2e-3
_FOCUS = 2.0
_RANGE_WEIGHT = 0.1
_LOW_M = (0.25, 0.6)  # lenses on a rover
Heights = tuple[float, float]  # of lenses above the ground [m]


def train(images: int, epochs: int, seed: int, console: Console, heights_m: Heights = HEIGHTS_M) -> DetectorNetwork:
    """A network trained on so many images, calibrated on others."""
    torch.manual_seed(seed)
    console.print(f"rendering {images} images")
    there = scenes(images, seed, heights_m=heights_m)
    network = DetectorNetwork()
    optimizer = torch.optim.AdamW(network.parameters(), lr=RATE, weight_decay=1e-4)
    steps = epochs * (len(there.images) // BATCH)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, RATE, total_steps=steps)
    order = np.random.default_rng(seed)
    for _ in track(range(steps), "training", console=console):
        rows = order.integers(len(there.images), size=BATCH)
        loss = _loss(network, there, rows, is_mirrored=bool(order.random() < 0.5))
        optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        optimizer.step()
        schedule.step()
    _calibrate(network.eval(), scenes(max(images // 10, 640), seed + 1000, heights_m=heights_m))
    return network


def _loss(network: DetectorNetwork, there: Scenes, rows: NDArray[np.int64], *, is_mirrored: bool) -> Tensor:
    images, cells = torch.from_numpy(there.images[rows]), torch.from_numpy(there.cells[rows])
    ranges_m = torch.from_numpy(there.ranges_m[rows])
    if is_mirrored:
        images, cells, ranges_m = images.flip(2), cells.flip(2), ranges_m.flip(2)
    logits, log_ranges, limb_logits = network(images)
    counts = cells != 2
    target = (cells == 1).float()
    plain = functional.binary_cross_entropy_with_logits(logits, target, reduction="none")
    weight = (1.0 - torch.exp(-plain)) ** _FOCUS
    is_there = cells == 1
    found = (weight * plain)[counts].sum() / max(int(is_there.sum()), 1)
    off = (log_ranges[is_there] - ranges_m[is_there].log()).abs().mean() if is_there.any() else log_ranges.sum() * 0.0
    limbs = functional.binary_cross_entropy_with_logits(limb_logits, (cells > 0).float())
    loss: Tensor = found + _RANGE_WEIGHT * off + limbs
    return loss


def _calibrate(network: DetectorNetwork, there: Scenes) -> None:
    """Sets the line at which the probability of the best cell tells how often somebody is there."""
    counts = there.has_person | there.is_empty
    best, truth = torch.from_numpy(_best_logits(network, there)[counts]), torch.from_numpy(there.has_person[counts])
    line = torch.tensor([1.0, 0.0], dtype=torch.float64, requires_grad=True)
    optimizer = torch.optim.LBFGS([line], max_iter=100)

    def surprise() -> Tensor:
        optimizer.zero_grad()
        loss = functional.binary_cross_entropy_with_logits(line[0] * best + line[1], truth.double())
        loss.backward()  # type: ignore[no-untyped-call]
        return loss

    optimizer.step(surprise)  # type: ignore[no-untyped-call]
    network.calibration.copy_(line.detach().float())  # type: ignore[operator]


def _best_logits(network: DetectorNetwork, there: Scenes) -> NDArray[np.float64]:
    with torch.inference_mode():
        parts = [network(torch.from_numpy(part))[0].amax(dim=(1, 2)) for part in np.array_split(there.images, 32)]
    return torch.cat(parts).double().numpy()


def judge(network: DetectorNetwork, there: Scenes) -> dict[str, Any]:
    """How often it sees who is there, and somebody where nobody is, as it flies; how true its probabilities are."""
    detector, counts = PersonDetector(network), there.has_person | there.is_empty
    seen, ghosts = (rate(is_sure(detector, there.images[rows])) for rows in (there.has_person, there.is_empty))
    probability = 1.0 / (1.0 + np.exp(-_best_logits(network, there)))
    bins = np.digitize(probability[counts], np.linspace(0.1, 0.9, 9))
    gaps = [
        (bins == k).mean() * abs(there.has_person[counts][bins == k].mean() - probability[counts][bins == k].mean())
        for k in range(10)
        if (bins == k).any()
    ]
    return {
        "seen": seen,
        "ghosts": ghosts,
        "calibration error": float(sum(gaps)),
        "range": _range_error(network, there),
    }


def is_sure(detector: PersonDetector, images: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Of each image, whether the detector is sure enough of somebody for its word to count in flight."""
    level = (0.0, 0.0)  # how it leans moves nobody in or out
    return np.array([any(found.probability >= SURE for found in detector.find(image, level)) for image in images])


def _range_error(network: DetectorNetwork, there: Scenes) -> float:
    """Median error of the range as a fraction of it, where somebody is."""
    with torch.inference_mode():
        parts = [network(torch.from_numpy(part))[1] for part in np.array_split(there.images, 32)]
    is_there = there.cells == 1
    ratio = torch.cat(parts).exp().numpy()[is_there] / there.ranges_m[is_there]
    return float(np.median(np.abs(ratio - 1.0)))


def main(
    images: Annotated[int, typer.Option(min=640)] = 24_000,
    epochs: Annotated[int, typer.Option(min=1)] = 14,
    seed: int = 1,
    out: Annotated[
        Path | None, typer.Option(help="Where the weights go; default: in the place of those that ship.")
    ] = None,
    judged: Annotated[bool, typer.Option("--judge", help="Train nothing: judge the one that ships.")] = False,
    low: Annotated[bool, typer.Option("--low", help="That of rovers: for lenses near the ground.")] = False,
) -> None:
    console = Console(highlight=False)
    heights_m, ships = (_LOW_M, LOW_WEIGHTS) if low else (HEIGHTS_M, WEIGHTS)
    network = shipped(ships).eval() if judged else train(images, epochs, seed, console, heights_m)
    if not judged:
        save_weights(network, out or ships)
    found = judge(network, scenes(6400, 7, is_test=True, heights_m=heights_m))
    for name, value in found.items():
        console.print(f"{name}: {value}")


if __name__ == "__main__":
    typer.run(main)
