"""The report of a campaign: one HTML file that needs nothing else, light or dark, as wide as a phone or wider."""

from collections.abc import Iterator
from html import escape
from pathlib import Path

from common.files import write_whole
from mission.campaign.findings import SUMMARY_FILE, Findings, fraction_text
from mission.campaign.report.plots import (
    KEYS_MAX,
    Draw,
    boundary_plot,
    key_plot,
    map_plot,
    margins_plot,
    overview_png,
    svg_of,
)
from mission.campaign.search.bisection import BoundaryFound

REPORT_FILE, OVERVIEW_FILE = "report.html", "overview.png"
_STYLE = """
:root { color-scheme: light dark; --passed: #0b7285; --failed: #e8590c;
  --paper: #fff; --ink: #212529; --line: #ced4da; }
@media (prefers-color-scheme: dark) {
  :root { --passed: #3bc9db; --failed: #ff922b; --paper: #16191d; --ink: #dee2e6; --line: #495057; }
}
body { margin: 0 auto; max-width: 70rem; padding: 1rem; font: 16px/1.5 system-ui, sans-serif;
  background: var(--paper); color: var(--ink); }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
.rate { font-size: 2.2rem; font-weight: 600; }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 21rem), 1fr)); gap: 1rem; }
.plots svg { width: 100%; height: auto; display: block; }
figure { margin: 0; max-width: 34rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .85rem; }
th, td { border-bottom: 1px solid var(--line); padding: .3rem .6rem; text-align: left; vertical-align: top; }
td.number { text-align: right; white-space: nowrap; }
code { font-size: .8rem; overflow-wrap: anywhere; }
.failed { color: var(--failed); }
"""


def write_report(findings: Findings, folder: Path) -> None:
    """Writes `report.html` and `overview.png`."""
    name = escape(findings.campaign.name)
    body = "\n".join(_parts(findings))
    page = (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{name}</title>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<style>{_STYLE}</style></head>\n<body>\n{body}\n</body></html>\n"
    )
    write_whole(folder / REPORT_FILE, page.encode())
    if findings.samples:
        write_whole(folder / OVERVIEW_FILE, overview_png(findings))


def _parts(findings: Findings) -> Iterator[str]:
    campaign = findings.campaign
    yield f"<h1>{escape(campaign.name)}</h1>\n<p>{escape(campaign.about)}</p>"
    if findings.samples:
        yield from _success(findings)
        plots = [plot for plot in (margins_plot(findings), map_plot(findings)) if plot is not None]
        yield f'<div class="plots">{"".join(_figure(plot) for plot in plots)}</div>'
    if findings.sensitivities:
        yield "<h2>What it depends on</h2>"
        yield _sensitivity_table(findings)
        drawn = findings.sensitivities[:KEYS_MAX]
        yield f'<div class="plots">{"".join(_figure(key_plot(findings, each)) for each in drawn)}</div>'
        yield (
            "<p>Success in bins of as many runs each, with 95&nbsp;% intervals (Wilson); below it the margin of each "
            "run. Rank correlation: Spearman's, with the least margin. Explained: variance of the margins' ranks "
            "between the bins, less what chance gives. Chance: neither is beyond what chance gives once in twenty.</p>"
        )
    for search in findings.searches:
        yield f"<h2>{_TITLES.get(type(search).__name__, 'Search')}</h2>\n<p>{escape(search.sentence)}.</p>"
        if isinstance(search, BoundaryFound):
            yield f'<div class="plots">{_figure(boundary_plot(search))}</div>'
    yield "<h2>Worst first</h2>"
    yield _worst_table(findings)
    yield f"<p>Every run is a line of <code>runs.jsonl</code>, all figures are in <code>{SUMMARY_FILE}</code>.</p>"


_TITLES = {"BoundaryFound": "Boundary", "WorstFound": "Search for the worst", "RareFound": "Rare failures"}


def _figure(draw: Draw) -> str:
    return f"<figure>{svg_of(draw)}</figure>"


def _success(findings: Findings) -> Iterator[str]:
    campaign, success = findings.campaign, findings.success
    counted = fraction_text(success).partition(" (")[2].removesuffix(")")
    yield f'<p><span class="rate">{success.value:.1%}</span> success: {escape(counted)}</p>'
    if campaign.require:
        met = "met" if findings.is_met else '<strong class="failed">not met</strong>'
        yield f"<p>Required: {escape(campaign.require)}: {met}.</p>"
    lost = sum(record.is_lost for record in findings.samples)
    if lost:
        yield f'<p class="failed">{lost} runs were lost: their process ended or hung, or they could not be flown.</p>'


def _sensitivity_table(findings: Findings) -> str:
    rows = "".join(
        f"<tr><td><code>{escape(each.key)}</code></td>"
        f'<td class="number">{"" if each.rank_correlation is None else f"{each.rank_correlation:+.2f}"}</td>'
        f'<td class="number">{each.explained:.0%}</td><td>{"" if each.is_clear else "chance"}</td></tr>'
        for each in findings.sensitivities
    )
    head = "<tr><th>varied</th><th>rank correlation</th><th>explained</th><th></th></tr>"
    return f'<div class="wide"><table>{head}{rows}</table></div>'


def _worst_table(findings: Findings) -> str:
    keys = list(findings.campaign.vary)
    head = "".join(f"<th>{escape(text)}</th>" for text in ("run", "seed", "margin", *keys, "failed", "again"))
    rows = []
    for each in findings.worst:
        record = each.record
        margin = "" if record.margin is None else f"{record.margin:.3g} {record.unit}"
        values = "".join(f'<td class="number">{escape(_shown(record.values.get(key, "")))}</td>' for key in keys)
        rows.append(
            f'<tr><td>{escape(record.phase)} {record.number}</td><td class="number">{record.seed}</td>'
            f'<td class="number{"" if record.passed else " failed"}">{escape(margin)}</td>{values}'
            f"<td>{escape('; '.join(record.failures))}</td><td><code>{escape(each.command)}</code></td></tr>"
        )
    return f'<div class="wide"><table><tr>{head}</tr>{"".join(rows)}</table></div>'


def _shown(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
