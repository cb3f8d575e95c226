"""docs/results/offline.md and its picture, from what a story came to."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from bench.page_section import with_section
from common.files import write_whole
from common.intervals import bootstrap

PAGE = Path(__file__).parents[2] / "docs" / "results" / "offline.md"
PICTURE = PAGE.parent / "images" / "offline.png"
HEADING = "## What it came to"
TITLES = {"clumsy": "mediocre pilot", "offline": "learnt from the logs", "shipped": "follower that ships"}


def write_page(
    folder: Path,
    forecast: dict[str, Any],
    validated: dict[str, Any],
    flown: dict[str, Any],
    chosen: str,
    sizes: dict[str, Any],
) -> None:
    """The section of the page that is measured, and the picture."""
    lines = [
        f"Logged: {sizes['clumsy']} flights of the mediocre pilot and {sizes['shipped']} of the follower that ships, "
        f"{sizes['seconds']:.0f} s each, {forecast['decisions']:,} decisions; {sizes['steps']:,} gradient steps each.",
        "",
        "| learnt by | forecast, doubly robust | fitted Q | outside of the data | walk, batch | run, batch |",
        "|---|---|---|---|---|---|",
    ]
    for name, found in sorted(forecast["policies"].items(), key=lambda item: -item[1]["robust"]["value"]):
        mark = " (flown)" if name == chosen else ""
        estimates = " | ".join(
            f"{found[kind]['value']:.1f} ({found[kind]['low']:.1f} to {found[kind]['high']:.1f})"
            for kind in ("robust", "fitted_q")
        )
        bands = " | ".join(f"{100 * validated[name][pace]['in_band'][0]:.1f} %" for pace in ("walk", "run"))
        lines.append(f"| {name}{mark} | {estimates} | {100 * found['outside']:.0f} % | {bands} |")
    lines += [
        "",
        "| flown over MAVLink | condition | flights | within 1 to 3 m | no collision |",
        "|---|---|---|---|---|",
    ]
    figures: dict[str, dict[str, Any]] = {}
    for name, title in TITLES.items():
        for condition, outcomes in flown[name].items():
            in_band = np.array([outcome["in_band"] for outcome in outcomes])
            found = bootstrap(len(in_band), lambda rows, values=in_band: float(values[rows].mean()))
            hits = sum(outcome["is_collided"] for outcome in outcomes)
            figures.setdefault(condition, {})[name] = found
            words = f"{100 * found.value:.1f} % ({100 * found.low:.1f} to {100 * found.high:.1f})"
            lines.append(f"| {title} | {condition} | {len(outcomes)} | {words} | {len(outcomes) - hits} |")
    lines.append("")
    lines += [f"- {condition}: {_share(found)}" for condition, found in figures.items()]
    section = "\n".join((HEADING, "", *lines, "", "![Time in the band](images/offline.png)", ""))
    write_whole(PAGE, with_section(PAGE.read_text(encoding="utf-8"), HEADING, section).encode())
    _draw(figures)
    write_whole(folder / "story.json", json.dumps({"forecast": forecast, "flown": flown, "sizes": sizes}).encode())


def _share(found: dict[str, Any]) -> str:
    """How far learning has come."""
    gained, whole = (found[name].value - found["clumsy"].value for name in ("offline", "shipped"))
    return f"{100 * gained / whole:.0f} % of the way from the mediocre pilot to the follower that ships"


def _draw(figures: dict[str, dict[str, Any]]) -> None:
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(7.0, 3.0), layout="constrained")
    for k, found in enumerate(figures.values()):
        for j, name in enumerate(TITLES):
            value = found[name]
            colour = ("#9a9a9a", "#0072b2", "#009e73")[j]
            axes.barh(
                4 * k + j, 100 * value.value, color=colour, label=TITLES[name] if k == 0 else None,
                xerr=[[100 * (value.value - value.low)], [100 * (value.high - value.value)]], capsize=3,
            )  # fmt: skip
    axes.set_yticks([4 * k + 1 for k in range(len(figures))], list(figures))
    axes.invert_yaxis()
    axes.set_xlim(0.0, 100.0)
    axes.set_xlabel("time within 1 to 3 m of the owner [%], 95 % intervals over flights")
    axes.grid(axis="x", alpha=0.3)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.16), ncols=3, frameon=False)
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(PICTURE, dpi=110)
    plt.close(figure)
