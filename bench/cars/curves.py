"""Training curves of the experiments, as PNG."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from bench.cars.result import Point

COLOURS = ("#26659f", "#c43d34", "#3a8c52", "#b8860b", "#7b4fa3", "#5c5a55")
_GRID = 200  # points each curve is drawn at


class Trained(Protocol):
    """A run with a curve."""

    @property
    def curve(self) -> Sequence[Point]: ...


def draw(
    path: Path, title: str, runs: Mapping[str, Sequence[Trained]], *, value: str, over: str, log_x: bool = False
) -> None:
    """Writes one figure: per label the mean over seeds, and every seed faintly behind it.

    Args:
        path: of the PNG.
        title: its heading.
        runs: results by label, one per seed.
        value: `success` or `reward`.
        over: `steps` or `wall_s`.
        log_x: whether the horizontal axis is logarithmic.
    """
    figure, axes = plt.subplots(figsize=(7.2, 4.0), dpi=110)
    for colour, (label, results) in zip(COLOURS * 3, runs.items(), strict=False):
        sampled = [_sampled(result, value, over) for result in results if result.curve]
        for x, y in sampled:
            axes.plot(x, y, color=colour, linewidth=0.8, alpha=0.35)
        if not sampled:
            continue
        end = min(x[-1] for x, _ in sampled)
        start = max(x[0] for x, _ in sampled)
        grid = np.linspace(start, end, _GRID)
        axes.plot(
            grid, np.mean([np.interp(grid, x, y) for x, y in sampled], axis=0), color=colour, linewidth=2.0, label=label
        )
    axes.set_title(title, fontsize=11, loc="left")
    axes.set_xlabel({"steps": "decisions of all environments", "wall_s": "time of training [s]"}[over])
    axes.set_ylabel({"success": "successful episodes while training", "reward": "mean episode reward"}[value])
    if value == "success":
        axes.set_ylim(-0.02, 1.02)
    if log_x:
        axes.set_xscale("log")
    axes.grid(alpha=0.25)
    axes.legend(frameon=False, fontsize=9)
    axes.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
    plt.close(figure)


def _sampled(result: Trained, value: str, over: str) -> tuple[np.ndarray, np.ndarray]:
    points = result.curve
    x = np.array([getattr(point, over) for point in points], dtype=float)
    y = np.array([getattr(point, value) for point in points], dtype=float)
    width = max(1, len(y) // 60)  # a running mean over a sixtieth of the run
    kernel = np.ones(width) / width
    padded = np.concatenate([np.full(width - 1, y[0]), y])
    return x, np.convolve(padded, kernel, mode="valid")
