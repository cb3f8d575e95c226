"""The flight's health in words: one sentence for each thing that logs are usually looked at for.

Bounds are PX4's where it has some; those that are this project's guess say so.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np

from mission.review.innovations import ratios
from mission.review.logged_flight import LoggedFlight
from mission.review.panels.actuators import motor_commands
from mission.review.panels.sensors import field_gauss, gnss_topic
from mission.review.timeline import Timeline, is_serious
from mission.review.vibration import BAD_M_S2, GOOD_M_S2, metric

REJECTED, STRAINED = 1.0, 0.5  # test ratios; PX4's log analysis looks at both
REJECTED_FRACTION_MAX, STRAINED_FRACTION_MAX = 0.01, 0.05  # of the flight; guess
FIELD_SPREAD_GOOD, FIELD_SPREAD_BAD = 0.05, 0.15  # of the mean strength, one sigma; guess
FULL, FULL_FRACTION_GOOD, FULL_FRACTION_BAD = 0.995, 0.01, 0.1  # of the time in the air; guess
FIX_3D = 3


class Level(IntEnum):
    GOOD = 0
    UNKNOWN = 1
    WARN = 2
    BAD = 3


@dataclass(frozen=True, slots=True)
class Verdict:
    """One sentence."""

    title: str
    level: Level
    text: str


def verdicts(flight: LoggedFlight, timeline: Timeline) -> list[Verdict]:
    """All of them, in the order of the page."""
    found = [
        judge(flight, timeline) for judge in (_vibration, _magnetometer, _gnss, _innovations, _actuators, _battery)
    ]
    return [_failsafes(timeline), *found]


def _failsafes(timeline: Timeline) -> Verdict:
    if timeline.failsafe:
        first = timeline.failsafe[0]
        return Verdict(
            "Failsafe", Level.BAD, f"active {_times(len(timeline.failsafe))}, first at {first.start_s:.0f} s"
        )
    warnings = [text for text in timeline.texts if is_serious(text) and text.time_s >= 0.0]
    if warnings:
        return Verdict("Failsafe", Level.WARN, f"none; warned {_times(len(warnings))}")
    if not timeline.modes:
        return Verdict("Failsafe", Level.UNKNOWN, "the log does not say")
    return Verdict("Failsafe", Level.GOOD, "none, and no warning")


def _vibration(flight: LoggedFlight, timeline: Timeline) -> Verdict:
    found = metric(flight)
    if found is None:
        return Verdict("Vibration", Level.UNKNOWN, "the log has no samples for it")
    in_air = timeline.in_air(found.time_s)
    values = found.values[in_air] if in_air.any() else found.values
    level = float(np.nanpercentile(values.max(axis=1), 95.0))
    word, grade = ("low", Level.GOOD) if level < GOOD_M_S2 else ("high", Level.WARN)
    if level >= BAD_M_S2:
        word, grade = "too high", Level.BAD
    clipped = _clipped(flight)
    if clipped:
        samples = "one sample" if clipped == 1 else f"{clipped} samples"
        word, grade = f"{word}, and {samples} at the sensor's limit", max(grade, Level.WARN)
    return Verdict(
        "Vibration", grade, f"{word}: metric {level:.1f} m/s² or less in 95\N{NO-BREAK SPACE}% of the flight"
    )


def _clipped(flight: LoggedFlight) -> int:
    topic = flight.topic("sensor_combined")
    flags = None if topic is None else topic.get("accelerometer_clipping")
    return 0 if flags is None else int(np.count_nonzero(flags))


def _magnetometer(flight: LoggedFlight, timeline: Timeline) -> Verdict:
    found = field_gauss(flight)
    if found is None:
        return Verdict("Magnetometer", Level.UNKNOWN, "not in the log")
    topic, columns = found
    in_air = timeline.in_air(topic.time_s)
    strength = np.linalg.norm(columns[in_air] if in_air.any() else columns, axis=1)
    mean = float(np.nanmean(strength))
    spread = float(np.nanstd(strength)) / mean if mean > 0.0 else float("nan")
    text = f"strength {mean:.2f} gauss, varies by {100.0 * spread:.1f} % (one sigma)"
    if spread < FIELD_SPREAD_GOOD:
        return Verdict("Magnetometer", Level.GOOD, f"undisturbed: {text}")
    if spread < FIELD_SPREAD_BAD:
        return Verdict("Magnetometer", Level.WARN, f"somewhat disturbed: {text}")
    return Verdict("Magnetometer", Level.BAD, f"disturbed: {text}")


def _gnss(flight: LoggedFlight, timeline: Timeline) -> Verdict:
    """By what PX4's estimator requires before it uses a receiver."""
    topic = gnss_topic(flight)
    if topic is None:
        return Verdict("GNSS", Level.UNKNOWN, "not in the log")
    required = {
        "eph": flight.parameters.get("EKF2_REQ_EPH", 3.0),
        "epv": flight.parameters.get("EKF2_REQ_EPV", 5.0),
        "satellites_used": flight.parameters.get("EKF2_REQ_NSATS", 6.0),
    }
    in_air = timeline.in_air(topic.time_s)
    in_air = in_air if in_air.any() else np.ones(len(topic), bool)
    fix, eph = topic.get("fix_type"), topic.get("eph")
    is_good = np.ones(len(topic), bool) if fix is None else fix >= FIX_3D
    for name, bound in required.items():
        if name in topic:
            is_good &= topic[name] >= bound if name == "satellites_used" else topic[name] <= bound
    fraction = float(np.mean(is_good[in_air]))
    words = []
    if "satellites_used" in topic:
        words.append(f"{int(np.median(topic['satellites_used'][in_air]))} satellites")
    if eph is not None:
        words.append(f"{float(np.nanmedian(eph[in_air])):.1f} m horizontally by its own account")
    text = ", ".join(words)
    if fraction > 0.99:
        return Verdict("GNSS", Level.GOOD, f"good throughout: {text}")
    level = Level.WARN if fraction > 0.9 else Level.BAD
    return Verdict(
        "GNSS", level, f"short of what the estimator requires for {_percent(1.0 - fraction)} of the time: {text}"
    )


def _innovations(flight: LoggedFlight, timeline: Timeline) -> Verdict:
    found = ratios(flight)
    if not found:
        return Verdict("Innovations", Level.UNKNOWN, "no test ratios in the log")
    judged, peak = [], 0.0
    for each in found:
        in_air = timeline.in_air(each.time_s)
        values = each.ratio[in_air] if in_air.any() else each.ratio
        judged.append((_fraction(values > REJECTED), _fraction(values > STRAINED), each.name))
        peak = max(peak, float(np.nanmax(values, initial=0.0)))
    rejected, strained, name = max(judged)
    if rejected > REJECTED_FRACTION_MAX:
        return Verdict("Innovations", Level.BAD, f"{name} rejected for {_percent(rejected)} of the flight")
    rejected, strained, name = max(judged, key=lambda each: each[1])
    if strained > STRAINED_FRACTION_MAX:
        return Verdict(
            "Innovations", Level.WARN, f"{name} above half of its gate for {_percent(strained)} of the flight"
        )
    text = "all measurements agree" if peak <= REJECTED else "measurements agree but for single ones"
    return Verdict("Innovations", Level.GOOD, f"{text}: greatest test ratio {peak:.2f}")


def _actuators(flight: LoggedFlight, timeline: Timeline) -> Verdict:
    found = motor_commands(flight)
    if found is None:
        return Verdict("Actuators", Level.UNKNOWN, "no motor commands in the log")
    time_s, commands, _ = found
    in_air = timeline.in_air(time_s)
    commands = commands[in_air] if in_air.any() else commands
    fraction = _fraction((commands >= FULL).any(axis=1))
    mean = float(np.nanmean(commands))
    text = f"a motor at full for {_percent(fraction)} of the flight, on average at {_percent(mean)}"
    if fraction < FULL_FRACTION_GOOD:
        return Verdict("Actuators", Level.GOOD, f"room left: {text}")
    return Verdict("Actuators", Level.WARN if fraction < FULL_FRACTION_BAD else Level.BAD, f"saturated: {text}")


def _battery(flight: LoggedFlight, timeline: Timeline) -> Verdict:  # noqa: ARG001  as the others
    topic = flight.topic("battery_status")
    left = None if topic is None else topic.get("remaining")
    if left is None or not np.isfinite(left).any() or np.nanmax(left) <= 0.0:
        return Verdict("Battery", Level.UNKNOWN, "charge not in the log")
    least = float(np.nanmin(left[left > 0.0])) if (left > 0.0).any() else 0.0
    low, critical = flight.parameters.get("BAT_LOW_THR", 0.15), flight.parameters.get("BAT_CRIT_THR", 0.07)
    if least > low:
        return Verdict("Battery", Level.GOOD, f"{_percent(least)} left at the least")
    word, level = ("critical", Level.BAD) if least <= critical else ("low", Level.WARN)
    return Verdict("Battery", level, f"{word}: down to {_percent(least)}")


def _fraction(is_so: Any) -> float:
    return float(np.mean(is_so)) if len(is_so) else 0.0


def _percent(fraction: float) -> str:
    percent = 100.0 * fraction
    return (
        f"{percent:.0f}\N{NO-BREAK SPACE}%"
        if percent >= 10.0 or percent == 0.0
        else f"{percent:.1f}\N{NO-BREAK SPACE}%"
    )


def _times(count: int) -> str:
    return {1: "once", 2: "twice"}.get(count, f"{count} times")
