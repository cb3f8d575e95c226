"""A flight that failed, as a report shows it: what was asked, what happened and when, what was heard, how to see it."""

import shlex
from collections.abc import Sequence
from math import isfinite

from mission.scenario.result import CheckResult, ScenarioResult

TEXTS_MAX = 8


def flight_text(result: ScenarioResult, title: str, again: str) -> str:
    """The text.

    Args:
        result: of the flight.
        title: who flew, where, and how long.
        again: the command that flies it again.
    """
    lines = [title]
    if result.error:
        lines.append(f"ended at {result.simulated_s:.1f} s: {result.error.splitlines()[0]}")
    lines += [_check_line(check) for check in result.checks]
    lines += _listed("what was done to it:", result.events)
    lines += _listed("heard last:", result.texts[-TEXTS_MAX:])
    lines.append(f"again: {again}")
    if result.folder:
        lines.append(f"kept in {result.folder}; see it: honeyguide replay {shlex.quote(result.folder)}")
    return "\n".join(lines)


def _check_line(check: CheckResult) -> str:
    margin = f", margin {check.margin:.3g} {check.unit}".rstrip() if isfinite(check.margin) else ""
    return f"{'ok    ' if check.passed else 'FAILED'} {check.name}: asked {check.asked}; {check.happened}{margin}"


def _listed(title: str, events: Sequence[tuple[float, int, str]]) -> list[str]:
    """What happened to or was said by vehicles, a line each."""
    several = len({number for _, number, _ in events} - {0}) > 1
    return [title] * bool(events) + [
        f"  {time_s:7.1f} s  {f'vehicle {number}: ' if several and number else ''}{text}"
        for time_s, number, text in events
    ]
