"""The images of a story's page: what was measured of flights, and success while learning."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.patches import Patch
from tensorboard.backend.event_processing.event_file_loader import EventFileLoader

from bench.offline_story.story import Measure
from common.intervals import Interval

_COLOURS = ("#9a9a9a", "#e69f00", "#0072b2", "#009e73")
_SUCCESS = "Environment/Success Rate"


def draw_bars(
    path: Path,
    measures: Mapping[Measure, Mapping[tuple[str, str], Interval]],
    titles: Mapping[str, str],
    conditions: Sequence[str],
    flights: str,
) -> None:
    """Bars of what is measured, a panel each, with 95 % intervals.

    Args:
        path: of the PNG.
        measures: figures by pilot and condition.
        titles: of the pilots.
        conditions: in their order.
        flights: what they are called.
    """
    figure, panels = plt.subplots(
        1, len(measures), figsize=(7.6, 3.2), sharey=True, layout="constrained", squeeze=False
    )
    rows = len(titles) + 1
    for axes, (measure, figures) in zip(panels[0], measures.items(), strict=True):
        scale = 100.0 if measure.unit == "%" else 1.0
        for k, condition in enumerate(conditions):
            for j, name in enumerate(titles):
                value = figures[name, condition]
                axes.barh(
                    rows * k + j, scale * value.value, color=_COLOURS[j],
                    xerr=[[scale * (value.value - value.low)], [scale * (value.high - value.value)]], capsize=3,
                )  # fmt: skip
        axes.set_xlim(0.0, 100.0 if measure.unit == "%" else None)
        axes.set_xlabel(f"{measure.title} [{measure.unit}]")
        axes.grid(axis="x", alpha=0.3)
    first = panels[0][0]
    first.set_yticks([rows * k + 0.5 * (len(titles) - 1) for k in range(len(conditions))], list(conditions))
    first.invert_yaxis()
    named = [Patch(color=colour, label=title) for colour, title in zip(_COLOURS, titles.values(), strict=True)]
    figure.legend(handles=named, loc="outside upper center", ncols=2, frameon=False)
    figure.supxlabel(f"95 % intervals over {flights}", fontsize=9)
    _save(figure, path)


def draw_curves(path: Path, runs: Path, task: str, mixes: Mapping[str, str], trainers: Sequence[str]) -> None:
    """Success of each evaluation, one panel for each mix of pilots.

    Args:
        path: of the PNG.
        runs: folder of the runs.
        task: what they learn.
        mixes: what is learnt from, by what the names of its runs begin with.
        trainers: names of the runs of the first mix.
    """
    figure, panels = plt.subplots(1, len(mixes), figsize=(7.6, 2.8), sharey=True, layout="constrained")
    for axes, (mix, words) in zip(panels, mixes.items(), strict=True):
        for colour, trainer in zip(_COLOURS, trainers, strict=True):
            points = _points(runs / f"{mix}{trainer}" / task)
            steps, success = zip(*sorted(points.items()), strict=True)
            axes.plot(steps, [100 * value for value in success], ".-", color=colour, label=trainer)
        axes.set_title(words, fontsize=10)
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
