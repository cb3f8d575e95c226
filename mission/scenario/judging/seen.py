"""A flight as checks see it: the history of one vehicle, cut to the part that is looked at, and bounds of its arrays.

All is looked at after the flight, and by the truth: nothing of it went into the flight.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from autopilot.interface.vehicle_state import Mode
from mission.log.flight_recorder import History
from mission.scenario.flight.quantities import VALUES, Moments, moments_of
from mission.scenario.flight.run import TOUCH_HEIGHT_M, Run, VehicleRun
from mission.scenario.parts import checks as c
from mission.scenario.result import CheckResult
from mission.scenario.scenario import ITEM_MARK

Rows = npt.NDArray[Any]
NO_PART = "there was no such part of the flight"
Judged = Iterator[CheckResult]
Event = TypeVar("Event", bound=tuple[Any, ...])


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

    @cached_property
    def first_flown_s(self) -> float:
        """When it was higher than where it stood first; inf: never."""
        heights = VALUES["above_ground"](self.moments)
        up = np.flatnonzero(heights > heights[0] + TOUCH_HEIGHT_M)
        return float(self.time_s[up[0]]) if len(up) else inf

    def moment(self, given: float | str | None, without: float) -> float:
        """The time of an end of a check's part.

        Raises:
            NothingToJudge: no such mark.
        """
        if given is None:
            return without
        if isinstance(given, str):
            if given.startswith(ITEM_MARK):
                found = [at for at, seq in self.vehicle.witness.reached if str(seq) == given.removeprefix(ITEM_MARK)]
                if not found:
                    raise NothingToJudge(f"'{given}' was never reached")
                return found[0]
            if given not in self.run.marks:
                raise NothingToJudge(f"'{given}' never came")
            return self.run.marks[given]
        return given

    def ends(self, check: c.Check) -> tuple[float, float]:
        """The part that a check looks at [s].

        Raises:
            NothingToJudge: it begins after the flight's end, or after its own.
        """
        start_s, end_s = self.moment(check.from_, 0.0), self.moment(check.to, inf)
        if start_s > min(end_s, self.end_s):
            raise NothingToJudge(NO_PART)
        return start_s, end_s

    def frames(self, check: c.Check, *, only_armed: bool = True) -> Rows:
        """Which frames a check looks at.

        Raises:
            NothingToJudge: none.
        """
        start_s, end_s = self.ends(check)
        frames: Rows = (self.time_s >= start_s) & (self.time_s <= end_s)
        if only_armed:
            frames = frames & self.has_flown
        if check.during is not None:
            frames = frames & self.history.is_armed & (self.history.mode == int(Mode[check.during.upper()]))
        if not frames.any():
            raise NothingToJudge(NO_PART)
        return frames

    def happened(self, check: c.Check, events: Sequence[Event]) -> list[Event]:
        """Of events, which begin with their time [s], those in the part that a check looks at.

        Raises:
            NothingToJudge: there was no such part.
        """
        start_s, end_s = self.ends(check)
        found = [event for event in events if start_s <= event[0] <= end_s]
        if check.during is None:
            return found
        frames = self.frames(check)
        times_us = [round(event[0] * 1e6) for event in found]
        at = np.maximum(np.searchsorted(self.history.time_us, times_us, side="right") - 1, 0)
        return [event for event, is_in in zip(found, frames[at], strict=True) if is_in]


def most(
    name: str, values: Rows, time_s: Rows, bound: float, unit: str, *, percent: float = 100.0, what: str = ""
) -> CheckResult:
    """The largest value, or that of so many percent of the time, is at most the bound."""
    found, worst_s = _worst(values, time_s)
    part = ""
    if percent < 100.0:
        found, part = float(np.percentile(values, percent)), f" for {percent:g} % of the time"
    margin = bound - found
    asked = f"{what or name} at most {bound:g}{unit_of(unit)}{part}"
    return CheckResult(
        name, margin >= 0.0, asked, f"{found:.3g}{unit_of(unit)} at {worst_s:.1f} s", margin, unit, worst_s
    )


def least(
    name: str, values: Rows, time_s: Rows, bound: float, unit: str, *, percent: float = 100.0, what: str = ""
) -> CheckResult:
    """The smallest value is at least the bound."""
    found, worst_s = _worst(-values, time_s)
    found, part = -found, ""
    if percent < 100.0:
        found, part = float(np.percentile(values, 100.0 - percent)), f" for {percent:g} % of the time"
    margin = found - bound
    asked = f"{what or name} at least {bound:g}{unit_of(unit)}{part}"
    return CheckResult(
        name, margin >= 0.0, asked, f"{found:.3g}{unit_of(unit)} at {worst_s:.1f} s", margin, unit, worst_s
    )


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


def unit_of(unit: str) -> str:
    return f" {unit}" if unit else ""
