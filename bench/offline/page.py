"""docs/results/offline-estimates.md and its image, from what estimates came to."""

from pathlib import Path
from typing import Any, NamedTuple

from bench.page_section import with_section
from common.files import write_whole

PAGE = Path(__file__).parents[2] / "docs" / "results" / "offline-estimates.md"
IMAGE = PAGE.parent / "images" / "offline-estimates.png"
HEADING = "## What it came to"


class Estimate(NamedTuple):
    """One of the three."""

    title: str
    judged: str
    truth: str  # key of what that one returns
    of: str


ESTIMATES = {
    "fitted_q": Estimate("fitted Q", "most probable actions", "truth", "true return"),
    "importance": Estimate(
        "importance-weighted", "a Gaussian around them", "truth_drawn", "true return of the Gaussian"
    ),
    "robust": Estimate("doubly robust", "a Gaussian around them", "truth_drawn", "true return of the Gaussian"),
}


def write_page(content: dict[str, Any], rows: list[dict[str, Any]], summary: dict[str, dict[str, float]]) -> None:
    """The section of the page that is measured, and the image."""
    lines = [
        f"{content['decisions']:,} decisions of {content['episodes']} episodes; the truth is the mean of "
        f"{content['truth_episodes']:,} episodes of each of {len(rows)} policies.",
        "",
        "| estimate | judges | Spearman with its return (wanted: 0.8) | 95 % intervals that hold it (wanted: 10 of 12) "
        "| Spearman with the most probable actions' return | intervals that hold that |",
        "|---|---|---|---|---|---|",
    ]
    for key, estimate in ESTIMATES.items():
        found = summary[key]
        ranks = f"{found['spearman']:.3f} | {found['held']} of {found['of']}"
        flown = f"{found['flown_spearman']:.3f} | {found['flown_held']} of {found['of']}"
        lines.append(f"| {estimate.title} | {estimate.judged} | {ranks} | {flown} |")
    titles = " | ".join(estimate.title for estimate in ESTIMATES.values())
    lines += ["", f"| policy | truth | truth of the Gaussian | {titles} | effective episodes | outside |"]
    lines.append("|" + "---|" * (len(ESTIMATES) + 5))
    for row in rows:
        figures = " | ".join(f"{row[key][0]:.3f} ({row[key][1]:.3f} to {row[key][2]:.3f})" for key in ESTIMATES)
        truth = " | ".join(f"{row[key][0]:.3f} ± {row[key][1]:.3f}" for key in ("truth", "truth_drawn"))
        lines.append(
            f"| {row['policy']} | {truth} | {figures} | {row['effective']:.0f} | {100 * row['outside']:.0f} % |"
        )
    section = "\n".join((HEADING, "", *lines, "", "![Estimates and truth](images/offline-estimates.png)", ""))
    write_whole(PAGE, with_section(PAGE.read_text(encoding="utf-8"), HEADING, section).encode())
    _draw(rows)


def _draw(rows: list[dict[str, Any]]) -> None:
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(ESTIMATES), figsize=(9.0, 3.2), layout="constrained", sharey=True)
    for axis, (key, estimate) in zip(axes, ESTIMATES.items(), strict=True):
        truth, value = [row[estimate.truth][0] for row in rows], [row[key][0] for row in rows]
        below = [max(0.0, row[key][0] - row[key][1]) for row in rows]
        above = [max(0.0, row[key][2] - row[key][0]) for row in rows]
        axis.errorbar(truth, value, yerr=[below, above], fmt="o", ms=4, capsize=2, color="#0072b2")
        axis.axline((0.0, 0.0), slope=1.0, color="#9a9a9a", lw=1)
        axis.set_title(estimate.title)
        axis.set_xlabel(estimate.of)
    axes[0].set_ylabel("estimate, 95 %")
    IMAGE.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(IMAGE, dpi=100)
    plt.close(figure)
