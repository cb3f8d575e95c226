"""Judges a flight by the checks of its scenario, after it.

In: a run that is over, the history of each vehicle. Out: a `CheckResult` for each bound of each check, with its margin
and its worst moment.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from mission.log.flight_recorder import History
from mission.scenario.flight.run import Run
from mission.scenario.judging import event_checks, motion_checks
from mission.scenario.judging.seen import Judged, NothingToJudge, Seen
from mission.scenario.parts import checks as c
from mission.scenario.result import CheckResult

Judge = Callable[[Seen, c.Check, Any], Judged]


def judge(run: Run, histories: Sequence[History], end_s: float) -> tuple[CheckResult, ...]:
    """The results of all checks, in their order."""
    flown = [Seen(run, vehicle, history, end_s) for vehicle, history in zip(run.vehicles, histories, strict=True)]
    for seen in flown:
        seen.others = flown
    found: list[CheckResult] = []
    for check in run.scenario.checks:
        is_of_all = check.name_chosen == "separation"
        looked = [flown[(check.vehicle or 1) - 1]] if is_of_all or check.vehicle is not None else flown
        for seen in looked:
            who = f"vehicle {seen.vehicle.number}: " if len(flown) > 1 and not is_of_all else ""
            found += [replace(result, name=f"{who}{result.name}") for result in _results(seen, check)]
    return tuple(found)


def _results(seen: Seen, check: c.Check) -> list[CheckResult]:
    title = check.title
    try:
        results = list(JUDGES[check.name_chosen](seen, check, check.chosen))
    except NothingToJudge as nothing:
        return [CheckResult(title, passed=False, asked=_said(check), happened=str(nothing))]
    several = len(results) > 1
    return [replace(r, name=f"{title}: {r.name}" if several and r.name else title) for r in results]


def _said(check: c.Check) -> str:
    given = check.model_dump(include={check.name_chosen}, exclude_none=True)[check.name_chosen]
    return ", ".join(f"{key} {_words(value)}" for key, value in given.items())


def _words(value: Any) -> str:
    return " ".join(f"{key} {each:g}" for key, each in value.items()) if isinstance(value, dict) else str(value)


JUDGES: dict[str, Judge] = {
    **{
        name: motion_checks.range_of(name)
        for name in ("altitude", "above_ground", "speed", "climb", "tilt", "airspeed")
    },
    "corridor": motion_checks.corridor,
    "near": motion_checks.near,
    "away": motion_checks.away,
    "arrives": motion_checks.arrives,
    "estimator": motion_checks.estimator,
    "clearance": motion_checks.clearance,
    "separation": motion_checks.separation,
    "duration": event_checks.duration,
    "modes": event_checks.modes,
    "heard": event_checks.heard,
    "not_heard": event_checks.not_heard,
    "battery": event_checks.battery,
    "at_end": event_checks.at_end,
    "reached": event_checks.reached,
    "always": event_checks.always,
    "once": event_checks.once,
    "no_contact": event_checks.no_contact,
    "touch_down": event_checks.touch_down,
    "following": event_checks.following,
    "scorecard": event_checks.scorecard,
    "interventions": event_checks.interventions,
    "figures": event_checks.figures,
}
