"""Checks of what happens: time, modes, texts, charge, the end, conditions, touches, and how a policy does."""

from math import isfinite, isinf, nan
from typing import Any

import numpy as np

from autopilot.interface.vehicle_state import LandedState, Mode
from mission.scenario.flight.quantities import VALUES
from mission.scenario.judging.seen import Judged, NothingToJudge, Rows, Seen, least, most, unit_of
from mission.scenario.parts import checks as c
from mission.scenario.parts.conditions import QUANTITIES, Term, terms_of
from mission.scenario.result import CheckResult

BUSY_S = 10.0  # within which the most interventions are looked for


def duration(seen: Seen, check: c.Check, asked: c.Duration) -> Judged:
    """How long it takes."""
    start_s, end_s = seen.ends(check)
    took = np.array([min(end_s, seen.end_s) - start_s])
    at = np.array([min(end_s, seen.end_s)])
    if check.during is not None:  # however often it was in that mode
        frames = seen.frames(check)
        took, at = np.diff(seen.time_s, prepend=0.0)[frames].sum(keepdims=True), seen.time_s[frames][-1:]
    if asked.min_s is not None:
        yield least("least", took, at, asked.min_s, "s", what="duration")
    if asked.max_s is not None:
        yield most("most", took, at, asked.max_s, "s", what="duration")


def modes(seen: Seen, check: c.Check, asked: c.Modes) -> Judged:
    """Which flight modes it had, in which order."""
    start_s, end_s = seen.ends(check)
    frames = seen.history.is_armed & (seen.time_s >= start_s) & (seen.time_s <= end_s)
    modes, time_s = seen.history.mode[frames], seen.time_s[frames]
    if not len(modes):
        raise NothingToJudge("it was not armed then" if seen.history.is_armed.any() else "it was never armed")
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
    said = seen.happened(check, seen.vehicle.witness.texts)
    return [(at, each) for at, each in said if text.lower() in each.lower()]


def heard(seen: Seen, check: c.Check, asked: c.Heard) -> Judged:
    """What it said."""
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


def not_heard(seen: Seen, check: c.Check, asked: c.NotHeard) -> Judged:
    """What it did not say."""
    found = _texts(seen, check, asked.text)
    at, happened = (found[0][0], f"'{found[0][1]}' at {found[0][0]:.1f} s") if found else (nan, "it did not")
    yield CheckResult("not heard", not found, f"does not say '{asked.text}'", happened, worst_s=at)


def battery(seen: Seen, check: c.Check, asked: c.Battery) -> Judged:
    """What it took from the battery."""
    frames = seen.frames(check, only_armed=False)
    left, time_s = seen.history.battery_remaining[frames], seen.time_s[frames]
    known = np.isfinite(left)
    if not known.any():
        raise NothingToJudge("the charge was never known")
    left, time_s = left[known], time_s[known]
    battery = seen.vehicle.flight.airframe.battery
    used_mah = (left[0] - left) * battery.capacity_mah
    if asked.used_max_mah is not None:
        yield most("charge", used_mah, time_s, asked.used_max_mah, "mAh", what="used")
    if asked.used_max_wh is not None:
        volts = battery.cells * 0.5 * (battery.full_cell_v + battery.empty_cell_v)
        yield most("energy", used_mah * 1e-3 * volts, time_s, asked.used_max_wh, "Wh", what="used")
    if asked.remaining_min is not None:
        yield least("remaining", left, time_s, asked.remaining_min, "", what="remaining")


def at_end(seen: Seen, _: c.Check, asked: c.AtEnd) -> Judged:
    """How it stands in the end."""
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
        yield most("place", distance, seen.time_s[-1:], asked.within_m, "m", what="from the place")


def _yes(name: str, *, is_it: bool) -> str:
    return name if is_it else f"not {name}"


def reached(seen: Seen, check: c.Check, asked: c.Reached) -> Judged:
    """Which items of its mission it reached."""
    found = [at for at, seq in seen.happened(check, seen.vehicle.witness.reached) if seq == asked.item]
    others = ", ".join(str(seq) for _, seq in seen.vehicle.witness.reached) or "none"
    happened = f"at {found[0]:.1f} s" if found else f"never; reached: {others}"
    yield CheckResult(
        "reached", bool(found), f"item {asked.item} is reached", happened, worst_s=found[0] if found else nan
    )


def _room(seen: Seen, term: Term, frames: Rows) -> Rows:
    room: Rows = term.room(VALUES[term.quantity](seen.moments)[frames].astype(float))
    return room


def always(seen: Seen, check: c.Check, asked: c.Always) -> Judged:
    """Whether a condition holds all the time."""
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
        happened = f"{value:.3g}{unit_of(unit)} at {time_s[at]:.1f} s"
        is_so = margin > 0.0 if term.operator in ("<", ">") else margin >= 0.0
        yield CheckResult(said, is_so, f"always {said}{part}", happened, margin, unit,
                          float(time_s[at]))  # fmt: skip


def once(seen: Seen, check: c.Check, asked: c.Once) -> Judged:
    """Whether a condition holds at some time."""
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


def no_contact(seen: Seen, check: c.Check, asked: c.NoContact) -> Judged:
    """What it touched."""
    happened = seen.happened(check, seen.vehicle.witness.touches)
    touches = [(at, speed) for at, speed, is_ground in happened if not is_ground]
    at, speed = max(touches, key=lambda touch: touch[1], default=(nan, 0.0))
    shown = f"{speed:.2g} m/s at {at:.1f} s" if touches else "none"
    asked_text = f"touches at most {asked.max_m_s:g} m/s hard" if asked.max_m_s > 0.0 else "touches nothing"
    margin = asked.max_m_s - speed
    yield CheckResult("contact", margin >= 0.0, asked_text, shown, margin, "m/s", at)


def touch_down(seen: Seen, check: c.Check, asked: c.TouchDown) -> Judged:
    """How hard it touched the ground."""
    happened = seen.happened(check, seen.vehicle.witness.touches)
    touches = [(at, speed) for at, speed, is_ground in happened if is_ground and at >= seen.first_flown_s]
    if not touches:
        never = isinf(seen.first_flown_s)
        raise NothingToJudge("it never flew" if never else "it never touched the ground after it flew")
    time_s, speed = (np.array(column) for column in zip(*touches, strict=True))
    yield most("touch down", speed, time_s, asked.max_m_s, "m/s", what="touches the ground")


def following(seen: Seen, check: c.Check, asked: c.Following) -> Judged:
    """How its policy followed."""
    del check
    from mission.scenario.judging.policy_figures import following_figures

    yield from following_figures(*_followed(seen), asked)


def scorecard(seen: Seen, check: c.Check, asked: dict[c.FigureName, c.Range]) -> Judged:
    """Figures of the scorecard."""
    del check
    from mission.scenario.judging.policy_figures import scorecard_figures

    yield from scorecard_figures(*_followed(seen), asked)


def _followed(seen: Seen) -> tuple[Any, Rows]:
    """The track, and the simulated time of each of its samples."""
    watch = seen.run.watch
    track = None if watch is None else watch.track()
    if track is None:
        raise NothingToJudge("no policy followed")
    return track, watch.sampled_s


def interventions(seen: Seen, _: c.Check, asked: c.Interventions) -> Judged:
    """How often the guard changed its policy's decisions."""
    companion = seen.run.companion
    if companion is None:
        raise NothingToJudge("no policy flew")
    time_s = np.array(seen.vehicle.witness.changes)
    per_min = 60.0 * len(time_s) / max(seen.end_s, 1.0)
    margin = asked.max_per_min - per_min
    worst_s = busiest_s(time_s)
    happened = f"{per_min:.3g}" + (f", most by {worst_s:.1f} s" if len(time_s) else "")
    yield CheckResult("interventions", margin >= 0.0, f"at most {asked.max_per_min:g} per minute", happened,
                      margin, "/min", worst_s)  # fmt: skip


def busiest_s(time_s: Rows) -> float:
    """When the most of some moments, in order, had come within ten seconds; NaN: there are none."""
    if not len(time_s):
        return nan
    just_before = np.arange(len(time_s)) - np.searchsorted(time_s, time_s - BUSY_S)
    return float(time_s[int(np.argmax(just_before))])


MEASURED = {
    "park_distance_m": ("park distance", "m"),
    "park_turn_deg": ("park turn", "deg"),
    "park_s": ("park time", "s"),
    "policy_goto_s": ("goto time", "s"),
}


def figures(seen: Seen, _: c.Check, asked: dict[c.MeasuredName, c.Range]) -> Judged:
    """What its policy's steps have measured."""
    run = seen.run
    for name, bounds in asked.items():
        title, unit = MEASURED[name]
        if name not in run.figures:
            raise NothingToJudge(f"{name} was never measured")
        value, at = np.array([run.figures[name]]), np.array([run.measured_s[name]])
        if bounds.min is not None:
            yield least(title, value, at, bounds.min, unit)
        if bounds.max is not None:
            yield most(title, value, at, bounds.max, unit)
