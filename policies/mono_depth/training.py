"""`python -m policies.mono_depth.training`: trains monocular depth from nothing and judges it in other worlds.

Images are rendered, depths come from the renderer; no policy, no flight, no reward. Cross-entropy over the bins of
depth, to which trunks and people count more, since they are thin, and of whether somebody is there. The one that ships
was trained on a GPU, with `--device cuda --rounds 36`.
"""

from pathlib import Path
from typing import Annotated

import numpy as np
import torch
import typer
from rich.console import Console
from rich.progress import track
from torch import Tensor
from torch.nn import functional

from common.intervals import rate
from policies.image_layers import save_weights
from policies.mono_depth.network import BIN_BYTES, BINS, WEIGHTS, DepthNetwork, flat_ground, quantile_byte, shipped
from policies.mono_depth.views import Views, views
from policies.person_detector.scenes import WORLDS, Stage
from policies.tasks.follow_me.observe import depth_of

BATCH = 128
RATE = 2e-3
_WORLDS_ON_GPU = 2048
_THIN_WEIGHT = 3.0  # of trunks and people
_NEAR_M = 5.0  # trunks nearer than this have to be seen
_NEARER, _FARTHER = 0.7, 1.4  # of the true depth: how far off is right


def train(rounds: int, images: int, epochs: int, seed: int, device: str, console: Console) -> DepthNetwork:
    """A network trained on so many images in each of so many rounds, that many times over."""
    torch.manual_seed(seed)
    stage = Stage(seed, count=WORLDS if device == "cpu" else _WORLDS_ON_GPU, device=device)
    network = DepthNetwork().to(device)
    optimizer = torch.optim.AdamW(network.parameters(), lr=RATE, weight_decay=1e-4)
    steps = epochs * (images // BATCH)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, RATE, total_steps=rounds * steps)
    order = np.random.default_rng(seed)
    for _ in track(range(rounds), "training", console=console):
        there = _Tensors(views(stage, images), device)
        for _ in range(steps):
            rows = torch.from_numpy(order.integers(len(there.byte), size=BATCH)).to(device)
            loss = _loss(network, there, rows, is_mirrored=bool(order.random() < 0.5))
            optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            optimizer.step()
            schedule.step()
    return network.cpu().eval()


class _Tensors:
    """Images where the network is."""

    def __init__(self, there: Views, device: str) -> None:
        self.colours, self.byte, self.is_person, self.is_trunk = (
            torch.from_numpy(array).to(device) for array in (there.colours, there.byte, there.is_person, there.is_trunk)
        )
        self.ground = flat_ground(
            torch.from_numpy(there.down_rdf).to(device), torch.from_numpy(there.height_m).to(device)
        )


def _loss(network: DepthNetwork, there: _Tensors, rows: Tensor, *, is_mirrored: bool) -> Tensor:
    parts = [part[rows] for part in (there.colours, there.ground, there.byte, there.is_person, there.is_trunk)]
    colours, ground, byte, is_person, is_trunk = (part.flip(2) for part in parts) if is_mirrored else parts
    logits = network(colours, ground)
    surprise = functional.cross_entropy(logits[:, :BINS], byte.long() // BIN_BYTES, reduction="none")
    weights = 1.0 + (_THIN_WEIGHT - 1.0) * (is_trunk | is_person).float()
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
            held = flat_ground(torch.from_numpy(there.down_rdf[rows]), torch.from_numpy(there.height_m[rows]))
            logits = network(torch.from_numpy(there.colours[rows]), held).numpy()
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
    rounds: Annotated[int, typer.Option(min=1, help="Of images, each trained on and thrown away.")] = 6,
    images: Annotated[int, typer.Option(min=640, help="Of a round.")] = 16_384,
    epochs: Annotated[int, typer.Option(min=1, help="Of a round.")] = 4,
    seed: int = 1,
    device: Annotated[str, typer.Option(help="cpu or cuda.")] = "cpu",
    out: Path = WEIGHTS,
    judged: Annotated[bool, typer.Option("--judge", help="Train nothing: judge the one that ships.")] = False,
) -> None:
    console = Console(highlight=False)
    network = shipped().eval() if judged else train(rounds, images, epochs, seed, device, console)
    if not judged:
        save_weights(network, out)
    for name, value in judge(network, views(Stage(7, is_test=True), 6400)).items():
        console.print(f"{name}: {value}")


if __name__ == "__main__":
    typer.run(main)
