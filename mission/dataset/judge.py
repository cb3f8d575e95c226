"""`honeyguide dataset judge`: what policies would return, from recorded decisions alone; a table, JSON, an image."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from common.files import write_whole
from common.intervals import Interval
from mission.console.terminal import print_line
from mission.dataset.show import write_figure
from policies.datasets.episodes import DatasetError
from policies.offline.evaluation.datasets import Judged, judged

_DECIMALS = 3
_BINS = 24
_VALUES_LEAST = 3  # of an element that an image is drawn over: two are a flag


@dataclass(frozen=True, slots=True)
class JudgeOptions:
    """What the command is given."""

    datasets: tuple[Path, ...]
    policies: tuple[str, ...]
    gamma: float | None
    width: float
    clip: float
    steps: int
    seed: int
    image: Path | None
    json_file: Path | None


def judge_policies(options: JudgeOptions, console: Console) -> None:
    """Judges, prints and writes.

    Raises:
        DatasetError: a dataset or a policy that cannot be judged, or a file that cannot be written.
        LayoutError: a policy of another task.
    """
    others = {"width": options.width, "clip": options.clip, "steps": options.steps, "seed": options.seed}
    found = []
    for each in judged([str(path) for path in options.datasets], options.policies, options.gamma, others):
        found.append(each)
        print_line(console, f"judged: {each.name}")
    table = Table("policy", "fitted Q", "per decision", "weighted", "doubly robust", "episodes", "outside")
    for each in found:
        verdict = each.verdict
        figures = (verdict.fitted_q, verdict.per_decision, verdict.importance, verdict.robust)
        counts = f"{verdict.effective_episodes:.1f}", f"{100 * verdict.outside_fraction:.1f} %"
        table.add_row(each.name, *(_words(figure) for figure in figures), *counts)
    console.print(table)
    print_line(
        console,
        f"discounted returns and 95 %; weighted ones are of a Gaussian of width {options.width:g} around the policy, "
        f"weights are clipped at {options.clip:g}; episodes: effective ones; outside: decisions off the data",
    )
    if options.json_file is not None:
        try:
            write_whole(options.json_file, json.dumps([_record(each) for each in found], indent=1).encode())
        except OSError as error:
            raise DatasetError(f"{options.json_file}: cannot be written: {error.strerror or error}") from error
    if options.image is not None:
        draw(found, options.image)
        print_line(console, f"where they leave the data: {options.image}")


def _words(figure: Interval) -> str:
    return f"{figure.value:.{_DECIMALS}f}\n{figure.low:.{_DECIMALS}f} to {figure.high:.{_DECIMALS}f}"


def _record(each: Judged) -> dict[str, Any]:
    verdict = each.verdict
    names = ("fitted_q", "per_decision", "importance", "robust")
    figures = {name: getattr(verdict, name) for name in names}
    record: dict[str, Any] = {"policy": each.name}
    for name, figure in figures.items():
        record[name] = {"value": figure.value, "low": figure.low, "high": figure.high}
    return record | {"effective_episodes": verdict.effective_episodes, "outside": verdict.outside_fraction}


def draw(found: list[Judged], target: Path) -> None:
    """Of each policy: where in the two elements that tell most it leaves the data, and how far.

    Raises:
        DatasetError: the file cannot be written.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(len(found), 2, figsize=(8.0, 2.8 * len(found)), squeeze=False, layout="constrained")
    for (area, histogram), each in zip(axes, found, strict=True):
        x, y = _telling(each)
        seen = each.observations
        drawn = area.hexbin(
            seen[:, x], seen[:, y], C=each.outside, gridsize=_BINS, reduce_C_function=np.mean, vmin=0.0, vmax=1.0,
            cmap="viridis",
        )  # fmt: skip
        figure.colorbar(drawn, ax=area, label="fraction outside")
        area.set_xlabel(each.elements[x])
        area.set_ylabel(each.elements[y])
        area.set_title(each.name, fontsize=9)
        histogram.hist(np.minimum(each.distances, 4.0 * each.limit), bins=60, color="#0072b2")
        histogram.axvline(each.limit, color="#d55e00")
        histogram.set_xlabel("deviations off the recorded actions")
        histogram.set_ylabel("decisions")
    write_figure(figure, target, 70)


def _telling(each: Judged) -> tuple[int, int]:
    """The two elements, no flags and not the same one of two frames, over whose deciles the distance varies most."""
    spread = []
    for column in each.observations.T:
        if len(np.unique(column)) < _VALUES_LEAST:
            spread.append(-1.0)
            continue
        deciles = np.array_split(each.distances[np.argsort(column, kind="stable")], 10)
        spread.append(float(np.std([part.mean() for part in deciles if len(part)])))
    first, *others = (int(k) for k in np.argsort(spread)[::-1])
    return first, next((k for k in others if each.elements[k] != each.elements[first]), first)
