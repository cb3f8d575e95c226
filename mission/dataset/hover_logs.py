"""What Hover is told of by a log of any PX4, or by a telemetry log: topics of several releases, sampled each 20 ms."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from autopilot.mavlink.tlog_reader import TlogDamage, read_messages
from mission.dataset.sources import Columns, columns_of, read_log, vector
from policies.datasets.episodes import DatasetError
from policies.datasets.hover import STEP_US, HoverLog

POSITION, ATTITUDE, RATES = "vehicle_local_position", "vehicle_attitude", "vehicle_angular_velocity"
RATES_SP, ATTITUDE_SP = "vehicle_rates_setpoint", "vehicle_attitude_setpoint"
POSITION_SP, LANDED = "vehicle_local_position_setpoint", "vehicle_land_detected"
_OLD_US = 300_000  # PX4 logs positions at 5 to 10 Hz; a landing is logged when it changes
_MESSAGES = (
    "LOCAL_POSITION_NED", "ATTITUDE_QUATERNION", "ATTITUDE_TARGET", "POSITION_TARGET_LOCAL_NED", "EXTENDED_SYS_STATE",
)  # fmt: skip
_IN_AIR = 2  # MAV_LANDED_STATE


def read_hover_log(path: Path) -> HoverLog:
    """What a log tells.

    Raises:
        DatasetError: it cannot be read, or lacks a topic.
    """
    return _from_messages(path) if path.suffix == ".tlog" else _from_ulog(path)


def _from_ulog(path: Path) -> HoverLog:
    log = read_log(path, (POSITION, ATTITUDE, RATES, RATES_SP, ATTITUDE_SP, POSITION_SP, LANDED))

    def needed(topic: str) -> Columns:
        columns = columns_of(log, topic)
        if columns is None:
            raise DatasetError(f"{path}: has no topic {topic}, which Hover needs")
        return columns

    position, attitude, rates_sp, position_sp = (needed(t) for t in (POSITION, ATTITUDE, RATES_SP, POSITION_SP))
    omega = columns_of(log, RATES)
    if omega is not None:
        omega_time, omega_rows = omega["timestamp"], vector(omega, "xyz")
    elif "rollspeed" in attitude:  # until PX4 1.9
        omega_time, omega_rows = attitude["timestamp"], _stack(attitude, "rollspeed pitchspeed yawspeed")
    else:
        raise DatasetError(f"{path}: has no topic {RATES}, which Hover needs")
    thrust_time, thrust = _thrust(path, rates_sp, columns_of(log, ATTITUDE_SP))
    landed = columns_of(log, LANDED)
    return _sampled(
        path,
        position=(position["timestamp"], _stack(position, "x y z vx vy vz")),
        attitude=(attitude["timestamp"], vector(attitude, "q")[:, [1, 2, 3, 0]]),
        omega=(omega_time, omega_rows),
        rates_sp=(rates_sp["timestamp"], _stack(rates_sp, "roll pitch yaw")),
        thrust=(thrust_time, thrust[:, None]),
        position_sp=(position_sp["timestamp"], _stack(position_sp, "x y z")),
        landed=None if landed is None else (landed["timestamp"], landed["landed"][:, None].astype(float)),
    )


def _thrust(path: Path, rates_sp: Columns, attitude_sp: Columns | None) -> tuple[NDArray[Any], NDArray[Any]]:
    """Thrust of the greatest, as any release logs it: up is positive."""
    for columns in (rates_sp, attitude_sp):
        if columns is None:
            continue
        if "thrust_body[2]" in columns:
            return columns["timestamp"], -columns["thrust_body[2]"]
        if "thrust" in columns:
            return columns["timestamp"], columns["thrust"]
    raise DatasetError(f"{path}: has no thrust in {RATES_SP} or {ATTITUDE_SP}, which Hover needs")


def _from_messages(path: Path) -> HoverLog:
    try:
        found = read_messages(path, _MESSAGES)
    except OSError as error:
        raise DatasetError(f"{path}: cannot be read: {error.strerror or error}") from error
    except TlogDamage as error:
        raise DatasetError(str(error)) from error
    for name in _MESSAGES[:4]:
        if name not in found:
            raise DatasetError(f"{path}: has no message {name}, which Hover needs")
    position, attitude, target, position_sp = (found[name] for name in _MESSAGES[:4])
    landed = found.get(_MESSAGES[4])
    return _sampled(
        path,
        position=(position["timestamp"], _stack(position, "x y z vx vy vz")),
        attitude=(attitude["timestamp"], _stack(attitude, "q2 q3 q4 q1")),
        omega=(attitude["timestamp"], _stack(attitude, "rollspeed pitchspeed yawspeed")),
        rates_sp=(target["timestamp"], _stack(target, "body_roll_rate body_pitch_rate body_yaw_rate")),
        thrust=(target["timestamp"], target["thrust"][:, None]),
        position_sp=(position_sp["timestamp"], _stack(position_sp, "x y z")),
        landed=None if landed is None else (landed["timestamp"], (landed["landed_state"] != _IN_AIR)[:, None] * 1.0),
    )


def _stack(columns: Columns, names: str) -> NDArray[Any]:
    return np.stack([columns[name] for name in names.split()], axis=1).astype(float)


_Topic = tuple[NDArray[Any], NDArray[Any]]


def _sampled(path: Path, *, landed: _Topic | None, **topics: _Topic) -> HoverLog:
    """All topics as they were last, each 20 ms; what was asked for, as it was by the end of these 20 ms."""
    ordered = {name: _in_order(topic) for name, topic in topics.items()}
    first = max(int(times[0]) for times, _ in ordered.values())
    last = min(int(times[-1]) for times, _ in ordered.values())
    if last - first < 2 * STEP_US:
        raise DatasetError(f"{path}: its topics do not overlap in time")
    grid = np.arange(first, last, STEP_US, dtype=np.int64)
    is_fresh = np.ones(len(grid), np.bool_)
    values = {}
    for name, (times, rows) in ordered.items():
        at = grid + (STEP_US if name in ("rates_sp", "thrust") else 0)
        found = np.maximum(np.searchsorted(times, at, side="right") - 1, 0)
        is_fresh &= at - times[found] <= _OLD_US
        values[name] = rows[found]
    is_airborne = np.ones(len(grid), np.bool_)
    if landed is not None:
        times, rows = _in_order(landed)
        found = np.searchsorted(times, grid, side="right") - 1
        is_airborne = (found >= 0) & (rows[np.maximum(found, 0), 0] < 0.5)
    position = values["position"]
    return HoverLog(
        source=f"{path.absolute().parent.name}/{path.name}",
        time_us=grid,
        pos_ned=position[:, :3],
        vel_ned=position[:, 3:],
        q_ned_from_frd=values["attitude"],
        omega_frd=values["omega"],
        pos_ned_sp=values["position_sp"],
        omega_frd_sp=values["rates_sp"],
        thrust=values["thrust"][:, 0],
        is_airborne=is_airborne,
        is_fresh=is_fresh,
    )


def _in_order(topic: _Topic) -> _Topic:
    """Rows in order of time: where a log is damaged they need not be."""
    times, rows = topic
    order = np.argsort(times, kind="stable")
    return times[order].astype(np.int64), rows[order]
