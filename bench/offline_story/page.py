"""The section of a story's page that is measured, and its images, from what the story came to."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from bench.offline_story.pictures import draw_bars, draw_curves
from bench.offline_story.story import Measure, Story, figure
from bench.page_section import with_section
from common.files import write_whole
from common.intervals import Interval

DOCS = Path(__file__).parents[2] / "docs" / "results"
HEADING = "## What it came to"
LEARNT_FROM = {"": "of both pilots", "medium-": "of the mediocre pilot alone"}

Figures = dict[tuple[str, str], Interval]
"""By pilot and condition."""


@dataclass(frozen=True, slots=True)
class Result:
    """What a story came to; of each mix of pilots (`MIXES`) unless it says otherwise."""

    forecasts: dict[str, dict[str, Any]]
    validated: dict[str, dict[str, Any]]
    matched: dict[str, Any]  # those that flew, in batch, in conditions as flown
    flown: dict[str, Any]  # flights of each pilot and condition
    chosen: dict[str, str]  # the run that flew
    sizes: dict[str, Any]


def coverage_image(story: Story) -> Path:
    """Where the policies leave the data."""
    return _image(story, "-coverage")


def _image(story: Story, what: str = "") -> Path:
    return DOCS / "images" / f"{story.page}{what}.png"


def write_page(story: Story, folder: Path, result: Result) -> None:
    """The section of the page that is measured, and the images."""
    figures = figures_of(story, result)
    page = DOCS / f"{story.page}.md"
    section = "\n".join((HEADING, "", *section_lines(story, result, figures), ""))
    write_whole(page, with_section(page.read_text(encoding="utf-8"), HEADING, section).encode())
    measures = {measure: figures[measure.key] for measure in story.measures}
    draw_bars(_image(story), measures, story.pilot_titles, story.conditions, story.titles[0])
    mixes = {mix: f"{story.titles[0]} {pilots}" for mix, pilots in LEARNT_FROM.items()}
    draw_curves(_image(story, "-curves"), folder / "runs", story.task, mixes, list(result.validated[""]))
    write_whole(folder / "story.json", json.dumps(asdict(result)).encode())


def section_lines(story: Story, result: Result, figures: Mapping[str, Figures]) -> list[str]:
    """The lines of the section, below its heading."""
    sizes, titles, words = result.sizes, story.pilot_titles, story.titles
    each = f"{sizes['seconds']:.0f} s each, " if "seconds" in sizes else ""
    lines = [
        f"Logged: {sizes['clumsy']} {words[0]} of the mediocre pilot and {sizes['shipped']} of the {words[1]}, "
        f"{each}{result.forecasts['']['decisions']:,} decisions; {sizes['steps']:,} gradient steps each.",
    ]
    for mix, pilots in LEARNT_FROM.items():
        lines += ["", f"From the {words[0]} {pilots}:", "", *_forecast_table(story, result, mix)]
    lines += ["", *_flown_table(story, result, figures), ""]
    for name in ("medium", "offline"):
        found = figures[story.measures[0].key]
        gained = ", ".join(f"{each} {_gained(found, name, each)}" for each in story.conditions)
        lines.append(f"- {titles[name]}, of the way from the mediocre pilot to the {words[1]}: {gained}")
    return [
        *lines,
        "",
        f"![{story.measures[0].title[0].upper()}{story.measures[0].title[1:]}](images/{_image(story).name})",
        "",
        "Success in batch while they learn, in 64 episodes each time, and where the policies of "
        f"all {words[0]} leave them:",
        "",
        f"![Training curves](images/{_image(story, '-curves').name})",
        "",
        f"![Coverage](images/{coverage_image(story).name})",
    ]


def _forecast_table(story: Story, result: Result, mix: str) -> list[str]:
    measure = story.measures[0]
    batch = [f"{condition}, batch" for condition in story.conditions]
    lines = [
        "| learnt by | forecast, doubly robust | fitted Q | effective episodes | outside of the data "
        f"| {' | '.join(batch)} |",
        "|---|---|---|---|---|" + "---|" * len(batch),
    ]
    policies, validated = result.forecasts[mix]["policies"], result.validated[mix]
    for name, found in sorted(policies.items(), key=lambda item: -item[1]["robust"]["value"]):
        mark = " (flown)" if name == result.chosen[mix] else ""
        estimates = " | ".join(_estimate(found[kind]) for kind in ("robust", "fitted_q"))
        reached = " | ".join(_value(validated[name][each][measure.key][0], measure) for each in story.conditions)
        worth = f"{found['effective_episodes']:.1f} | {100 * found['outside']:.0f} %"
        lines.append(f"| {name.removeprefix(mix)}{mark} | {estimates} | {worth} | {reached} |")
    return lines


def _flown_table(story: Story, result: Result, figures: Mapping[str, Figures]) -> list[str]:
    first, *others = story.measures
    titles = [measure.title for measure in story.measures]
    batch = ["batch, as flown", *(f"{measure.title}, batch" for measure in others)]
    difference = f"flown less batch [{'points' if first.unit == '%' else first.unit}]"
    heads = ["flown over MAVLink", "condition", story.titles[0], *titles, "no collision", *batch, difference]
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for name, title in story.pilot_titles.items():
        for condition in story.conditions:
            outcomes = result.flown[name][condition]
            flown = [figures[measure.key][name, condition] for measure in story.measures]
            cells = [title, condition, str(len(outcomes))]
            cells += [_interval(found, measure) for found, measure in zip(flown, story.measures, strict=True)]
            cells.append(str(len(outcomes) - sum(map(story.is_hit, outcomes))))
            if name in result.matched:
                matched = result.matched[name][condition]
                cells += [_interval(Interval(*matched[measure.key]), measure) for measure in story.measures]
                off = _scale(first) * (flown[0].value - matched[first.key][0])
                cells.append(f"{off:+.1f}" if first.unit == "%" else f"{off:+.2f}")
            else:
                cells += [""] * (len(batch) + 1)
            lines.append(f"| {' | '.join(cells)} |")
    return lines


def figures_of(story: Story, result: Result) -> dict[str, Figures]:
    """By measure, as flown."""
    return {
        measure.key: {
            (name, condition): figure([measure.of(outcome) for outcome in result.flown[name][condition]])
            for name in story.pilot_titles
            for condition in story.conditions
        }
        for measure in story.measures
    }


def _estimate(found: Mapping[str, float]) -> str:
    value, low, high = (found[key] for key in ("value", "low", "high"))
    return f"{value:.1f} ({low:.1f} to {high:.1f})"


def _scale(measure: Measure) -> float:
    return 100.0 if measure.unit == "%" else 1.0


def _value(value: float, measure: Measure) -> str:
    return _number(value, measure) + f" {measure.unit}"


def _interval(found: Interval, measure: Measure) -> str:
    if not isfinite(found.value):
        return "-"
    value = _value(found.value, measure)
    if not isfinite(found.low):  # of one flight
        return value
    return f"{value} ({_number(found.low, measure)} to {_number(found.high, measure)})"


def _number(value: float, measure: Measure) -> str:
    return f"{_scale(measure) * value:.{2 if measure.unit == 'm/s' else 1}f}"


def _gained(figures: Figures, name: str, condition: str) -> str:
    """How far learning has come."""
    least = figures["clumsy", condition].value
    gained, whole = (figures[other, condition].value - least for other in (name, "shipped"))
    return f"{100 * gained / whole:.0f} %" if isfinite(gained) and isfinite(whole) and whole else "-"
