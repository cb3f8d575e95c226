"""What a dataset is built from, read from disk: the decisions that a log holds, and the truth beside them.

In: a ULog, a run's folder, or a folder of runs. Out: `DecisionRows`, `TruthRows` where a simulator flew, images.
"""

import json
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyulog import ULog

from mission.dataset.companion_log import IMAGES_FILE, read_image
from mission.flight_config import FlightConfig
from mission.log.motion_topics import STEERING_TOPIC
from mission.log.replay_topic import OWNER, REPLAY_TOPIC
from mission.log.ulog_file import UlogDamage, read_topics
from mission.simulator.flight_rig import flight_world
from mission.view.replay_file import ATTITUDE, CONFIG_KEY, PLACE, config_of, info_text
from policies.companion.decision_log import IMAGE_LAYOUT_KEY, LAYOUT_KEY, PILOT_KEY, TOPIC
from policies.datasets.decisions import DecisionRows, TruthRows
from policies.datasets.episodes import DatasetError
from policies.tasks.layout import Layout, LayoutError

SENSED = "sensor_combined"
JOLT_M_S2 = 7.0
"""A greater acceleration in the vehicle's level is a blow: of 180 drives into spots 54 of the 56 that touched something
felt one, and 2 of the other 124; flights felt at most 5.5 otherwise, and 70 to 115 at a tree."""
_BLOW_US = 200_000  # after a decision and no later: two periods

Columns = dict[str, NDArray[Any]]


def read_log(path: Path, topics: Sequence[str]) -> ULog:
    """A ULog with these topics.

    Raises:
        DatasetError: it cannot be read.
    """
    try:
        return read_topics(path, topics)
    except OSError as error:
        raise DatasetError(f"{path}: cannot be read: {error.strerror or error}") from error
    except UlogDamage as error:
        raise DatasetError(str(error)) from error


def columns_of(log: ULog, topic: str) -> Columns | None:
    """The first instance of a topic; None: the log has none."""
    return next((data.data for data in log.data_list if data.name == topic and len(data.data["timestamp"])), None)


def vector(columns: Columns, name: str) -> NDArray[Any]:
    """An array field of a topic, shape (rows, length)."""
    length = sum(key.startswith(f"{name}[") for key in columns)
    return np.stack([columns[f"{name}[{k}]"] for k in range(length)], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class FlightSource:
    """One log of a companion's decisions."""

    path: Path
    rows: DecisionRows
    truth: TruthRows | None

    def images(self, numbers: NDArray[Any]) -> NDArray[np.uint8] | None:
        """The images of decisions, shape (n, height, width, channels).

        Raises:
            DatasetError: there are none, or not all.
        """
        archive = self.path.parent / IMAGES_FILE
        if not archive.is_file():
            raise DatasetError(f"{self.path}: {TOPIC}: was recorded without pictures: {archive.name} is missing")
        if (numbers < 0).any():
            raise DatasetError(f"{self.path}: {TOPIC}: {int((numbers < 0).sum())} decisions have no picture")
        try:
            with zipfile.ZipFile(archive) as file:
                return np.stack([read_image(file, int(number)) for number in numbers])
        except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
            raise DatasetError(f"{self.path}: {TOPIC}: a picture in {archive.name} is missing or damaged") from error


def has_truth(path: Path) -> bool:
    """Whether a log holds the truth beside its decisions.

    Raises:
        DatasetError: it cannot be read.
    """
    log = read_log(path, (PLACE, ATTITUDE, REPLAY_TOPIC.name))
    topics = (PLACE, ATTITUDE, REPLAY_TOPIC.name)
    return CONFIG_KEY in log.msg_info_multiple_dict and all(columns_of(log, name) is not None for name in topics)


def read_flight(path: Path, *, by_truth: bool = True, by_images: bool = False) -> FlightSource:
    """The decisions of a log, and the truth at each, if it is to be used and is there.

    Args:
        path: of the log.
        by_truth: the truth is to be used.
        by_images: what was seen are the vectors of a pilot that decides on images, and not frames.

    Raises:
        DatasetError: the log cannot be read, or holds no decisions, or none on images.
    """
    log = read_log(path, (TOPIC, PLACE, ATTITUDE, REPLAY_TOPIC.name, STEERING_TOPIC.name, SENSED))
    columns = columns_of(log, TOPIC)
    infos = log.msg_info_multiple_dict
    if columns is None or LAYOUT_KEY not in infos:
        raise DatasetError(f"{path}: has no topic {TOPIC}: it was not flown with --record")
    if by_images and not (IMAGE_LAYOUT_KEY in infos and "vector[0]" in columns):
        raise DatasetError(f"{path}: {TOPIC}: holds no vectors of a policy that looks at pictures: none flew")
    layout_key = IMAGE_LAYOUT_KEY if by_images else LAYOUT_KEY
    try:
        layout = Layout.from_record(json.loads(info_text(log, layout_key)))
        if by_images:  # what it is judged by
            from policies.companion.tracked_recorder import RECORD_LAYOUT

            RECORD_LAYOUT.require(Layout.from_record(json.loads(info_text(log, LAYOUT_KEY))), f"{path}: {TOPIC}")
        config = config_of(info_text(log, CONFIG_KEY), path.parent) if CONFIG_KEY in infos else None
        arrays = {name: vector(columns, name) for name in ("frame", "action", "flown", "pos_ned", "vel_ned", "goal")}
        for name in ("yaw", "i_image", "is_flying", "is_first"):
            arrays[name] = columns[name]
        arrays["seen"] = vector(columns, "vector") if by_images else arrays["frame"]
    except LayoutError as error:
        raise DatasetError(str(error)) from error
    except (KeyError, ValueError, TypeError) as error:
        raise DatasetError(f"{path}: {TOPIC}: damaged, or of another version") from error
    rows = DecisionRows(
        source=f"{path.absolute().parent.name}/{path.name}",
        layout=layout,
        pilot=info_text(log, PILOT_KEY),
        time_us=columns["timestamp"],
        is_struck=struck(columns_of(log, SENSED), columns["timestamp"]),
        **{name: array.astype(np.float32) if array.dtype.kind == "f" else array for name, array in arrays.items()},
        context=_context(config),
    )
    return FlightSource(path, rows, _truth(log, config, rows.time_us) if by_truth and config is not None else None)


def struck(sensed: Columns | None, time_us: NDArray[Any]) -> NDArray[np.bool_]:
    """Whether a blow followed each decision, before the next; a log without the accelerometers tells of none."""
    if sensed is None or "accelerometer_m_s2[1]" not in sensed:
        return np.zeros(len(time_us), np.bool_)
    ahead, right = (sensed[f"accelerometer_m_s2[{k}]"] for k in range(2))
    blows_us = sensed["timestamp"][np.hypot(ahead, right) > JOLT_M_S2].astype(np.int64)
    begins_us = time_us.astype(np.int64)
    ends_us = np.minimum(np.append(begins_us[1:], np.iinfo(np.int64).max), begins_us + _BLOW_US)
    blows_us.sort()
    found: NDArray[np.bool_] = np.searchsorted(blows_us, ends_us) > np.searchsorted(blows_us, begins_us)
    return found


def _context(config: FlightConfig | None) -> dict[str, str | float]:
    if config is None:
        return {"airframe": "unknown"}
    return {"airframe": config.airframe, "wind_m_s": config.wind_m_s, "wind_from_deg": config.wind_from_deg}


def _truth(log: ULog, config: FlightConfig, time_us: NDArray[Any]) -> TruthRows | None:
    """The truth as it was last at each time; None: the log has none."""
    place, attitude, shown = (columns_of(log, name) for name in (PLACE, ATTITUDE, REPLAY_TOPIC.name))
    if place is None or attitude is None or shown is None:
        return None
    place, attitude, shown = (_at(columns, time_us) for columns in (place, attitude, shown))
    owner = None
    if config.owner is not None:
        owner = np.zeros(len(time_us), OWNER)
        for name in OWNER.names or ():
            many = OWNER[name].shape
            owner[name] = vector(shown, f"owner_{name}") if many else shown[f"owner_{name}"]
    return TruthRows(
        pos_ned=np.stack([place[axis] for axis in "xyz"], axis=1),
        vel_ned=np.stack([place[f"v{axis}"] for axis in "xyz"], axis=1),
        q_ned_from_frd=vector(attitude, "q")[:, [1, 2, 3, 0]],  # a log's begin with w
        height_m=place["dist_bottom"],
        is_on_ground=shown["is_on_ground"],
        owner=owner,
        world=flight_world(config).kernel if owner is not None else None,
    )


def _at(columns: Columns, time_us: NDArray[Any]) -> Columns:
    """A topic's rows as they were last at some times."""
    order = np.argsort(columns["timestamp"], kind="stable")
    found = np.searchsorted(columns["timestamp"], time_us, side="right", sorter=order) - 1
    rows = order[np.maximum(found, 0)]
    return {name: column[rows] for name, column in columns.items()}
