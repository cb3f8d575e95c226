"""Segments of a flight from its ULog: whole seconds in the air in which no topic has gaps, sampled each 4 ms.

Between two rows of the log the course is linear. Left out are what is near the ground, seconds before a landing was
noticed, leaps of the velocity, and what is not valid.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyulog import ULog

from common.kernels import MAX_MOTORS, TICK_US
from mission.dataset.fit import ulog_topics
from mission.dataset.fit.ulog_topics import LANDED, POSITION, TOPICS, Topic
from mission.dataset.sources import Columns, columns_of, read_log
from policies.datasets.episodes import DatasetError
from sim.bodies.fit.segments import FLIGHT_TICKS, LEAD_TICKS, ROWS, Segments
from sim.bodies.rigid_body import density_ratio_at

_GAP_US = 250_000  # between two rows of a topic at most: PX4 logs motors and velocities at 10 Hz
_BEFORE_LANDED_TICKS, _AFTER_LANDED_TICKS = 750, 250  # a landing is noticed seconds after the ground was touched
_NEAR_GROUND_M = 1.5  # lower the ground lifts, and feet touch it
_SPEED_MOST_M_S, _RATE_MOST_RAD_S = 60.0, 40.0  # more is damage
_LEAP_M_S = 5.0  # of the velocity from one row to the next: damage, or a reset of the estimator
_NORM_LEAST = 0.9  # of an attitude between two rows: less is too long a way between them


@dataclass(frozen=True, slots=True, eq=False)
class FlightSegments:
    """What one log gives."""

    segments: Segments
    motor_hz: float  # how often the motors' commands were logged
    notes: tuple[str, ...]  # what was assumed


def flight_segments(path: Path, motor_count: int, cells: int, full_cell_v: float) -> FlightSegments:
    """Whole seconds of flight of a log.

    Args:
        path: of a ULog.
        motor_count: of the airframe.
        cells: of its battery.
        full_cell_v: voltage of one that is full.

    Raises:
        DatasetError: it cannot be read, lacks a topic, or is of another number of motors.
    """
    log = read_log(path, TOPICS)
    notes: list[str] = []
    position = ulog_topics.needed(path, log, POSITION)
    motors = ulog_topics.motors(path, log, motor_count, notes)
    velocity = ulog_topics.velocity(path, position)
    topics = (motors, velocity, ulog_topics.attitude(path, log), ulog_topics.rates(path, log))
    others = ulog_topics.voltage(path, log, cells, full_cell_v, notes), ulog_topics.altitude(position)
    if min(len(times) for times, _ in (*topics, others[1])) < 2:
        raise DatasetError(f"{path}: a topic that a fit needs has no two rows of numbers")
    grid = np.arange(max(int(t[0]) for t, _ in topics), min(int(t[-1]) for t, _ in topics), TICK_US, dtype=np.int64)
    command, vel_ned, q, omega_frd, voltage, alt_m = (_course(grid, topic) for topic in (*topics, *others))
    norm = np.linalg.norm(q, axis=1, keepdims=True)
    is_good = _in_air(grid, log, position) & ~_leaps(grid, velocity) & (norm[:, 0] > _NORM_LEAST)
    is_good &= (np.abs(vel_ned) < _SPEED_MOST_M_S).all(axis=1) & (np.abs(omega_frd) < _RATE_MOST_RAD_S).all(axis=1)
    for times, _ in topics:
        before, after = _neighbours(grid, times)
        is_good &= times[after] - times[before] <= _GAP_US
    rows = _starts(is_good)[:, None] + np.arange(ROWS)
    segments = _cut(rows, command, vel_ned, q / np.maximum(norm, 1e-6), omega_frd, voltage, alt_m)
    return FlightSegments(segments, 1e6 / float(np.median(np.diff(motors[0]))), tuple(notes))


def _cut(
    rows: NDArray[np.int64],
    motors: NDArray[Any],
    vel_ned: NDArray[Any],
    q_ned_from_frd: NDArray[Any],
    omega_frd: NDArray[Any],
    voltage: NDArray[Any],
    alt_m: NDArray[Any],
) -> Segments:
    """Segments of rows of the grid, shape (segments, ROWS)."""
    command = np.zeros((*rows.shape, MAX_MOTORS), np.float32)
    command[..., : motors.shape[1]] = motors[rows]
    densities = [density_ratio_at(float(alt)) for alt in alt_m[rows[:, ROWS // 2], 0]]
    return Segments(
        log=np.zeros(len(rows), np.int32),
        command=command,
        voltage=voltage[rows, 0].astype(np.float32),
        density_ratio=np.array(densities, np.float32),
        vel_ned=vel_ned[rows].astype(np.float32),
        q_ned_from_frd=q_ned_from_frd[rows].astype(np.float32),
        omega_frd=omega_frd[rows].astype(np.float32),
    )


def _starts(is_good: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Where whole segments begin, one after the other: only their leads lie in those before."""
    bad = np.concatenate([[0], np.cumsum(~is_good)])
    starts, at = [], 0
    while at + ROWS <= len(is_good):
        is_whole = bad[at + ROWS] == bad[at]
        if is_whole:
            starts.append(at)
        at += FLIGHT_TICKS if is_whole else LEAD_TICKS
    return np.array(starts, np.int64)


def _course(grid: NDArray[np.int64], topic: Topic) -> NDArray[Any]:
    times, rows = topic
    return np.stack([np.interp(grid, times, column) for column in rows.T], axis=1)


def _neighbours(grid: NDArray[np.int64], times: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The rows before and after each time, of two at least."""
    after = np.clip(np.searchsorted(times, grid, side="right"), 1, len(times) - 1)
    return after - 1, after


def _leaps(grid: NDArray[np.int64], velocity: Topic) -> NDArray[np.bool_]:
    times, rows = velocity
    leaps = np.abs(np.diff(rows, axis=0)).max(axis=1) > _LEAP_M_S
    return np.asarray(leaps[_neighbours(grid, times)[0]], np.bool_)


def _in_air(grid: NDArray[np.int64], log: ULog, position: Columns) -> NDArray[np.bool_]:
    """Where it flies, its velocity is valid, and the ground is not near."""
    is_valid = np.ones(len(position["timestamp"]), np.bool_)
    for flag in ("v_xy_valid", "v_z_valid"):
        is_valid &= position.get(flag, is_valid) != 0
    if "dist_bottom" in position:
        is_near = position["dist_bottom"] < _NEAR_GROUND_M  # NaN is not known, and not near
        is_valid &= ~(is_near & (position.get("dist_bottom_valid", is_near) != 0))
    good = _last_said(grid, position["timestamp"], is_valid, _GAP_US)
    landed = columns_of(log, LANDED)
    if landed is not None:
        stands = ~_last_said(grid, landed["timestamp"], landed["landed"] == 0, None)
        good &= ~_widened(stands, _BEFORE_LANDED_TICKS, _AFTER_LANDED_TICKS)
    return good


def _last_said(
    grid: NDArray[np.int64], times: NDArray[Any], is_so: NDArray[np.bool_], old_us: int | None
) -> NDArray[np.bool_]:
    """What was last said at each time; not so before the first, and after `old_us` of silence."""
    order = np.argsort(times, kind="stable")
    ordered = times[order].astype(np.int64)
    found = np.searchsorted(ordered, grid, side="right") - 1
    last = np.maximum(found, 0)
    said: NDArray[np.bool_] = is_so[order][last] & (found >= 0)
    return said if old_us is None else said & (grid - ordered[last] <= old_us)


def _widened(marks: NDArray[np.bool_], before: int, after: int) -> NDArray[np.bool_]:
    """Marks, and so many rows before and after each."""
    edges = np.diff(np.concatenate([[0], marks.astype(np.int64), [0]]))
    count = np.zeros(len(marks) + 1, np.int64)
    np.add.at(count, np.maximum(np.flatnonzero(edges == 1) - before, 0), 1)
    np.add.at(count, np.minimum(np.flatnonzero(edges == -1) + after, len(marks)), -1)
    return np.asarray(np.cumsum(count)[:-1] > 0)
