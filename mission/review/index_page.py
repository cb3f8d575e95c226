"""The index of many flights: a table with links, the worst first."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from math import inf

from mission.review.flight_review import FlightReview
from mission.review.review_page import page_part
from mission.review.verdicts import Level

MARKS = {Level.GOOD: "✓", Level.UNKNOWN: "?", Level.WARN: "!", Level.BAD: "✗"}
LEAST_SHOWN_M = 1000.0


@dataclass(frozen=True, slots=True)
class IndexRow:
    """One flight."""

    name: str
    link: str  # empty: it has no page
    failed: int
    checks: int
    margin: float | None  # the least of its checks
    level: Level  # the worst of its verdicts
    words: str  # what is wrong
    result: str
    duration_s: float
    distance_m: float

    @property
    def rank(self) -> tuple[bool, int, bool, float, int, str]:
        """The worst first: without a page, by failed checks, by bad verdicts, by the narrowest margin."""
        margin = inf if self.margin is None else self.margin
        return bool(self.link), -self.failed, self.level != Level.BAD, margin, -self.level, self.name


def index_row(review: FlightReview, link: str) -> IndexRow:
    margins = [check.margin for check in review.checks if check.margin is not None]
    failed = [check for check in review.checks if check.is_passed is False]
    troubles = [verdict for verdict in review.verdicts if verdict.level in (Level.WARN, Level.BAD)]
    return IndexRow(
        name=review.flight.name,
        link=link,
        failed=len(failed),
        checks=len(review.checks),
        margin=min(margins, default=None),
        level=Level.BAD if failed else max(verdict.level for verdict in review.verdicts),
        words="; ".join(
            [f"{check.name} failed" for check in failed]
            + [f"{each.title}: {each.text}" for each in sorted(troubles, key=lambda each: -each.level)]
        ),
        result=review.result,
        duration_s=review.flight.duration_s,
        distance_m=review.distance_m,
    )


def unreadable_row(name: str, reason: str) -> IndexRow:
    return IndexRow(name, "", 0, 0, None, Level.BAD, reason, "", 0.0, 0.0)


def index_page(rows: Sequence[IndexRow], title: str) -> bytes:
    """The file; its links lead to the pages of the flights."""
    body = "".join(_row(row) for row in sorted(rows, key=lambda row: row.rank))
    head = "".join(
        f"<th>{name}</th>" for name in ("", "flight", "checks", "margin", "result", "time", "way", "what is wrong")
    )
    failed = sum(row.failed > 0 for row in rows)
    summary = f"{len(rows)} flights" + (f", {failed} with failed checks" if failed else "")
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{page_part('review.css')}</style></head><body>"
        f'<header><h1>{escape(title)}</h1><span class="soft">{summary}, the worst first</span></header>'
        f'<main><div class="card scroll"><table id="index"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>'
        "</div></main></body></html>\n"
    ).encode()


def _row(row: IndexRow) -> str:
    name = f'<a href="{escape(row.link)}">{escape(row.name)}</a>' if row.link else escape(row.name)
    checks = f"{row.checks - row.failed} of {row.checks}" if row.checks else "–"
    kind = "fail" if row.failed else "pass" if row.checks else ""
    margin = "–" if row.margin is None else f"{row.margin:.3g}".replace("-", "−")
    way = f"{row.distance_m / 1000.0:.2f} km" if row.distance_m >= LEAST_SHOWN_M else f"{row.distance_m:.0f} m"
    cells = (
        f'<td class="{row.level.name.lower()}"><span class="mark">{MARKS[row.level]}</span></td>',
        f"<td>{name}</td>",
        f'<td class="num {kind}">{checks}</td>',
        f'<td class="num">{margin}</td>',
        f"<td>{escape(row.result)}</td>",
        f'<td class="num">{int(row.duration_s // 60)}:{int(row.duration_s % 60):02}</td>',
        f'<td class="num">{way}</td>',
        f"<td>{escape(row.words)}</td>",
    )
    return f"<tr>{''.join(cells)}</tr>"
