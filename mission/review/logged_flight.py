"""A flight as its log holds it: topics by name, whoever wrote them, times in seconds since the log began.

In: the parts of one ULog. Out: `LoggedFlight`, whose `topic` gives None for what was not logged: PX4's versions differ
in topics and fields. What a damaged log holds that cannot be true is left out here, in one place.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyulog import ULog

from mission.log.ulog_file import MAGIC, UlogDamage, read_topics

Rows = NDArray[Any]
ABSURD = 1e12  # no quantity that is plotted comes near it
GAP_MAX_S = 60.0  # in a damaged log, what lies farther away is of no such time; guess
PAUSE_MAX_S = 3600.0  # in any log: damage is not always noticed; guess
STRAY_RANGES = 3.0  # beyond the middle 98 %, in its own widths; guess
CLOCK_TOPICS = ("sensor_combined", "vehicle_attitude", "vehicle_local_position")
LEVELS = ("emergency", "alert", "critical", "error", "warning", "notice", "info", "debug")
_ESCAPES = re.compile(r"\x1b\[[0-9;]*m|\[[0-9;]+m|[\x00-\x1f\x7f]")


class ReviewError(ValueError):
    """What cannot be reviewed; the message is one sentence."""


class Topic:
    """One instance of a topic: fields as columns, in the order of time."""

    def __init__(self, name: str, time_s: Rows, columns: dict[str, Rows]) -> None:
        self.name = name
        self.time_s = time_s
        self._columns = columns

    def __contains__(self, field_name: str) -> bool:
        return field_name in self._columns

    def __getitem__(self, field_name: str) -> Rows:
        return self._columns[field_name]

    def __len__(self) -> int:
        return len(self.time_s)

    def get(self, *names: str) -> Rows | None:
        """The first of these fields that there is: PX4 renamed some."""
        return next((self._columns[name] for name in names if name in self._columns), None)

    def vector(self, name: str, count: int) -> Rows | None:
        """The elements of an array field, shape (rows, count)."""
        names = [f"{name}[{k}]" for k in range(count)]
        return self.columns(*names)

    def columns(self, *names: str) -> Rows | None:
        """Several fields, shape (rows, names); None if one of them is missing."""
        if not all(name in self._columns for name in names):
            return None
        return np.stack([self._columns[name] for name in names], axis=1)

    def length(self, name: str) -> int:
        """How many elements an array field has."""
        count = 0
        while f"{name}[{count}]" in self._columns:
            count += 1
        return count


@dataclass(frozen=True, slots=True)
class Text:
    """What the vehicle said."""

    time_s: float
    level: str
    text: str


@dataclass(frozen=True, eq=False)
class LoggedFlight:
    """One log, read."""

    path: Path
    name: str
    topics: dict[tuple[str, int], Topic]
    info: dict[str, Any]
    parameters: dict[str, float]
    defaults: dict[str, float]  # of those that the log names: the ones that were changed
    has_defaults: bool
    texts: tuple[Text, ...]
    start_s: float  # of the vehicle's clock, when the log begins
    duration_s: float
    notes: tuple[str, ...] = ()  # what is wrong with the log, a sentence each
    pieces: dict[str, str] = field(default_factory=dict)  # long information, such as a replay's

    def topic(self, name: str, instance: int = 0) -> Topic | None:
        return self.topics.get((name, instance))

    def first(self, *names: str) -> Topic | None:
        """The first of these topics that was logged."""
        return next((found for name in names if (found := self.topic(name)) is not None), None)

    def instances(self, name: str) -> list[Topic]:
        return [topic for (other, _), topic in sorted(self.topics.items()) if other == name]

    @property
    def is_own(self) -> bool:
        return self.info.get("sys_name") == "Honeyguide"


def read_flight(paths: Sequence[Path], name: str, topics: Sequence[str]) -> LoggedFlight:
    """Reads the parts of one log.

    Args:
        paths: its files, in their order.
        name: what the flight is called on the page.
        topics: names of those that are wanted.

    Raises:
        ReviewError: it is no ULog, cannot be read, or holds no data.
    """
    logs = [_read(path, topics) for path in paths]
    is_damaged = any(log.file_corruption for log in logs)
    raw = _joined(logs)
    start_us, end_us = _bounds_us(raw, logs[0].start_timestamp, is_damaged=is_damaged)
    found = {key: _topic(key[0], columns, start_us, end_us, is_damaged=is_damaged) for key, columns in raw.items()}
    found = {key: topic for key, topic in found.items() if len(topic)}
    if not found:
        raise ReviewError(f"{paths[0]}: is a log without data")
    first = logs[0]
    parameters = _numbers(first.initial_parameters)
    for log in logs:
        parameters.update(_numbers({key: value for _, key, value in log.changed_parameters}))
    return LoggedFlight(
        path=paths[0],
        name=name,
        topics=found,
        info=dict(first.msg_info_dict),
        parameters=parameters,
        defaults=_defaults(first),
        has_defaults=bool(first.has_default_parameters),
        texts=tuple(text for log in logs for text in _texts(log, start_us, end_us)),
        start_s=start_us * 1e-6,
        duration_s=(end_us - start_us) * 1e-6,
        notes=tuple(_notes(logs, is_damaged=is_damaged)),
        pieces={key: "".join(values[0]) for key, values in logs[-1].msg_info_multiple_dict.items() if _is_text(values)},
    )


def _read(path: Path, topics: Sequence[str]) -> ULog:
    try:
        with path.open("rb") as file:
            head = file.read(len(MAGIC))
        if not head:
            raise ReviewError(f"{path}: is empty")
        if head != MAGIC:
            raise ReviewError(f"{path}: is not a ULog")
        return read_topics(path, topics)
    except OSError as error:
        raise ReviewError(f"{path}: cannot be read: {error.strerror or error}") from error
    except UlogDamage as error:
        raise ReviewError(str(error)) from error


def _joined(logs: Sequence[ULog]) -> dict[tuple[str, int], dict[str, Rows]]:
    """Topics of all parts; fields that one of the parts has not are left out."""
    parts: dict[tuple[str, int], list[dict[str, Rows]]] = {}
    for log in logs:
        for data in log.data_list:
            parts.setdefault((data.name, data.multi_id), []).append(data.data)
    return {
        key: {
            name: np.concatenate([part[name] for part in found])
            for name in found[0]
            if all(name in part for part in found)
        }
        for key, found in parts.items()
        if all("timestamp" in part for part in found)
    }


def _bounds_us(raw: dict[tuple[str, int], dict[str, Rows]], begun_us: int, *, is_damaged: bool) -> tuple[int, int]:
    """When the log begins and ends; states that it keeps from before `begun_us` are older."""
    times = {key: columns["timestamp"].astype(np.int64) for key, columns in raw.items() if len(columns["timestamp"])}
    if not times:
        return 0, 0
    clocks = [times[name, 0] for name in CLOCK_TOPICS if (name, 0) in times] or [max(times.values(), key=len)]
    steady = np.sort(np.concatenate(clocks))
    cuts = np.flatnonzero(np.diff(steady) > (GAP_MAX_S if is_damaged else PAUSE_MAX_S) * 1e6) + 1
    steady = max(np.split(steady, cuts), key=len)
    if is_damaged:
        return int(steady[0]), int(steady[-1])
    latest_us = int(steady[-1] + GAP_MAX_S * 1e6)
    end_us = max(int(each[each <= latest_us].max(initial=steady[-1])) for each in times.values())
    is_given = 0 < begun_us <= steady[0]
    return begun_us if is_given else int(steady[0]), end_us


def _topic(name: str, columns: dict[str, Rows], start_us: int, end_us: int, *, is_damaged: bool) -> Topic:
    time_us = columns["timestamp"].astype(np.int64)
    if is_damaged:
        order = np.flatnonzero((time_us >= start_us) & (time_us <= end_us))
    else:
        time_us = np.maximum(time_us, start_us)  # states from before hold when it begins
        order = np.flatnonzero(time_us <= end_us)
    if (np.diff(time_us[order]) < 0).any():
        order = order[np.argsort(time_us[order], kind="stable")]
    kept = {key: _plausible(column[order], is_damaged=is_damaged) for key, column in columns.items()}
    return Topic(name, (time_us[order] - start_us) * 1e-6, kept)


def _plausible(values: Rows, *, is_damaged: bool) -> Rows:
    """The column; NaN where its number cannot be meant."""
    if values.dtype.kind != "f":
        return values
    values = values.astype(float)
    with np.errstate(invalid="ignore"):
        values[~(np.abs(values) < ABSURD)] = np.nan
    if is_damaged and np.isfinite(values).sum() > 2:
        low, high = np.nanpercentile(values, [1.0, 99.0])
        room = STRAY_RANGES * (high - low)
        if room > 0.0:
            with np.errstate(invalid="ignore"):
                values[(values < low - room) | (values > high + room)] = np.nan
    return values


def _texts(log: ULog, start_us: int, end_us: int) -> list[Text]:
    """What was said during the log, and what it kept from before."""
    found = []
    for message in log.logged_messages:
        text = _ESCAPES.sub("", message.message).strip()
        level = LEVELS[min(max(int(message.log_level) - ord("0"), 0), 7)]
        if text and message.timestamp <= end_us + GAP_MAX_S * 1e6:
            found.append(Text((message.timestamp - start_us) * 1e-6, level, text))
    return found


def _numbers(values: dict[str, Any]) -> dict[str, float]:
    return {name: float(value) for name, value in values.items() if isinstance(value, int | float) and isfinite(value)}


def _defaults(log: ULog) -> dict[str, float]:
    """Default values of parameters that had others: the airframe's before the firmware's, as PX4 applies them."""
    found: dict[str, float] = {}
    for which in (0, 1):
        try:
            found.update(_numbers(log.get_default_parameters(which)))
        except (ValueError, KeyError):
            continue
    return found


def _notes(logs: Sequence[ULog], *, is_damaged: bool) -> list[str]:
    notes = []
    if is_damaged:
        notes.append("The log is damaged in places: what could be read of it is shown.")
    lost_s = sum(dropout.duration for log in logs for dropout in log.dropouts) * 1e-3
    if lost_s > 0.0:
        count = sum(len(log.dropouts) for log in logs)
        notes.append(f"The logger lost data {count} times, {lost_s:.1f} s in all.")
    return notes


def _is_text(values: Any) -> bool:
    return bool(values) and all(isinstance(piece, str) for piece in values[0])
