"""`python -m policies.mono_depth.training`: trains monocular depth from nothing and judges it in other worlds.

Images are rendered, depths come from the renderer; no policy, no flight, no reward. Cross-entropy over the bins of
depth, to which trunks count more, since they are thin, and of whether somebody is there.
"""

from pathlib import Path
from typing import Annotated

import numpy as np
import torch
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from torch import Tensor
from torch.nn import functional

from common.intervals import rate
from policies.mono_depth.network import BIN_BYTES, BINS, WEIGHTS, DepthNetwork, quantile_byte, shipped
from policies.mono_depth.views import Views, views
from policies.tasks.follow_me.observe import depth_of

BATCH = 128
RATE = 2e-3
_TRUNK_WEIGHT = 3.0
_NEAR_M = 5.0  # trunks nearer than this have to be seen
_NEARER, _FARTHER = 0.7, 1.4  # of the true depth: how far off is right


def train(images: int, epochs: int, seed: int, console: Console) -> DepthNetwork:
    """A network trained on so many images."""
    torch.manual_seed(seed)
    console.print(f"rendering {images} images")
    there = views(images, seed)
    network = DepthNetwork()
    optimizer = torch.optim.AdamW(network.parameters(), lr=RATE, weight_decay=1e-4)
    steps = epochs * (len(there.colours) // BATCH)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, RATE, total_steps=steps)
    order = np.random.default_rng(seed)
    for _ in track(range(steps), "training", console=console):
        rows = order.integers(len(there.colours), size=BATCH)
        loss = _loss(network, there, rows, is_mirrored=bool(order.random() < 0.5))
        optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        optimizer.step()
        schedule.step()
    return network.eval()


def _loss(network: DepthNetwork, there: Views, rows: NDArray[np.int64], *, is_mirrored: bool) -> Tensor:
    parts = [torch.from_numpy(array[rows]) for array in (there.colours, there.ground, there.byte, there.is_person)]
    trunks = torch.from_numpy(there.is_trunk[rows])
    if is_mirrored:
        parts, trunks = [part.flip(2) for part in parts], trunks.flip(2)
    colours, ground, byte, is_person = parts
    logits = network(colours, ground)
    surprise = functional.cross_entropy(logits[:, :BINS], byte.long() // BIN_BYTES, reduction="none")
    weights = 1.0 + (_TRUNK_WEIGHT - 1.0) * trunks.float()
    somebody = functional.binary_cross_entropy_with_logits(logits[:, BINS], is_person.float())
    return (weights * surprise).sum() / weights.sum() + somebody


def judge(network: DepthNetwork, there: Views) -> dict[str, object]:
    """How often near trunks are seen, and something near where nothing is; how true depths are.

    A trunk is seen where a block of it has 0.7 to 1.4 of its depth, of blocks whose truth is nearer than 5 m; nothing
    is near where a block is farther than 1.4 times as far.
    """
    shown, somebody = [], []
    with torch.inference_mode():
        for rows in np.array_split(np.arange(len(there.colours)), max(len(there.colours) // BATCH, 1)):
            logits = network(torch.from_numpy(there.colours[rows]), torch.from_numpy(there.ground[rows])).numpy()
            shown.append(quantile_byte(logits[:, :BINS].swapaxes(0, 1)))
            somebody.append(logits[:, BINS] > 0.0)
    shown_m, true_m = (depth_of(np.minimum(x, 254).astype(np.float64)) for x in (np.concatenate(shown), there.byte))
    ratio = shown_m / true_m
    near = (true_m < _NEAR_M) & ~there.is_person
    trunk, far = near & there.is_trunk, (true_m > _NEAR_M * _FARTHER) & ~there.is_person
    is_person = np.concatenate(somebody)
    return {
        "near trunks seen": rate(((ratio > _NEARER) & (ratio < _FARTHER))[trunk]),
        "near trunks thought much farther": rate((ratio >= _FARTHER)[trunk]),
        "something near where nothing is": rate((shown_m < _NEAR_M)[far]),
        "median error, nearer than 5 m": float(np.median(np.abs(ratio[near] - 1.0))),
        "somebody seen": rate(is_person[there.is_person]),
        "somebody where nobody is": rate(is_person[~there.is_person]),
    }


def main(
    images: Annotated[int, typer.Option(min=640)] = 48_000,
    epochs: Annotated[int, typer.Option(min=1)] = 10,
    seed: int = 1,
    out: Path = WEIGHTS,
    judged: Annotated[bool, typer.Option("--judge", help="Train nothing: judge the one that ships.")] = False,
) -> None:
    console = Console(highlight=False)
    network = shipped().eval() if judged else train(images, epochs, seed, console)
    if not judged:
        torch.save({name: value.half() for name, value in network.state_dict().items()}, out)
    for name, value in judge(network, views(6400, 7, is_test=True)).items():
        console.print(f"{name}: {value}")


if __name__ == "__main__":
    typer.run(main)
