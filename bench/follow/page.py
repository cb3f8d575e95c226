"""Writes docs/results/follow.md and its pictures from the results of the stages."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from bench.cars import curves
from bench.cars.page import DOCS
from bench.follow import pictures
from bench.follow.result import Judged, Result
from bench.follow.stages import CELLS, OWNER_SPEEDS, STAGES, Stage, in_order
from common.files import write_whole
from common.intervals import Interval
from policies.learn.export.provenance import short_commit
from policies.tasks.follow_me.scorecard import NAMES, written
from policies.tasks.follow_me.track import Ranges

REWARDS = {  # what is drawn, and where
    "ours": "follow-reward",
    "the trackers'": "follow-tracked-reward",
    "the document's": "follow-document-reward",
}
Results = Mapping[str, Sequence[Result]]
INTRODUCTION = """# Following an owner, trained anew

What 'Reinforcement Learning for Simulating Personal Navigation UAV' reports, and what the same job comes to here. All
of this page is made by one command, from nothing; it goes on where it was when stopped:

```sh
make reproduce-follow
```

What comes of it stays in `results/follow/`, and the policies that ship are kept: with `ARGS="--publish"` the best
of three seeds of each that ships take their place; one seed, in a third of the time, is `ARGS="--seeds 1"`.

A teacher that sees the truth is trained by PPO; students that see what flies (a 64 x 64 picture with depth, the flight
controller's estimate and, but for vision-only, the phone's reports) learn from it by DAgger; PPO may go on with what
they have learned, its critic alone seeing the truth. Each stage is one process on as many cores as the table says, at
times with another beside it; glibc keeps their memory and OpenMP's threads wait passively (`bench/side_by_side.py`).
Wall clock is that of training; compiling the kernels, once per machine, is not in it. Judged are most probable actions
in held-out worlds: fresh hills, trees, owners, wind and noise, {episodes}.
Trackers fly a quicker vehicle than all others since 8d34b193; their rows here are of before, and all flown ones of
before [the controller's feedback was mended](../decisions/0024-as-late-as-it-can-be.md).
In batch the trackers, and they alone, meet what they are trained in: late and lost pictures, missing depth, rough
sensors, others about, under the guard's rule of people; in flight they meet what all do.
"Flown" are flights over MAVLink in lockstep: the whole autopilot, a companion computer, one vehicle at a time,
without a guard. Seeds of flights are odd, those of training even; where the commit is "not kept" half of the flights
had even seeds, of which there are so many that hardly one was trained on. How the policies that ship do under the
guard is on [another page](harder.md).
Rows are of the first seed; how many seeds there are stands under [what training takes](#what-training-takes).
Intervals are 95 % over episodes: Wilson's for rates, the bootstrap's for the rest. Measured on {machine}.

Success, tracking and collision are EVT-Bench's with its ranges kept (scale 1). In the band is {near:g} to {far:g} m
from the owner's chest. Success (SR) is to be in it with the owner in view when time is up, untouched on the way;
tracking (TR) is the share of time within {far:g} m with the owner in view; collision (CR) is an episode that touched a
tree, a wall or the ground or came within {touch:g} m of the owner. What is left of an episode that ended early counts
as not followed. A loss is {loss:g} s or more out of view or beyond {lost:g} m.
"""


NOT_RUN = """\
"Not run" is what this command has not trained here; what "Hardened" came to by an earlier form of its recipe is [told
elsewhere](harder.md#policies-that-look-at-images). What ships was trained stage by stage, three seeds of each: [how,
and how long that took](../../policies/pretrained/README.md#how-long-and-how-far-apart).
"""


REMARKS = """\
A teacher drives students' first rounds. The trackers' reward falls where a lesson raises what jerks and turns cost.
Rows whose commits differ were trained on different machines, which differ by up to a factor of two; sums over what came
before mix them."""


def write_page(results: Results, docs: Path = DOCS) -> Path:
    """Writes the page and its pictures; stages without results are named as such."""
    every = [result for runs in results.values() for result in runs]
    machines = ", ".join(sorted({result.machine for result in every})) or "no machine yet"
    ranges = Ranges()
    head = INTRODUCTION.format(
        episodes=_episodes(every),
        machine=machines,
        near=ranges.near_m,
        far=ranges.far_m,
        touch=ranges.collision_m,
        loss=ranges.loss_s,
        lost=ranges.lost_m,
    )
    parts = [head, _summary(results), _training(results, docs)]
    parts += [_by_cell(stage, results[stage.name][0], docs) for stage in STAGES.values() if results.get(stage.name)]
    path = docs / "follow.md"
    docs.mkdir(parents=True, exist_ok=True)
    write_whole(path, "\n".join(parts).encode())
    return path


def _episodes(every: Sequence[Result]) -> str:
    counts = [sorted({item.card.episodes for item in _cells(every, is_flown=flown)}) for flown in (False, True)]
    words = [" or ".join(map(str, count)) for count in counts]
    texts = [f"{word} {what} of each kind" for word, what in zip(words, ("episodes", "flights"), strict=True) if word]
    return " and ".join(texts) or "none yet"


def _cells(every: Sequence[Result], *, is_flown: bool) -> list[Judged]:
    return [
        item for result in every for (trees, _), item in result.cards(is_flown=is_flown).items() if trees is not None
    ]


def _summary(results: Results) -> str:
    columns = (
        *("policy", "document, best known", "judged", "owner", "at least", "in band", "success", "tracking"),
        *("no collision", "episodes"),
    )
    lines = ["## How well they follow", "", f"| {' | '.join(columns)} |", f"|{'---|' * len(columns)}"]
    for stage in STAGES.values():
        runs = results.get(stage.name, ())
        if not runs:
            lines.append(f"| {stage.title} | {stage.document} | not run | | | | | | | |")
            continue
        lines += _summary_rows(stage, runs[0])
    if any(not results.get(name) for name in STAGES):
        lines += ["", NOT_RUN]
    return "\n".join(lines) + "\n"


def _summary_rows(stage: Stage, result: Result) -> list[str]:
    rows: list[str] = []
    for is_flown in (False, True):
        cards = result.cards(is_flown=is_flown)
        for speed, target in zip(OWNER_SPEEDS, stage.targets, strict=True):
            if (None, speed) not in cards:
                continue
            card = cards[None, speed].card
            wanted = "" if target is None else f"{100 * target:g} % {'in band' if stage.figure == 'in_band' else 'SR'}"
            clear = Interval(1.0 - card.collision.value, 1.0 - card.collision.high, 1.0 - card.collision.low)
            shares = [written(figure, "%") for figure in (card.in_band, card.success, card.tracking, clear)]
            rows.append(
                f"| {'' if rows else stage.title} | {'' if rows else stage.document} "
                f"| {'flown' if is_flown else 'batch'} | {speed:g} m/s | {wanted} | {' | '.join(shares)} "
                f"| {card.episodes} |"
            )
    return rows


def _training(results: Results, docs: Path) -> str:
    columns = (
        "policy",
        "decisions",
        "cores",
        "wall clock",
        "with what came before",
        "at most",
        "decisions/s",
        "seeds",
        "file",
        "at",
    )
    lines = ["## What training takes", "", f"| {' | '.join(columns)} |", f"|{'---|' * len(columns)}"]
    for stage in STAGES.values():
        runs = results.get(stage.name, ())
        if not runs:
            continue
        first = runs[0]
        seconds = sum(run.train_s for run in runs) / len(runs)
        before = [earlier.name for earlier in in_order([stage.name]) if earlier is not stage]
        whole = seconds + sum(results[name][0].train_s for name in before if results.get(name))
        limit = "" if stage.limit_s is None else duration(stage.limit_s)
        lines.append(
            f"| {stage.title} | {first.steps / 1e6:.2f} M | {first.cores} | {duration(seconds)} | {duration(whole)} "
            f"| {limit} | {first.steps_per_s:,.0f} | {len(runs)} | {first.policy_bytes / 1024:,.0f} kB "
            f"| {short_commit(first.commit)} |"
        )
    for reward, name in REWARDS.items():
        drawn = {stage.title: results.get(stage.name, ()) for stage in STAGES.values() if stage.reward == reward}
        if any(run.curve for runs in drawn.values() for run in runs):
            title = f"Mean episode reward while training, {reward}"
            curves.draw(docs / "images" / f"{name}.png", title, drawn, value="reward", over="wall_s")
            lines += ["", f"![{title}](images/{name}.png)"]
    lines += ["", REMARKS]
    return "\n".join(lines) + "\n"


def _by_cell(stage: Stage, result: Result, docs: Path) -> str:
    """Every figure by density and speed."""
    lines = [f"## {stage.title}: by trees and speed"]
    for is_flown in (False, True):
        cards = result.cards(is_flown=is_flown)
        cells = [cell for cell in CELLS if (cell.trees_per_ha, cell.owner_speed_max) in cards]
        if not cells:
            continue
        titles = [f"{cell.trees_per_ha:g} trees/ha, {cell.owner_speed_max:g} m/s" for cell in cells]
        lines += ["", f"| {'flown' if is_flown else 'batch'} | {' | '.join(titles)} |", f"|{'---|' * (len(cells) + 1)}"]
        for name, (label, unit) in NAMES.items():
            figures = [getattr(cards[cell.trees_per_ha, cell.owner_speed_max].card, name) for cell in cells]
            lines.append(f"| {label} | {' | '.join(written(figure, unit) for figure in figures)} |")
        returns = [cards[cell.trees_per_ha, cell.owner_speed_max].mean_return for cell in cells]
        if not is_flown:
            lines.append(f"| mean reward | {' | '.join('-' if r is None else f'{r:.1f}' for r in returns)} |")
    picture = f"follow-{stage.name}"
    if pictures.draw(docs / "images" / f"{picture}.png", stage.title, result):
        lines += ["", f"![{stage.title}](images/{picture}.png)"]
    return "\n".join(lines) + "\n"


def duration(seconds: float) -> str:
    """As people say it."""
    if math.isnan(seconds) or seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.1f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
