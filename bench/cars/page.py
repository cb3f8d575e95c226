"""Writes docs/results/cars.md and its images from the results of the runs."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from bench.cars import curves
from bench.cars.experiment import Experiment
from bench.cars.experiments import SECTIONS, Image, Section
from bench.cars.result import Result
from bench.cars.statistics import over_seeds
from common.files import write_whole
from common.intervals import wilson_interval

DOCS = Path(__file__).parent.parent.parent / "docs" / "results"
_COLUMNS = (
    *("run", "judged on", "document", "at least", "success", "95 %", "worst", "drawn"),
    *("seeds", "steps", "time", "steps/s"),
)
INTRODUCTION = """# The two car documents, trained anew

What 'Learning to Drive with Unity ML-Agents' and 'Park It Right!' report, and what the same tasks come to here. Its
tables and curves are made by one command, from nothing, which takes hours on two cores and goes on where it was when
stopped; what the remarks under them say of other runs, such as those tried in one seed, is of their day, and the
picture of failures is another command's:

```sh
make reproduce-cars
```

What comes of it stays in `results/cars/`, and the policies that ship are kept: with `ARGS="--publish"` the best of the
seeds take their place.

Each run is one process on one core, with another run on the other core beside it. Time is that of training, from the
first decision to the last update; compiling the kernels, once per machine, is not in it. It is wall clock, or, where it
says "CPU", time of the processor, of runs that had other work beside them. Success is that of the most probable
actions on held-out episodes: new places, new draws, {episodes} per run. "95 %" is the interval
of the mean over training seeds (Student's t); for one seed it is Wilson's over its episodes. "Worst" is the worst
seed. "Drawn" is the mean over seeds if actions are drawn, as ML-Agents' runtime does unless told otherwise.
Measured on {machine}.
"""


def write_page(results: Mapping[str, Sequence[Result]]) -> Path:
    """Writes the page and its images; experiments without results are named as such."""
    path = DOCS / "cars.md"
    DOCS.mkdir(parents=True, exist_ok=True)
    write_whole(path, page_text(results).encode())
    for section in SECTIONS:
        for image in section.images:
            if runs := _drawn(image, results):
                target = DOCS / "images" / f"{image.name}.png"
                curves.draw(target, image.title, runs, value=image.value, over=image.over)
    return path


def page_text(results: Mapping[str, Sequence[Result]]) -> str:
    """The page without its images."""
    every = [result for runs in results.values() for result in runs]
    machines = "; ".join(sorted({result.machine for result in every})) or "no machine yet"
    counts = sorted({evaluated.episodes for result in every for evaluated in result.evaluations})
    episodes = " or ".join(f"{count:,}" for count in counts) or "0"
    parts = [INTRODUCTION.format(episodes=episodes, machine=machines)]
    parts += [_section(section, results) for section in SECTIONS]
    return "\n".join(parts)


def _drawn(image: Image, results: Mapping[str, Sequence[Result]]) -> dict[str, Sequence[Result]]:
    """The runs of an image by label; none if there are none."""
    runs = {label: results.get(name, ()) for label, name in image.runs.items()}
    return runs if any(runs.values()) else {}


def _section(section: Section, results: Mapping[str, Sequence[Result]]) -> str:
    lines = [f"## {section.title}\n", section.words, ""]
    lines += [
        f"| {' | '.join(_COLUMNS)} |",
        f"|{'---|' * len(_COLUMNS)}",
    ]
    for experiment in section.experiments:
        lines += _rows(experiment, results.get(experiment.name, ()))
    if section.remarks:
        lines += ["", section.remarks]
    for image in section.images:
        if _drawn(image, results):
            lines += ["", f"![{image.title}](images/{image.name}.png)"]
    if section.failures:
        lines += ["", section.failures]
    return "\n".join(lines) + "\n"


def _rows(experiment: Experiment, runs: Sequence[Result]) -> list[str]:
    target = "" if experiment.target is None else f"{100 * experiment.target:g} %"
    if experiment.limit_s is not None:
        target += f", {_duration(experiment.limit_s)}"
    if not runs:
        return [f"| {experiment.title} | | {experiment.document} | {target} | not run | | | | | | | |"]
    steps = over_seeds([result.steps for result in runs]).value
    spent = [result.train_s for result in runs]
    clock = " CPU" if runs[0].clock == "processor" else ""
    longest = "" if len(spent) == 1 else f" (longest {_duration(max(spent))})"
    rate = over_seeds([result.steps_per_s for result in runs]).value
    lines = []
    for k, judged in enumerate(experiment.judged):
        evaluated = [result.evaluations[k] for result in runs]
        shares = [item.successes / item.episodes for item in evaluated]
        drawn = [item.drawn_successes / item.episodes for item in evaluated]
        interval = over_seeds(shares)
        low, high = interval.low, interval.high
        if len(runs) == 1:
            low, high = wilson_interval(evaluated[0].successes, evaluated[0].episodes)
        first = k == 0
        mean = f"{_duration(sum(spent) / len(spent))}{clock}"
        lines.append(
            f"| {experiment.title if first else ''} | {judged.label} | {experiment.document if first else ''} "
            f"| {target if first else ''} | {100 * interval.value:.2f} % "
            f"| {100 * max(0.0, low):.2f} to {100 * min(1.0, high):.2f} % "
            f"| {100 * min(shares):.2f} % | {100 * over_seeds(drawn).value:.2f} % "
            f"| {len(runs)} | {steps / 1e6:.2f} M | {mean}{longest} | {rate:,.0f} |"
        )
    return lines


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.1f} min"
