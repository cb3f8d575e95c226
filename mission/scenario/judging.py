"""Judges a flight by the checks of its scenario, after it, from its history and what was heard and touched.

In: a run that is over, the history of each vehicle. Out: a `CheckResult` for each bound of each check, with its margin
and its worst moment. All by the truth: nothing of it went into the flight.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import inf, isfinite, nan
from typing import Any

import numpy as np
import numpy.typing as npt

from autopilot.interface.vehicle_state import LandedState, Mode
from common.kernels import TICK_US
from mission.log.flight_recorder import History
from mission.log.flight_summary import cross_track_m, curved_items, planned_path, segment_distance_m
from mission.scenario import checks as c
from mission.scenario.conditions import QUANTITIES, Term, terms_of
from mission.scenario.parts import Point
from mission.scenario.quantities import VALUES, Moments, moments_of
from mission.scenario.result import CheckResult
from mission.scenario.run import Run, VehicleRun

Rows = npt.NDArray[Any]
ITEM = "item "  # of a mission, whose moment is when it is reached
CLEARANCE_EVERY = 10  # frames: at 5 Hz
LEVEL = np.array([1.0, 1.0, 0.0])


class NothingToJudge(Exception):
    """The part of the flight that a check looks at is empty; the message says why."""


@dataclass
class Seen:
    """One vehicle's flight, as a check sees it."""

    run: Run
    vehicle: VehicleRun
    history: History
    end_s: float
    others: "Sequence[Seen]" = ()

    @cached_property
    def moments(self) -> Moments:
        return moments_of(self.history, self.vehicle.flight.world)

    @cached_property
    def time_s(self) -> Rows:
        seconds: Rows = self.history.time_us * 1e-6
        return seconds

    @cached_property
    def has_flown(self) -> Rows:
        """While armed; of what was never armed, always."""
        armed = self.history.is_armed
        return armed if armed.any() else np.ones(len(armed), bool)

    def moment(self, given: float | str | None, without: float) -> float:
        """The time of an end of a check's part.

        Raises:
            NothingToJudge: no such mark.
        """
        if given is None:
            return without
        if isinstance(given, str):
            if given.startswith(ITEM):
                found = [at for at, seq in self.vehicle.witness.reached if str(seq) == given.removeprefix(ITEM)]
                if not found:
                    raise NothingToJudge(f"'{given}' was never reached")
                return found[0]
            if given not in self.run.marks:
                raise NothingToJudge(f"'{given}' never came")
            return self.run.marks[given]
        return given

    def ends(self, check: c.Check) -> tuple[float, float]:
        """The part that a check looks at [s]."""
        return self.moment(check.from_, 0.0), self.moment(check.to, inf)

    def frames(self, check: c.Check, *, only_armed: bool = True) -> Rows:
        """Which frames a check looks at.

        Raises:
            NothingToJudge: none.
        """
        start_s, end_s = self.ends(check)
        frames: Rows = (self.time_s >= start_s) & (self.time_s <= end_s)
        if only_armed and check.from_ is None and check.to is None:
            frames = frames & self.has_flown
        if check.during is not None:
            frames = frames & self.history.is_armed & (self.history.mode == int(Mode[check.during.upper()]))
        if not frames.any():
            raise NothingToJudge("there was no such part of the flight")
        return frames


Judged = Iterator[CheckResult]
_Judge = Callable[[Seen, c.Check, Any], Judged]


def judge(run: Run, histories: Sequence[History], end_s: float) -> tuple[CheckResult, ...]:
    """The results of all checks, in their order."""
    flown = [Seen(run, vehicle, history, end_s) for vehicle, history in zip(run.vehicles, histories, strict=True)]
    for seen in flown:
        seen.others = flown
    found: list[CheckResult] = []
    for check in run.scenario.checks:
        is_of_all = check.name_chosen == "separation"
        looked = flown[:1] if is_of_all else [flown[check.vehicle - 1]] if check.vehicle is not None else flown
        for seen in looked:
            who = f"vehicle {seen.vehicle.number}: " if len(flown) > 1 and not is_of_all else ""
            found += [replace(result, name=f"{who}{result.name}") for result in _results(seen, check)]
    return tuple(found)


def _results(seen: Seen, check: c.Check) -> list[CheckResult]:
    title = check.name or check.name_chosen.replace("_", " ")
    try:
        results = list(_JUDGES[check.name_chosen](seen, check, check.chosen))
    except NothingToJudge as nothing:
        return [CheckResult(title, passed=False, asked=_said(check), happened=str(nothing))]
    several = len(results) > 1
    return [replace(r, name=f"{title}: {r.name}" if several and r.name else title) for r in results]


def _said(check: c.Check) -> str:
    given = check.chosen.model_dump(exclude_none=True)
    return ", ".join(f"{key} {value}" for key, value in given.items())


# ---- bounds of arrays ----


def _most(
    name: str, values: Rows, time_s: Rows, bound: float, unit: str, *, percent: float = 100.0, what: str = ""
) -> CheckResult:
    """The largest value, or that of so many percent of the time, is at most the bound."""
    found, worst_s = _worst(values, time_s)
    part = ""
    if percent < 100.0:
        found, part = float(np.percentile(values, percent)), f" for {percent:g} % of the time"
    margin = bound - found
    asked = f"{what or name} at most {bound:g}{_of(unit)}{part}"
    return CheckResult(name, margin >= 0.0, asked, f"{found:.3g}{_of(unit)} at {worst_s:.1f} s", margin, unit, worst_s)


def _least(
    name: str, values: Rows, time_s: Rows, bound: float, unit: str, *, percent: float = 100.0, what: str = ""
) -> CheckResult:
    """The smallest value is at least the bound."""
    found, worst_s = _worst(-values, time_s)
    found, part = -found, ""
    if percent < 100.0:
        found, part = float(np.percentile(values, 100.0 - percent)), f" for {percent:g} % of the time"
    margin = found - bound
    asked = f"{what or name} at least {bound:g}{_of(unit)}{part}"
    return CheckResult(name, margin >= 0.0, asked, f"{found:.3g}{_of(unit)} at {worst_s:.1f} s", margin, unit, worst_s)


def _worst(values: Rows, time_s: Rows) -> tuple[float, float]:
    """The largest value and its time.

    Raises:
        NothingToJudge: none is finite.
    """
    finite = np.isfinite(values)
    if not finite.any():
        if len(values) and np.isinf(values).all():
            return float(values[0]), float(time_s[0])
        raise NothingToJudge("there was nothing to measure")
    at = int(np.argmax(np.where(finite, values, -inf)))
    return float(values[at]), float(time_s[at])


def _of(unit: str) -> str:
    return f" {unit}" if unit else ""


# ---- the checks ----


def _range_of(quantity: str) -> _Judge:
    unit = QUANTITIES[quantity][0]

    def judged(seen: Seen, check: c.Check, asked: c.Range) -> Judged:
        frames = seen.frames(check)
        values, time_s = VALUES[quantity](seen.moments)[frames].astype(float), seen.time_s[frames]
        what = quantity.replace("_", " ")
        if asked.min is not None:
            yield _least("least", values, time_s, asked.min, unit, what=what)
        if asked.max is not None:
            yield _most("most", values, time_s, asked.max, unit, what=what)

    return judged


def _corridor(seen: Seen, check: c.Check, asked: c.Corridor) -> Judged:
    level = LEVEL if asked.is_level or seen.vehicle.flight.drives else np.ones(3)
    history = seen.history
    if asked.line is not None:
        frames = seen.frames(check)
        points = history.pos_ned_true[frames].astype(float) * level
        line = [np.array(point, float) * level for point in asked.line]
        legs = [segment_distance_m(points, a, b) for a, b in pairwise(line)]
        distance: Rows = np.min(legs, axis=0)
    else:
        plan, config = seen.vehicle.plan, seen.vehicle.flight.config
        if plan is None:
            raise NothingToJudge("it flew no mission")
        frames = seen.frames(check) & (history.mode == int(Mode.MISSION))
        path = [(seq, point * level) for seq, point in planned_path(plan, config.home, config.start_ne_m)]
        points = history.pos_ned_true[frames].astype(float) * level
        distance = cross_track_m(points, history.mission_seq[frames], path, curved_items(plan))
    is_leg = np.isfinite(distance)
    if not is_leg.any():
        raise NothingToJudge("it flew no leg")
    time_s = seen.time_s[frames][is_leg]
    yield _most("distance", distance[is_leg], time_s, asked.within_m, "m", percent=asked.percent, what="off the line")


def _distances(seen: Seen, frames: Rows, point: Point, *, is_level: bool) -> Rows:
    offset = seen.history.pos_ned_true[frames].astype(float) - np.array(point)
    distances: Rows = np.linalg.norm(offset[:, :2] if is_level else offset, axis=1)
    return distances


def _near(seen: Seen, check: c.Check, asked: c.Near) -> Judged:
    frames = seen.frames(check)
    if asked.to_vehicle is None:
        distance = _distances(seen, frames, asked.point or (0.0, 0.0, 0.0), is_level=asked.is_level)
        yield _most("distance", distance, seen.time_s[frames], asked.within_m, "m", what="from the point")
        return
    other = seen.others[asked.to_vehicle - 1].history
    _, mine, theirs = np.intersect1d(seen.history.time_us[frames], other.time_us, return_indices=True)
    offset = seen.history.pos_ned_true[frames][mine].astype(float) - other.pos_ned_true[theirs]
    gap = np.linalg.norm(offset[:, :2] if asked.is_level else offset, axis=1)
    what = f"from vehicle {asked.to_vehicle}"
    yield _most("distance", gap, seen.time_s[frames][mine], asked.within_m, "m", what=what)


def _away(seen: Seen, check: c.Check, asked: c.Away) -> Judged:
    frames = seen.frames(check)
    distance = _distances(seen, frames, asked.point, is_level=asked.is_level)
    yield _least("distance", distance, seen.time_s[frames], asked.min_m, "m", what="from the point")


def _arrives(seen: Seen, check: c.Check, asked: c.Arrives) -> Judged:
    frames = seen.frames(check)
    time_s, start_s = seen.time_s[frames], seen.ends(check)[0]
    distance = _distances(seen, frames, asked.point, is_level=asked.is_level)
    nearest = int(np.argmin(distance))
    margin = asked.within_m - float(distance[nearest])
    happened = f"nearest {distance[nearest]:.3g} m at {time_s[nearest]:.1f} s"
    yield CheckResult("distance", margin >= 0.0, f"within {asked.within_m:g} m of the point", happened, margin, "m",
                      float(time_s[nearest]))  # fmt: skip
    if asked.before_s is not None:
        inside = np.flatnonzero(distance <= asked.within_m)
        took_s = float(time_s[inside[0]]) - start_s if len(inside) else inf
        happened = f"after {took_s:.1f} s" if len(inside) else "never"
        worst_s = float(time_s[inside[0]]) if len(inside) else nan
        spare_s = asked.before_s - took_s
        yield CheckResult("time", spare_s >= 0.0, f"there after {asked.before_s:g} s", happened, spare_s, "s", worst_s)


_ERRORS = {
    "horizontal_m": ("position_error", "horizontal"),
    "vertical_m": ("height_error", "vertical"),
    "velocity_m_s": ("velocity_error", "velocity"),
    "tilt_deg": ("tilt_error", "tilt"),
    "heading_deg": ("heading_error", "heading"),
}


def _estimator(seen: Seen, check: c.Check, asked: c.Estimator) -> Judged:
    frames = seen.frames(check)
    for key, (quantity, name) in _ERRORS.items():
        bound = getattr(asked, key)
        if bound is not None:
            values, unit = VALUES[quantity](seen.moments)[frames], QUANTITIES[quantity][0]
            what = f"{name} error of the estimate"
            yield _most(name, values, seen.time_s[frames], bound, unit, percent=asked.percent, what=what)


def _clearance(seen: Seen, check: c.Check, asked: c.Clearance) -> Judged:
    frames = np.flatnonzero(seen.frames(check))[::CLEARANCE_EVERY]
    points, world = seen.history.pos_ned_true[frames].astype(float), seen.vehicle.flight.world
    if world.boxes.rows["period_ticks"].any():  # what moves is somewhere else at each moment
        ticks = seen.history.time_us[frames] // TICK_US
        nearest = np.array([float(world.obstacle_distance(p, int(t))) for p, t in zip(points, ticks, strict=True)])
    else:
        nearest = world.obstacle_distance(points)
    yield _least("clearance", nearest, seen.time_s[frames], asked.min_m, "m", what="clearance")


def _separation(seen: Seen, check: c.Check, asked: c.Separation) -> Judged:
    fleet = seen.others
    if len(fleet) < 2:
        raise NothingToJudge("there is one vehicle")
    count = min(len(each.history.time_us) for each in fleet)
    start_s, end_s = seen.ends(check)
    armed = [each.history.is_armed[:count] for each in fleet]
    places = [each.history.pos_ned_true[:count].astype(float) for each in fleet]
    time_s = seen.time_s[:count]
    nearest = np.full(count, inf)
    for i in range(len(fleet)):
        for k in range(i):
            both = armed[i] & armed[k]
            gap = np.linalg.norm(places[i] - places[k], axis=1)
            nearest = np.where(both, np.minimum(nearest, gap), nearest)
    frames = (time_s >= start_s) & (time_s <= end_s) & np.isfinite(nearest)
    if not frames.any():
        raise NothingToJudge("no two were armed together")
    yield _least("separation", nearest[frames], time_s[frames], asked.min_m, "m", what="separation")


def _duration(seen: Seen, check: c.Check, asked: c.Duration) -> Judged:
    start_s, end_s = seen.ends(check)
    took = np.array([min(end_s, seen.end_s) - start_s])
    at = np.array([min(end_s, seen.end_s)])
    if asked.min_s is not None:
        yield _least("least", took, at, asked.min_s, "s", what="duration")
    if asked.max_s is not None:
        yield _most("most", took, at, asked.max_s, "s", what="duration")


def _modes(seen: Seen, check: c.Check, asked: c.Modes) -> Judged:
    start_s, end_s = seen.ends(check)
    frames = seen.history.is_armed & (seen.time_s >= start_s) & (seen.time_s <= end_s)
    modes, time_s = seen.history.mode[frames], seen.time_s[frames]
    if not len(modes):
        raise NothingToJudge("it was never armed")
    firsts = np.concatenate([[0], np.flatnonzero(np.diff(modes)) + 1])
    had = [Mode(int(modes[k])).name.lower() for k in firsts]
    wanted = list(asked.order)
    if asked.is_exact:
        is_so = had == wanted
    else:
        left = iter(had)
        is_so = all(mode in left for mode in wanted)
    shown = ", ".join(f"{mode} ({time_s[k]:.1f} s)" for mode, k in zip(had, firsts, strict=True))
    exactly = "exactly " if asked.is_exact else ""
    yield CheckResult("modes", is_so, f"{exactly}{', '.join(wanted)}", shown)


def _texts(seen: Seen, check: c.Check, text: str) -> list[tuple[float, str]]:
    start_s, end_s = seen.ends(check)
    said = seen.vehicle.witness.texts
    return [(at, each) for at, each in said if start_s <= at <= end_s and text.lower() in each.lower()]


def _heard(seen: Seen, check: c.Check, asked: c.Heard) -> Judged:
    found, start_s = _texts(seen, check, asked.text), seen.ends(check)[0]
    if not found:
        last = seen.vehicle.witness.texts[-3:]
        shown = "; ".join(text for _, text in last) or "nothing"
        yield CheckResult("heard", passed=False, asked=f"says '{asked.text}'", happened=f"never; last it said: {shown}")
        return
    at, text = found[0]
    spare_s = nan if asked.before_s is None else asked.before_s - (at - start_s)
    within = "" if asked.before_s is None else f" within {asked.before_s:g} s"
    yield CheckResult("heard", not spare_s < 0.0, f"says '{asked.text}'{within}", f"'{text}' at {at:.1f} s", spare_s,
                      "s" if isfinite(spare_s) else "", at)  # fmt: skip


def _not_heard(seen: Seen, check: c.Check, asked: c.NotHeard) -> Judged:
    found = _texts(seen, check, asked.text)
    at, happened = (found[0][0], f"'{found[0][1]}' at {found[0][0]:.1f} s") if found else (nan, "it did not")
    yield CheckResult("not heard", not found, f"does not say '{asked.text}'", happened, worst_s=at)


def _battery(seen: Seen, check: c.Check, asked: c.Battery) -> Judged:
    frames = seen.frames(check, only_armed=False)
    left, time_s = seen.history.battery_remaining[frames], seen.time_s[frames]
    known = np.isfinite(left)
    if not known.any():
        raise NothingToJudge("the charge was never known")
    left, time_s = left[known], time_s[known]
    battery = seen.vehicle.flight.airframe.battery
    used_mah = (left[0] - left) * battery.capacity_mah
    if asked.used_max_mah is not None:
        yield _most("charge", used_mah, time_s, asked.used_max_mah, "mAh", what="used")
    if asked.used_max_wh is not None:
        volts = battery.cells * 0.5 * (battery.full_cell_v + battery.empty_cell_v)
        yield _most("energy", used_mah * 1e-3 * volts, time_s, asked.used_max_wh, "Wh", what="used")
    if asked.remaining_min is not None:
        yield _least("remaining", left, time_s, asked.remaining_min, "", what="remaining")


def _at_end(seen: Seen, _: c.Check, asked: c.AtEnd) -> Judged:
    flight, history = seen.vehicle.flight, seen.history
    state = flight.controller.state
    is_so = {
        "armed": (asked.is_armed, bool(history.is_armed[-1])),
        "landed": (asked.is_landed, state.landed_state is LandedState.ON_GROUND),
        "crashed": (asked.is_crashed, flight.is_crashed),
    }
    for name, (wanted, found) in is_so.items():
        if wanted is not None:
            yield CheckResult(
                name, wanted == found, _yes(name, is_it=wanted), _yes(name, is_it=found), worst_s=seen.end_s
            )
    if asked.near is not None:
        distance = np.linalg.norm(history.pos_ned_true[-1:, :2].astype(float) - np.array(asked.near), axis=1)
        yield _most("place", distance, seen.time_s[-1:], asked.within_m, "m", what="from the place")


def _yes(name: str, *, is_it: bool) -> str:
    return name if is_it else f"not {name}"


def _reached(seen: Seen, check: c.Check, asked: c.Reached) -> Judged:
    start_s, end_s = seen.ends(check)
    found = [at for at, seq in seen.vehicle.witness.reached if seq == asked.item and start_s <= at <= end_s]
    others = ", ".join(str(seq) for _, seq in seen.vehicle.witness.reached) or "none"
    happened = f"at {found[0]:.1f} s" if found else f"never; reached: {others}"
    yield CheckResult(
        "reached", bool(found), f"item {asked.item} is reached", happened, worst_s=found[0] if found else nan
    )


def _room(seen: Seen, term: Term, frames: Rows) -> Rows:
    room: Rows = term.room(VALUES[term.quantity](seen.moments)[frames].astype(float))
    return room


def _always(seen: Seen, check: c.Check, asked: c.Always) -> Judged:
    frames = seen.frames(check)
    time_s = seen.time_s[frames]
    for term in terms_of(asked.condition):
        said = f"{term.quantity} {term.operator} {term.number:g}"
        room = _room(seen, term, frames)
        at = int(np.argmin(room))
        margin = float(room[at]) if asked.percent >= 100.0 else float(np.percentile(room, 100.0 - asked.percent))
        value = float(VALUES[term.quantity](seen.moments)[frames][at])
        unit = QUANTITIES[term.quantity][0]
        part = f" for {asked.percent:g} % of the time" if asked.percent < 100.0 else ""
        is_so = margin > 0.0 if term.operator in ("<", ">") else margin >= 0.0
        yield CheckResult(said, is_so, f"always {said}{part}", f"{value:.3g}{_of(unit)} at {time_s[at]:.1f} s", margin,
                          unit, float(time_s[at]))  # fmt: skip


def _once(seen: Seen, check: c.Check, asked: c.Once) -> Judged:
    frames = seen.frames(check)
    time_s, terms = seen.time_s[frames], terms_of(asked.condition)
    rooms = np.array([_room(seen, term, frames) for term in terms])
    holds = np.all([term.holds(VALUES[term.quantity](seen.moments)[frames]) for term in terms], axis=0)
    least = rooms.min(axis=0)
    at = int(np.flatnonzero(holds)[0]) if holds.any() else int(np.argmax(least))
    happened = f"at {time_s[at]:.1f} s" if holds.any() else f"never; nearest at {time_s[at]:.1f} s"
    unit = QUANTITIES[terms[0].quantity][0] if len(terms) == 1 else ""
    yield CheckResult("once", bool(holds.any()), f"once {asked.condition}", happened, float(least.max()), unit,
                      float(time_s[at]))  # fmt: skip


def _no_contact(seen: Seen, check: c.Check, asked: c.NoContact) -> Judged:
    start_s, end_s = seen.ends(check)
    touches = [(at, speed) for at, speed, is_ground in seen.vehicle.witness.touches
               if not is_ground and start_s <= at <= end_s]  # fmt: skip
    at, speed = max(touches, key=lambda touch: touch[1], default=(nan, 0.0))
    happened = f"{speed:.2g} m/s at {at:.1f} s" if touches else "none"
    asked_text = f"touches at most {asked.max_m_s:g} m/s hard" if asked.max_m_s > 0.0 else "touches nothing"
    margin = asked.max_m_s - speed
    yield CheckResult("contact", margin >= 0.0, asked_text, happened, margin, "m/s", at)


def _touch_down(seen: Seen, check: c.Check, asked: c.TouchDown) -> Judged:
    start_s, end_s = seen.ends(check)
    touches = [(at, speed) for at, speed, is_ground in seen.vehicle.witness.touches
               if is_ground and start_s <= at <= end_s]  # fmt: skip
    if not touches:
        raise NothingToJudge("it never touched the ground")
    time_s, speed = (np.array(column) for column in zip(*touches, strict=True))
    yield _most("touch down", speed, time_s, asked.max_m_s, "m/s", what="touches the ground")


def _following(seen: Seen, check: c.Check, asked: c.Following) -> Judged:
    del check
    from mission.scenario.policy_figures import following

    track = None if seen.run.watch is None else seen.run.watch.track()
    if track is None:
        raise NothingToJudge("no policy followed")
    yield from following(track, asked)


def _interventions(seen: Seen, _: c.Check, asked: c.Interventions) -> Judged:
    companion = seen.run.companion
    if companion is None:
        raise NothingToJudge("no policy flew")
    per_min = 60.0 * sum((companion.skill.interventions or {}).values()) / max(seen.end_s, 1.0)
    margin = asked.max_per_min - per_min
    yield CheckResult("interventions", margin >= 0.0, f"at most {asked.max_per_min:g} per minute", f"{per_min:.3g}",
                      margin, "/min")  # fmt: skip


_JUDGES: dict[str, _Judge] = {
    **{name: _range_of(name) for name in ("altitude", "above_ground", "speed", "climb", "tilt", "airspeed")},
    "corridor": _corridor,
    "near": _near,
    "away": _away,
    "arrives": _arrives,
    "estimator": _estimator,
    "clearance": _clearance,
    "separation": _separation,
    "duration": _duration,
    "modes": _modes,
    "heard": _heard,
    "not_heard": _not_heard,
    "battery": _battery,
    "at_end": _at_end,
    "reached": _reached,
    "always": _always,
    "once": _once,
    "no_contact": _no_contact,
    "touch_down": _touch_down,
    "following": _following,
    "interventions": _interventions,
}
