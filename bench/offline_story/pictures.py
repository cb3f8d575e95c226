"""The images of docs/results/offline.md: time in the band as flown, and success while learning."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
from tensorboard.backend.event_processing.event_file_loader import EventFileLoader

from common.intervals import Interval

_COLOURS = ("#9a9a9a", "#e69f00", "#0072b2", "#009e73")
_SUCCESS = "Environment/Success Rate"


def draw_bands(
    path: Path,
    figures: Mapping[tuple[str, str], Interval],
    titles: Mapping[str, str],
    conditions: Sequence[str],
) -> None:
    """Bars of the time in the band, with 95 % intervals.

    Args:
        path: of the PNG.
        figures: by pilot and condition.
        titles: of the pilots.
        conditions: in their order.
    """
    figure, axes = plt.subplots(figsize=(7.6, 3.2), layout="constrained")
    rows = len(titles) + 1
    for k, condition in enumerate(conditions):
        for j, (name, title) in enumerate(titles.items()):
            value = figures[name, condition]
            axes.barh(
                rows * k + j, 100 * value.value, color=_COLOURS[j], label=title if k == 0 else None,
                xerr=[[100 * (value.value - value.low)], [100 * (value.high - value.value)]], capsize=3,
            )  # fmt: skip
    axes.set_yticks([rows * k + 1.5 for k in range(len(conditions))], list(conditions))
    axes.invert_yaxis()
    axes.set_xlim(0.0, 100.0)
    axes.set_xlabel("time within 1 to 3 m of the owner [%], 95 % intervals over flights")
    axes.grid(axis="x", alpha=0.3)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.28), ncols=2, frameon=False)
    _save(figure, path)


def draw_curves(path: Path, runs: Path, mixes: Mapping[str, str], trainers: Sequence[str]) -> None:
    """Success of each evaluation, one panel for each mix of pilots.

    Args:
        path: of the PNG.
        runs: folder of the runs.
        mixes: what is learnt from, by what the names of its runs begin with.
        trainers: names of the runs of the first mix.
    """
    figure, panels = plt.subplots(1, len(mixes), figsize=(7.6, 2.8), sharey=True, layout="constrained")
    for axes, (mix, words) in zip(panels, mixes.items(), strict=True):
        for colour, trainer in zip(_COLOURS, trainers, strict=True):
            points = _points(runs / f"{mix}{trainer}" / "FollowMe")
            steps, success = zip(*sorted(points.items()), strict=True)
            axes.plot(steps, [100 * value for value in success], ".-", color=colour, label=trainer)
        axes.set_title(f"flights {words}", fontsize=10)
        axes.set_xlabel("gradient steps")
        axes.grid(alpha=0.3)
    panels[0].set_ylabel("success in batch [%]")
    panels[0].set_ylim(0.0, 100.0)
    panels[-1].legend(frameon=False)
    _save(figure, path)


def _points(folder: Path) -> dict[int, float]:
    """Success by gradient steps."""
    events = [event for file in sorted(folder.glob("events.*")) for event in EventFileLoader(str(file)).Load()]
    return {
        event.step: float(value.tensor.float_val[0] if value.HasField("tensor") else value.simple_value)
        for event in events
        for value in event.summary.value
        if value.tag == _SUCCESS
    }


def _save(figure: "mpl.figure.Figure", path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    plt.close(figure)
