"""Checks of where a vehicle is and how it moves."""

from collections.abc import Callable
from itertools import combinations, pairwise
from math import inf, nan
from typing import Any

import numpy as np

from autopilot.interface.vehicle_state import Mode
from common.kernels import TICK_US
from mission.log.flight_recorder import History
from mission.log.flight_summary import cross_track_m, curved_items, planned_path, segment_distance_m
from mission.scenario.flight.quantities import VALUES
from mission.scenario.judging.seen import Judged, NothingToJudge, Rows, Seen, least, most
from mission.scenario.parts import checks as c
from mission.scenario.parts.conditions import QUANTITIES
from mission.scenario.parts.part import Point
from mission.scenario.result import CheckResult

CLEARANCE_EVERY = 10  # frames: at 5 Hz
LEVEL = np.array([1.0, 1.0, 0.0])


def range_of(quantity: str) -> Callable[[Seen, c.Check, Any], Judged]:
    """The check of a quantity's bounds."""
    unit = QUANTITIES[quantity][0]

    def judged(seen: Seen, check: c.Check, asked: c.Range) -> Judged:
        frames = seen.frames(check)
        values, time_s = VALUES[quantity](seen.moments)[frames].astype(float), seen.time_s[frames]
        what = quantity.replace("_", " ")
        if asked.min is not None:
            yield least("least", values, time_s, asked.min, unit, what=what)
        if asked.max is not None:
            yield most("most", values, time_s, asked.max, unit, what=what)

    return judged


def corridor(seen: Seen, check: c.Check, asked: c.Corridor) -> Judged:
    """How far it is off its line."""
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
    yield most("distance", distance[is_leg], time_s, asked.within_m, "m", percent=asked.percent, what="off the line")


def _distances(seen: Seen, frames: Rows, point: Point, *, is_level: bool) -> Rows:
    offset = seen.history.pos_ned_true[frames].astype(float) - np.array(point)
    distances: Rows = np.linalg.norm(offset[:, :2] if is_level else offset, axis=1)
    return distances


def near(seen: Seen, check: c.Check, asked: c.Near) -> Judged:
    """How far it is from a point or a vehicle."""
    frames = seen.frames(check, only_armed=check.from_ is None)
    if asked.to_vehicle is None:
        distance = _distances(seen, frames, asked.point or (0.0, 0.0, 0.0), is_level=asked.is_level)
        yield most("distance", distance, seen.time_s[frames], asked.within_m, "m", what="from the point")
        return
    other = seen.others[asked.to_vehicle - 1].history
    _, mine, theirs = np.intersect1d(seen.history.time_us[frames], other.time_us, return_indices=True)
    offset = seen.history.pos_ned_true[frames][mine].astype(float) - other.pos_ned_true[theirs]
    gap = np.linalg.norm(offset[:, :2] if asked.is_level else offset, axis=1)
    what = f"from vehicle {asked.to_vehicle}"
    yield most("distance", gap, seen.time_s[frames][mine], asked.within_m, "m", what=what)


def away(seen: Seen, check: c.Check, asked: c.Away) -> Judged:
    """How near it comes to a point."""
    frames = seen.frames(check)
    distance = _distances(seen, frames, asked.point, is_level=asked.is_level)
    yield least("distance", distance, seen.time_s[frames], asked.min_m, "m", what="from the point")


def arrives(seen: Seen, check: c.Check, asked: c.Arrives) -> Judged:
    """Whether, and when, it comes to a point."""
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


def estimator(seen: Seen, check: c.Check, asked: c.Estimator) -> Judged:
    """How far the estimate is from the truth."""
    frames = seen.frames(check)
    for key, (quantity, name) in _ERRORS.items():
        bound = getattr(asked, key)
        if bound is not None:
            values, unit = VALUES[quantity](seen.moments)[frames], QUANTITIES[quantity][0]
            what = f"{name} error of the estimate"
            yield most(name, values, seen.time_s[frames], bound, unit, percent=asked.percent, what=what)


def clearance(seen: Seen, check: c.Check, asked: c.Clearance) -> Judged:
    """How near it comes to what stands in the world."""
    frames = np.flatnonzero(seen.frames(check))[::CLEARANCE_EVERY]
    points, world = seen.history.pos_ned_true[frames].astype(float), seen.vehicle.flight.world
    if world.boxes.rows["period_ticks"].any():  # what moves is somewhere else at each moment
        ticks = seen.history.time_us[frames] // TICK_US
        nearest = np.array([float(world.obstacle_distance(p, int(t))) for p, t in zip(points, ticks, strict=True)])
    else:
        nearest = world.obstacle_distance(points)
    yield least("clearance", nearest, seen.time_s[frames], asked.min_m, "m", what="clearance")


def separation(seen: Seen, check: c.Check, asked: c.Separation) -> Judged:
    """How near vehicles come to each other, or all others to one."""
    fleet = seen.others
    if len(fleet) < 2:
        raise NothingToJudge("there is one vehicle")
    start_s, end_s = seen.ends(check)
    gaps, times_s = [], []
    for one, other in combinations(fleet, 2):
        if check.vehicle in (None, one.vehicle.number, other.vehicle.number):
            mine, theirs = _together(one.history, other.history)
            time_s = one.time_s[mine]
            both = one.history.is_armed[mine] & other.history.is_armed[theirs] & (time_s >= start_s) & (time_s <= end_s)
            offset = one.history.pos_ned_true[mine][both].astype(float) - other.history.pos_ned_true[theirs][both]
            gaps.append(np.linalg.norm(offset, axis=1))
            times_s.append(time_s[both])
    gap = np.concatenate(gaps)
    if not len(gap):
        raise NothingToJudge("no two were armed together")
    yield least("separation", gap, np.concatenate(times_s), asked.min_m, "m", what="separation")


def _together(one: History, other: History) -> tuple[Rows | slice, Rows | slice]:
    """The frames of both that are of one time: of who stands for minutes few are kept."""
    if np.array_equal(one.time_us, other.time_us):
        return slice(None), slice(None)
    _, mine, theirs = np.intersect1d(one.time_us, other.time_us, assume_unique=True, return_indices=True)
    return mine, theirs
