"""docs/results/offline.md and its picture, from what a story came to."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench.offline_story.pictures import draw_bands, draw_curves
from bench.page_section import with_section
from common.files import write_whole
from common.intervals import Interval, bootstrap

PAGE = Path(__file__).parents[2] / "docs" / "results" / "offline.md"
_IMAGES = PAGE.parent / "images"
COVERAGE = _IMAGES / "offline-coverage.png"
HEADING = "## What it came to"
TITLES = {
    "clumsy": "mediocre pilot",
    "medium": "learnt from the mediocre pilot alone",
    "offline": "learnt from both",
    "shipped": "follower that ships",
}
LEARNT_FROM = {"": "of both pilots", "medium-": "of the mediocre pilot alone"}


@dataclass(frozen=True, slots=True)
class Story:
    """What a story came to; of each mix of pilots (`MIXES`) unless it says otherwise."""

    forecasts: dict[str, dict[str, Any]]
    validated: dict[str, dict[str, Any]]
    matched: dict[str, Any]  # those that flew, in batch, in conditions as flown
    flown: dict[str, Any]  # flights of each pilot and condition
    chosen: dict[str, str]  # the run that flew
    sizes: dict[str, Any]


def write_page(folder: Path, story: Story) -> None:
    """The section of the page that is measured, and the picture."""
    sizes = story.sizes
    lines = [
        f"Logged: {sizes['clumsy']} flights of the mediocre pilot and {sizes['shipped']} of the follower that ships, "
        f"{sizes['seconds']:.0f} s each, {story.forecasts['']['decisions']:,} decisions; "
        f"{sizes['steps']:,} gradient steps each.",
    ]
    for mix, words in LEARNT_FROM.items():
        lines += ["", f"From the flights {words}:", "", *_forecast_table(story, mix)]
    figures = {
        (name, condition): _in_band(outcomes) for name in TITLES for condition, outcomes in story.flown[name].items()
    }
    lines += ["", *_flown_table(story, figures), ""]
    conditions = list(story.flown["clumsy"])
    for name in ("medium", "offline"):
        gained = ", ".join(f"{condition} {_gained(figures, name, condition)}" for condition in conditions)
        lines.append(f"- {TITLES[name]}, of the way from the mediocre pilot to the follower that ships: {gained}")
    lines += [
        "",
        "![Time in the band](images/offline.png)",
        "",
        "Success in batch while they learn, in 64 episodes of the conditions of training, and where the policies of "
        "all flights leave them:",
        "",
        "![Training curves](images/offline-curves.png)",
        "",
        "![Coverage](images/offline-coverage.png)",
    ]
    section = "\n".join((HEADING, "", *lines, ""))
    write_whole(PAGE, with_section(PAGE.read_text(encoding="utf-8"), HEADING, section).encode())
    draw_bands(_IMAGES / "offline.png", figures, TITLES, conditions)
    draw_curves(_IMAGES / "offline-curves.png", folder / "runs", LEARNT_FROM, list(story.validated[""]))
    write_whole(folder / "story.json", json.dumps(asdict(story)).encode())


def _forecast_table(story: Story, mix: str) -> list[str]:
    lines = [
        "| learnt by | forecast, doubly robust | fitted Q | effective episodes | outside of the data "
        "| walk, batch | run, batch |",
        "|---|---|---|---|---|---|---|",
    ]
    policies, validated = story.forecasts[mix]["policies"], story.validated[mix]
    for name, found in sorted(policies.items(), key=lambda item: -item[1]["robust"]["value"]):
        mark = " (flown)" if name == story.chosen[mix] else ""
        estimates = " | ".join(_words(found[kind], 1.0) for kind in ("robust", "fitted_q"))
        bands = " | ".join(f"{100 * validated[name][pace]['in_band'][0]:.1f} %" for pace in ("walk", "run"))
        worth = f"{found['effective_episodes']:.1f} | {100 * found['outside']:.0f} %"
        lines.append(f"| {name.removeprefix(mix)}{mark} | {estimates} | {worth} | {bands} |")
    return lines


def _flown_table(story: Story, figures: dict[tuple[str, str], Interval]) -> list[str]:
    lines = [
        "| flown over MAVLink | condition | flights | within 1 to 3 m | no collision | batch, as flown "
        "| flown less batch [points] |",
        "|---|---|---|---|---|---|---|",
    ]
    for (name, condition), found in figures.items():
        outcomes = story.flown[name][condition]
        hits = sum(outcome["is_collided"] for outcome in outcomes)
        cells = [TITLES[name], condition, str(len(outcomes)), _percent(found), str(len(outcomes) - hits)]
        if name in story.matched:
            value, low, high = story.matched[name][condition]["in_band"]
            cells += [_percent(Interval(value, low, high)), f"{100 * (found.value - value):+.1f}"]
        else:
            cells += ["", ""]
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def _in_band(outcomes: Sequence[dict[str, Any]]) -> Interval:
    in_band = np.array([outcome["in_band"] for outcome in outcomes])
    return bootstrap(len(in_band), lambda rows: float(in_band[rows].mean()))


def _words(found: dict[str, float], scale: float) -> str:
    value, low, high = (scale * found[key] for key in ("value", "low", "high"))
    return f"{value:.1f} ({low:.1f} to {high:.1f})"


def _percent(found: Interval) -> str:
    return f"{100 * found.value:.1f} % ({100 * found.low:.1f} to {100 * found.high:.1f})"


def _gained(figures: dict[tuple[str, str], Interval], name: str, condition: str) -> str:
    """How far learning has come."""
    least = figures["clumsy", condition].value
    gained, whole = (figures[other, condition].value - least for other in (name, "shipped"))
    return f"{100 * gained / whole:.0f} %"
