"""A run as those see it who look at it later: moments read from its flight log, and what the flight was made from.

In: the ULog of a run that was to be replayed. Out: `Recording`, which replays, films and HTML files are made from. Of a
vehicle disarmed for long there is a moment each second (`mission.log.kept_frames`).
"""

import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyulog import ULog

from common.airframe import load_airframe
from mission.console.name_checks import LOG_FILE, vehicle_folders
from mission.flight_base import FlightBase
from mission.flight_config import FlightConfig
from mission.log.motion_topics import STEERING_TOPIC
from mission.log.replay_topic import OWNER, REPLAY_TOPIC
from mission.log.ulog_file import UlogDamage, read_topics
from mission.view.flight_snapshot import MOMENT, Moment, Row, mode_titles
from mission.world.world_copies import with_copies
from sim.world.custom.world_file import WorldFile

CONFIG_KEY, PATH_KEY = "replay_config", "replay_path"  # of the log's information
TEXT_MAX = 60_000  # [byte] of one piece of information
PLACE, ATTITUDE = "vehicle_local_position_groundtruth", "vehicle_attitude_groundtruth"


class RecordingError(ValueError):
    """A folder without a run that can be shown; the message is one sentence."""


@dataclass(frozen=True, eq=False)
class Recording:
    """One flight, as it is shown."""

    config: FlightConfig
    rows: NDArray[Any]  # of MOMENT, (moments,)
    path_ned: NDArray[np.float32]  # [m] (n, 3) of its plan; empty without one
    others: tuple["Recording", ...] = ()  # of other vehicles in its world, at the same moments

    def __len__(self) -> int:
        return len(self.rows)

    def moment(self, index: int) -> Moment:
        return Moment(self.rows[index], self.modes)

    @cached_property
    def modes(self) -> dict[int, str]:
        """Titles of the vehicle's modes."""
        return mode_titles(load_airframe(self.config.airframe))

    @property
    def has_owner(self) -> bool:
        return self.config.owner is not None

    def every(self, frames: int) -> "Recording":
        """The same with fewer moments."""
        others = tuple(other.every(frames) for other in self.others)
        return Recording(self.config, self.rows[::frames], self.path_ned, others)

    def at(self, time_s: NDArray[np.float64]) -> "Recording":
        """The same at other moments, at each as it was last till then."""
        found = np.searchsorted(self.rows["time_s"], time_s, side="right") - 1
        rows = self.rows[np.maximum(found, 0)]
        rows["time_s"] = time_s
        return Recording(self.config, rows, self.path_ned)


def keep_for_replay(
    flight: FlightBase, path_ned: Sequence[Any] = (), action: Callable[[], Row | None] = lambda: None
) -> None:
    """Lets the log of a flight that has not begun hold what its replay needs.

    Args:
        flight: what is flown.
        path_ned: [m] (n, 3) of its plan.
        action: what a policy on board chose last.
    """
    controller = flight.controller
    owner = None if flight.owner is None else flight.owner.people.numpy()  # live

    def take(row: Any) -> None:
        chosen = action()
        row["goal_ned"] = controller.state.goal_ned
        row["action"] = nan if chosen is None else chosen
        if owner is not None:
            row["owner"] = owner[0]

    path = np.array(path_ned, np.float32).reshape(-1, 3).tolist()
    info = {CONFIG_KEY: json.dumps(_kept_config(flight)), PATH_KEY: json.dumps(path)}
    flight.recorder.keep_for_replay(take, {key: _pieces(text) for key, text in info.items()})


def _kept_config(flight: FlightBase) -> dict[str, Any]:
    """What the flight is made from; files of its world are copied beside its log."""
    given, folder = flight.config.model_dump(mode="json"), flight.recorder.folder
    if folder is not None and isinstance(flight.config.world, WorldFile):
        with suppress(OSError):  # a full disk: it is shown as long as the files are where they were
            given["world"] = with_copies(given["world"], folder)
    return given


def config_of(text: str, folder: Path) -> FlightConfig:
    """What a flight was made from.

    Args:
        text: of CONFIG_KEY.
        folder: of its log, beside which the files of its world lie.

    Raises:
        ValueError: damaged, or of another version.
    """
    return FlightConfig.model_validate(json.loads(text), context={"folder": folder})


def _pieces(text: str) -> list[str]:
    return [text[at : at + TEXT_MAX] for at in range(0, len(text), TEXT_MAX)]


def load_recording(folder: Path) -> Recording:
    """The recording of a run; of several vehicles that of the first, with the others.

    Raises:
        RecordingError: there is none, or it cannot be read.
    """
    vehicles = vehicle_folders(folder)
    if not vehicles:
        return _load_one(folder)
    found = [_load_one(vehicle) for vehicle in vehicles]
    times = np.unique(np.concatenate([each.rows["time_s"] for each in found]))  # one that waits has few moments
    first, *others = (each.at(times) for each in found)
    return replace(first, others=tuple(others))


def _load_one(folder: Path) -> Recording:
    """The recording of one vehicle; as `load_recording`."""
    parts = sorted((path for path in folder.glob("flight*.ulg") if _part_number(path)), key=_part_number)
    if not parts:
        raise RecordingError(f"{folder}: holds no run that can be shown: {LOG_FILE} is missing")
    try:
        logs = [read_topics(path, (PLACE, ATTITUDE, REPLAY_TOPIC.name, STEERING_TOPIC.name)) for path in parts]
    except OSError as error:
        raise RecordingError(f"{folder / LOG_FILE}: cannot be read: {error.strerror or error}") from error
    except UlogDamage as error:
        raise RecordingError(str(error)) from error
    if CONFIG_KEY not in logs[-1].msg_info_multiple_dict:
        raise RecordingError(
            f"{parts[-1]}: is no log of this version's honeyguide fly or follow: show it with the version that wrote it"
        )
    try:
        config = config_of(info_text(logs[-1], CONFIG_KEY), folder)
        path_ned = np.array(json.loads(info_text(logs[-1], PATH_KEY)), np.float32).reshape(-1, 3)
        rows = np.concatenate([_rows(log) for log in logs])
    except (KeyError, ValueError) as error:
        raise RecordingError(f"{parts[-1]}: cannot be shown: damaged, or of another version") from error
    if len(rows) == 0:
        raise RecordingError(f"{parts[-1]}: holds no moment of a flight")
    return Recording(config, rows, path_ned)


def _part_number(path: Path) -> int:
    """Which part of the flight's log a file is, from 1; 0: none."""
    if path.name == LOG_FILE:
        return 1
    number = path.stem.removeprefix("flight-")
    return int(number) if number.isdecimal() else 0


def info_text(log: ULog, key: str) -> str:
    return "".join(log.msg_info_multiple_dict[key][0])


def _rows(log: ULog) -> NDArray[Any]:
    """The moments of which the log has every topic."""
    topics = {data.name: data.data for data in log.data_list}
    if not {PLACE, ATTITUDE, REPLAY_TOPIC.name} <= set(topics):
        return np.zeros(0, MOMENT)
    time_us = reduce(np.intersect1d, (data["timestamp"] for data in topics.values()))
    place, attitude, shown = (_at(topics[name], time_us) for name in (PLACE, ATTITUDE, REPLAY_TOPIC.name))
    rows = np.zeros(len(time_us), MOMENT)
    rows["time_s"] = time_us * 1e-6
    rows["pos_ned"] = np.stack([place[axis] for axis in ("x", "y", "z")], axis=1)
    rows["vel_ned"] = np.stack([place[axis] for axis in ("vx", "vy", "vz")], axis=1)
    rows["height_m"] = place["dist_bottom"]
    rows["q_ned_from_frd"] = np.stack([attitude[f"q[{k}]"] for k in (1, 2, 3, 0)], axis=1)  # a log's begin with w
    if STEERING_TOPIC.name in topics:
        rows["steering_rad"] = _at(topics[STEERING_TOPIC.name], time_us)["angle"]
    for name in ("motor_speed", "is_on_ground", "battery", "mode", "is_armed", "goal_ned", "action"):
        rows[name] = _field(shown, name, rows.dtype[name])
    for name in OWNER.names or ():
        rows["owner"][name] = _field(shown, f"owner_{name}", OWNER[name])
    return rows


def _at(columns: dict[str, NDArray[Any]], time_us: NDArray[np.uint64]) -> dict[str, NDArray[Any]]:
    """A topic's rows of these times; where the log is damaged its times need not be in order."""
    times = columns["timestamp"]
    order = np.argsort(times, kind="stable")
    rows = order[np.searchsorted(times, time_us, sorter=order)]
    return {name: column[rows] for name, column in columns.items()}


def _field(columns: dict[str, NDArray[Any]], name: str, dtype: np.dtype[Any]) -> NDArray[Any]:
    """A field of a topic: a column, or one per element."""
    if dtype.shape:
        return np.stack([columns[f"{name}[{k}]"] for k in range(dtype.shape[0])], axis=1)
    return columns[name]
