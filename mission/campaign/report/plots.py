"""Plots of a campaign: success by varied value, margins, where it fails, boundaries.

In: findings. Out: figures in the colours of the plots of flights; as SVG their text and lines take the colour of the
page they stand in, light or dark.
"""

import io
import re
from collections.abc import Callable, Sequence
from math import isfinite
from typing import Any

import matplotlib as mpl
import numpy as np

from mission.campaign.campaign import SEED_KEY
from mission.campaign.findings import Findings
from mission.campaign.runs import Record
from mission.campaign.search.bisection import BoundaryFound
from mission.campaign.statistics import Sensitivity
from mission.log.flight_plots import ESTIMATE_COLOUR, TRUE_COLOUR

mpl.use("Agg")
from matplotlib.axes import Axes
from matplotlib.figure import Figure

PASSED_COLOUR, FAILED_COLOUR, INK = TRUE_COLOUR, ESTIMATE_COLOUR, "#010203"
KEYS_MAX = 8  # plots of varied keys, those that matter most
DRAWN_MAX = 2000  # points of a plot
HISTOGRAM_BINS = 30
_STYLE: Any = {
    "font.size": 9,
    "svg.fonttype": "none",
    "svg.hashsalt": "honeyguide",
    "axes.spines.top": False,
    "axes.spines.right": False,
    **dict.fromkeys(("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color"), INK),
}
_VARIABLES = {INK: "currentColor", PASSED_COLOUR: "var(--passed)", FAILED_COLOUR: "var(--failed)"}
Draw = Callable[[Figure], None]


def svg_of(draw: Draw, width: float = 4.6, height: float = 3.2) -> str:
    """A figure as an SVG element, whose colours are the page's."""
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(width, height), layout="constrained")
        figure.patch.set_alpha(0.0)
        draw(figure)
        for axes in figure.axes:
            axes.patch.set_alpha(0.0)
        stream = io.StringIO()
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1)
    for colour, variable in _VARIABLES.items():
        text = text.replace(colour, variable)
    return text


def overview_png(findings: Findings) -> bytes:
    """The most important plots in one image, for documents."""
    panels = [panel for panel in (margins_plot(findings), map_plot(findings)) if panel is not None]
    keys = [key_plot(findings, each) for each in findings.sensitivities[: 4 - len(panels)]]
    panels += keys
    panels += [boundary_plot(s) for s in findings.searches if isinstance(s, BoundaryFound) and s.found][
        : 4 - len(panels)
    ]
    with mpl.rc_context({**_STYLE, "figure.facecolor": "white"}):
        figure = Figure(figsize=(10.0, 3.4 * -(-len(panels) // 2)), layout="constrained")
        figure.suptitle(findings.campaign.about or findings.campaign.name)
        parts = figure.subfigures(-(-len(panels) // 2), 2, squeeze=False).flat
        for part, draw in zip(parts, panels, strict=False):
            draw(part)
        stream = io.BytesIO()
        figure.savefig(stream, format="png", dpi=110, metadata={"Software": None})
    return stream.getvalue()


def margins_plot(findings: Findings) -> Draw | None:
    """How much room the runs have."""
    judged = [record for record in findings.samples if record.margin is not None]
    if len(judged) < 2:
        return None

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        margins = {passed: [r.margin or 0.0 for r in judged if r.passed is passed] for passed in (True, False)}
        edges = np.histogram_bin_edges([r.margin or 0.0 for r in judged], min(HISTOGRAM_BINS, max(5, len(judged) // 4)))
        axes.hist([margins[True], margins[False]], edges.tolist(), stacked=True, color=[PASSED_COLOUR, FAILED_COLOUR],
                  label=[f"passed ({len(margins[True])})", f"failed ({len(margins[False])})"])  # fmt: skip
        axes.axvline(0.0, color=INK, lw=0.8)
        axes.set(xlabel=margin_label(judged, findings.campaign.margin), ylabel="runs")
        _legend(axes)

    return draw


def margin_label(records: Sequence[Record], check: str) -> str:
    """What the margins are of."""
    kinds = {(record.check, record.unit) for record in records if record.margin is not None}
    if len(kinds) == 1:
        name, unit = next(iter(kinds))
        return f"margin of {name} [{unit}]" if unit else f"margin of {name}"
    return f"least margin of {check or 'all checks'}, each in its unit"


def key_plot(findings: Findings, sensitivity: Sensitivity) -> Draw:
    """Success and margin by one varied value."""
    key, bins = sensitivity.key, sensitivity.bins
    is_choice = findings.campaign.vary[key].choice is not None

    def draw(figure: Figure) -> None:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 1.1))
        x = np.array([0.5 * (b.low + b.high) for b in bins])
        y, low, high = (np.array([getattr(b.success, name) for b in bins]) for name in ("value", "low", "high"))
        above.errorbar(
            x, y, [y - low, high - y], fmt="o" if is_choice else "o-", color=PASSED_COLOUR, ms=4, lw=1.2, capsize=2
        )
        above.set(ylabel="success", ylim=(-0.05, 1.05))
        labels = {
            str(choice): float(i) for i, choice in enumerate(dict.fromkeys(findings.campaign.vary[key].choice or ()))
        }
        judged = [r for r in findings.samples if r.margin is not None][:DRAWN_MAX]
        for passed, colour in ((True, PASSED_COLOUR), (False, FAILED_COLOUR)):
            chosen = [r for r in judged if r.passed is passed]
            places = [labels[str(r.values[key])] if is_choice else float(r.values[key]) for r in chosen]
            below.scatter(places, [r.margin or 0.0 for r in chosen], s=6, color=colour, alpha=0.6, lw=0)
        below.axhline(0.0, color=INK, lw=0.6)
        below.set(xlabel=key, ylabel="margin" + _unit(judged))
        if is_choice:
            below.set_xticks([b.low for b in bins], [b.label for b in bins])

    return draw


def _unit(records: Sequence[Record]) -> str:
    units = {record.unit for record in records}
    return f" [{next(iter(units))}]" if len(units) == 1 and next(iter(units)) else ""


def map_plot(findings: Findings) -> Draw | None:
    """Where it fails, over the two values that matter most."""
    keys = [s.key for s in findings.sensitivities if findings.campaign.vary[s.key].is_ordered and s.key != SEED_KEY][:2]
    if len(keys) < 2:
        return None

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        for passed, colour, mark, word in ((True, PASSED_COLOUR, "o", "passed"), (False, FAILED_COLOUR, "X", "failed")):
            chosen = [r for r in findings.samples if r.passed is passed][:DRAWN_MAX]
            x, y = ([float(r.values[key]) for r in chosen] for key in keys)
            axes.scatter(x, y, s=12 if passed else 22, c=colour, marker=mark, alpha=0.75, lw=0, label=word)
        axes.set(xlabel=keys[0], ylabel=keys[1])
        _legend(axes)

    return draw


def boundary_plot(found: BoundaryFound) -> Draw:
    """The runs of a bisection, by seed."""

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        for row, bracket in enumerate(found.brackets):
            for passed, colour, mark in ((True, PASSED_COLOUR, "o"), (False, FAILED_COLOUR, "X")):
                x = [float(r.values[found.key]) for r in bracket.runs if r.passed is passed]
                axes.scatter(
                    x,
                    [row] * len(x),
                    s=24,
                    c=colour,
                    marker=mark,
                    lw=0,
                    label="" if row else "passed" if passed else "failed",
                )
            if bracket.has_boundary and isfinite(bracket.middle):
                axes.plot([bracket.middle] * 2, [row - 0.35, row + 0.35], color=INK, lw=1.5)
        axes.set_yticks(range(len(found.brackets)), [f"seed {b.seed}" for b in found.brackets])
        axes.set(xlabel=found.key, ylim=(-0.6, len(found.brackets) - 0.4))
        _legend(axes)

    return draw


def _legend(axes: Axes) -> None:
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2, fontsize=8, ncols=4, frameon=False)
