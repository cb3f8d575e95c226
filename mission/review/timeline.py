"""Modes, arming, failsafes and texts on the time axis."""

from dataclasses import dataclass

import numpy as np

from mission.review.curves import Rows
from mission.review.logged_flight import LoggedFlight, Text

ARMED = 2  # vehicle_status.arming_state
# vehicle_status.nav_state, as PX4's message defines it; 6, 8, 9, 11 and 16 as older versions did
MODES = {
    0: "Manual",
    1: "Altitude",
    2: "Position",
    3: "Mission",
    4: "Hold",
    5: "Return",
    6: "Position slow",
    8: "Altitude cruise",
    9: "Land engine fail",
    10: "Acro",
    11: "Landing GPS fail",
    12: "Descend",
    13: "Termination",
    14: "Offboard",
    15: "Stabilized",
    16: "Rattitude",
    17: "Take-off",
    18: "Land",
    19: "Follow",
    20: "Precision land",
    21: "Orbit",
    22: "VTOL take-off",
}
SERIOUS = ("emergency", "alert", "critical", "error", "warning")


@dataclass(frozen=True, slots=True)
class Span:
    """Something that held for a time."""

    name: str
    start_s: float
    end_s: float

    @property
    def length_s(self) -> float:
        return self.end_s - self.start_s


@dataclass(frozen=True, slots=True)
class Timeline:
    """What happened when."""

    modes: tuple[Span, ...]
    armed: tuple[Span, ...]
    failsafe: tuple[Span, ...]
    airborne: tuple[Span, ...]
    texts: tuple[Text, ...]
    missing: tuple[str, ...]

    @property
    def takeoff_s(self) -> float:
        """When it left the ground; when it was armed, or the log began, where nothing says so."""
        spans = self.airborne or self.armed
        return spans[0].start_s if spans else 0.0

    def in_air(self, time_s: Rows) -> Rows:
        """Which of these times are of flight; all where the log does not tell."""
        spans = self.airborne or self.armed
        if not spans:
            return np.ones(len(time_s), bool)
        is_in: Rows = np.zeros(len(time_s), bool)
        for span in spans:
            is_in |= (time_s >= span.start_s) & (time_s <= span.end_s)
        return is_in


def timeline(flight: LoggedFlight) -> Timeline:
    """Put together of vehicle_status, vehicle_land_detected and the texts."""
    status, landed = flight.topic("vehicle_status"), flight.topic("vehicle_land_detected")
    end_s = flight.duration_s
    modes: tuple[Span, ...] = ()
    armed: tuple[Span, ...] = ()
    failsafe: tuple[Span, ...] = ()
    missing = []
    if status is None:
        missing.append("no modes (topic vehicle_status)")
    else:
        if (states := status.get("nav_state")) is not None:
            modes = spans(status.time_s, states, end_s, {int(state): mode_name(int(state)) for state in set(states)})
        if (arming := status.get("arming_state")) is not None:
            armed = spans(status.time_s, arming == ARMED, end_s, {1: "armed"})
        if (flags := status.get("failsafe")) is not None:
            failsafe = spans(status.time_s, flags != 0, end_s, {1: "failsafe"})
    airborne: tuple[Span, ...] = ()
    if landed is not None and (is_down := landed.get("landed")) is not None:
        airborne = spans(landed.time_s, is_down == 0, end_s, {1: "in the air"})
        airborne = tuple(part for span in airborne for part in _meet(span, armed)) if armed else airborne
    else:
        missing.append("no landings (topic vehicle_land_detected)")
    if not flight.texts:
        missing.append("no texts")
    return Timeline(modes, armed, failsafe, airborne, flight.texts, tuple(missing))


def mode_name(nav_state: int) -> str:
    return MODES.get(nav_state, f"External {nav_state - 22}" if 23 <= nav_state <= 30 else f"State {nav_state}")


def spans(time_s: Rows, states: Rows, end_s: float, names: dict[int, str]) -> tuple[Span, ...]:
    """The stretches in which a state held; those whose state has no name are left out."""
    if not len(time_s):
        return ()
    states = np.asarray(states).astype(int)
    begins = np.concatenate([[0], np.flatnonzero(np.diff(states)) + 1])
    ends = [*time_s[begins[1:]], max(end_s, float(time_s[-1]))]
    return tuple(
        Span(names[int(states[k])], float(time_s[k]), float(end))
        for k, end in zip(begins, ends, strict=True)
        if int(states[k]) in names
    )


def _meet(span: Span, others: tuple[Span, ...]) -> list[Span]:
    """The parts of a span that lie in one of the others."""
    parts = [(max(span.start_s, other.start_s), min(span.end_s, other.end_s)) for other in others]
    return [Span(span.name, start, end) for start, end in parts if end > start]


def is_serious(text: Text) -> bool:
    return text.level in SERIOUS
