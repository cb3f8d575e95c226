"""The ULog of a flight: which topics it has, and what listens to it while it grows.

In: batches of rows from the recorder, texts and parameter changes. Out: `flight.ulg`, and the same records to every
listener: log streaming, and the logs that outlive the run.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
import numpy.typing as npt

from autopilot.interface.mode_spec import ModeTable
from autopilot.interface.vehicle_state import LandedState, Severity
from autopilot.mavlink.services.identity import project_version
from common.airframe import Airframe
from common.logs.ulog import UlogTopic, UlogWriter
from common.params import ParameterTable
from mission.log.log_topics import TOPICS
from mission.log.topic import Batch, Columns, Topic

DISARMED, ARMED = 1, 2  # vehicle_status.arming_state
NO_MISSION, NOT_STARTED, COMPLETE = 1, 2, 5  # MISSION_STATE
STATUS_PERIOD_US = 500_000  # state is logged when it changes, and this often
STATUS_DTYPE = np.dtype(
    [
        ("mode", "u1"),
        ("is_armed", "?"),
        ("is_failsafe", "?"),
        ("is_ready_to_arm", "?"),
        ("armed_since_us", "u8"),
        ("landed_state", "u1"),
        ("has_ground_contact", "?"),
        ("mission_current", "u2"),
        ("mission_reached", "i4"),  # -1: none
        ("mission_count", "u2"),
        ("mission_state", "u1"),
        ("battery_remaining", "f8"),
        ("battery_used_mah", "f8"),
    ]
)
_CHANGES_SHOWN = [name for name in STATUS_DTYPE.names or () if not name.startswith("battery")]

Rows = npt.NDArray[Any]
_Table = tuple[UlogTopic, Rows, list[int]]
"""Records of a topic, and where those of each piece begin; one more for their end."""


class _Nowhere:
    """Takes the bytes of a log that only listeners want."""

    def write(self, data: bytes) -> int:
        return len(data)

    closed = False

    def flush(self) -> None:
        """Nothing is kept."""


class FlightLog:
    """Writes the topics of one flight.

    Args:
        path: of the ULog; None writes no file.
        airframe: for the log's header.
        params: for the log's header.
        modes: of the vehicle, for what the log calls them.
        imu_limits: largest gyro [rad/s] and accelerometer [m/s^2] reading.
        samples_before: Samples before the first frame, one row.
        on_trouble: is told when the file cannot be written, which then ends.
    """

    def __init__(
        self,
        path: Path | None,
        airframe: Airframe,
        params: ParameterTable,
        modes: ModeTable,
        imu_limits: tuple[float, float],
        samples_before: Rows,
        on_trouble: Callable[[str], None],
    ) -> None:
        target = path if path is not None else cast("BinaryIO", _Nowhere())
        self._log = _open_log(target, params, airframe, on_trouble)
        self._imu_limits = imu_limits
        self._nav_states = np.zeros(1 + max(modes), int)  # by mode
        for mode, spec in modes.items():
            self._nav_states[mode] = spec.nav_state
        self._imu_time_us = 0
        self._samples_before = samples_before
        self._status_before = np.zeros(1, STATUS_DTYPE)
        self._topics: list[tuple[UlogTopic, Topic]] = [
            (self._log.add_topic(topic.name, topic.fields), topic)
            for topic in TOPICS
            if not topic.parameter or topic.parameter in params
        ]
        self._imu_topic = self._log.add_topic("sensor_combined", _IMU_FIELDS)
        self._status_topic = self._log.add_topic("vehicle_status", _STATUS_FIELDS)
        self._landed_topic = self._log.add_topic("vehicle_land_detected", _LANDED_FIELDS)
        self._mission_topic = self._log.add_topic("mission_result", _MISSION_FIELDS)
        own = [self._imu_topic, self._status_topic, self._landed_topic, self._mission_topic]
        self._by_name = {topic.name: topic for topic in [*(topic for topic, _ in self._topics), *own]}

    def add(self, topic: Topic, info: Mapping[str, Sequence[str]]) -> None:
        """One more topic, and what it is read with; before the first row."""
        self._topics.append((self._log.add_topic(topic.name, topic.fields), topic))
        self._by_name[topic.name] = self._topics[-1][0]
        for key, texts in info.items():
            self._log.inform(key, texts)

    def add_rows(self, name: str, fields: Mapping[str, str], info: Mapping[str, Sequence[str]]) -> UlogTopic:
        """One more topic whose rows come one by one, not with the frames; before the first row."""
        self._by_name[name] = self._log.add_topic(name, fields)
        for key, texts in info.items():
            self._log.inform(key, texts)
        return self._by_name[name]

    def text(self, time_us: int, severity: Severity, text: str) -> None:
        """Logs a text of the vehicle."""
        self._log.message(time_us, int(severity), text)

    def parameter(self, name: str, value: int | float) -> None:
        """Logs a parameter change."""
        self._log.parameter(name, value)

    def listen(self, listener: Callable[[bytes], None], start_us: int) -> bytes:
        """The header of a log that begins at `start_us`; the listener gets its data."""
        self._log.listeners.append(listener)
        return self._log.header(start_us)

    def stop_listening(self, listener: Callable[[bytes], None]) -> None:
        self._log.listeners.remove(listener)

    @property
    def is_heard(self) -> bool:
        """Whether anybody listens."""
        return bool(self._log.listeners)

    def topics(self) -> Sequence[str]:
        return sorted(self._by_name)

    def latest(self, topic: str) -> Mapping[str, Any] | None:
        """The last row of a topic by field.

        Raises:
            KeyError: no such topic.
        """
        return self._by_name[topic].latest()

    def flush(self) -> None:
        """Hands what has been written to the file system; not once the log is complete."""
        self._log.flush()

    def parts(self) -> Sequence[Path]:
        """The files of the log; the last one is under way."""
        return self._log.parts()

    def close(self) -> None:
        """Completes the log."""
        self._log.close()

    def write(self, batch: Batch, imu_rings: Rows, is_kept: Rows) -> None:
        """Logs a batch of frames, and the IMU samples that came in them.

        Args:
            batch: the frames.
            imu_rings: the newest IMU samples at each of them, shape (frames, samples).
            is_kept: the frames to be logged if nobody listens; of the others the vehicle's state is.
        """
        is_whole = bool(is_kept.all() or self._log.listeners)
        if not is_whole and len(batch.begins) > 1:
            for begin, end in pairwise([*batch.begins, len(batch.time_us)]):
                piece = slice(begin, end)
                part = replace(batch.only(piece, self._samples_before), begins=(0,))
                self.write(part, imu_rings[piece], is_kept[piece])
            return
        kept = batch.only(slice(None) if is_whole else is_kept, self._samples_before)
        tables: list[_Table] = []
        if len(kept.time_us):
            self._samples_before = kept.samples[-1:].copy()
            tables += [self._table(topic, kept, form) for topic, form in self._topics]
        if is_whole:
            tables.append(self._imu_table(batch, imu_rings))
        tables += self._status_tables(batch)
        for k, begin in enumerate(batch.begins):  # the order is that of pieces written one by one
            self._log.go_on(int(batch.time_us[begin]))
            for topic, records, bounds in tables:
                topic.append(records[bounds[k] : bounds[k + 1]])

    def _table(self, topic: UlogTopic, batch: Batch, form: Topic) -> _Table:
        frames = None if form.frames is None else np.flatnonzero(form.frames(batch))
        return topic, topic.records(form.columns(batch)), _bounds(batch, frames)

    def _imu_table(self, batch: Batch, imu_rings: Rows) -> _Table:
        times = imu_rings["time_us"]
        is_new = times > self._imu_time_us
        is_new[1:] &= times[1:] != times[:-1]  # a sample stays in its slot for many frames
        _, first = np.unique(times[is_new], return_index=True)
        frames = np.nonzero(is_new)[0][first]
        imu = imu_rings[is_new][first]
        if len(imu):
            self._imu_time_us = int(imu["time_us"][-1])
        records = self._imu_topic.records(_imu_columns(imu, *self._imu_limits))
        return self._imu_topic, records, _bounds(batch, frames)

    def _status_tables(self, batch: Batch) -> list[_Table]:
        """Vehicle state, landing and mission progress: when one of them changed, and twice a second."""
        status = batch.vehicle
        before = np.concatenate([self._status_before, status[:-1]])
        self._status_before = status[-1:].copy()
        is_logged = batch.time_us % STATUS_PERIOD_US == 0
        for name in _CHANGES_SHOWN:
            is_logged |= status[name] != before[name]
        rows, time_us = status[is_logged], batch.time_us[is_logged]
        bounds = _bounds(batch, np.flatnonzero(is_logged))
        return [
            (topic, topic.records({"timestamp": time_us, **columns}), bounds)
            for topic, columns in (
                (self._status_topic, _status_columns(rows, self._nav_states)),
                (self._landed_topic, _landed_columns(rows)),
                (self._mission_topic, _mission_columns(rows)),
            )
        ]


def _bounds(batch: Batch, frames: Rows | None) -> list[int]:
    """Where the rows of each piece begin in a table, and its end; `frames`: which frame each row is of."""
    begins = [*batch.begins, len(batch.time_us)]
    bounds: list[int] = begins if frames is None else np.searchsorted(frames, begins).tolist()
    return bounds


_IMU_FIELDS = {
    "gyro_rad": "float[3]",
    "gyro_integral_dt": "uint32_t",
    "accelerometer_timestamp_relative": "int32_t",
    "accelerometer_m_s2": "float[3]",
    "accelerometer_integral_dt": "uint32_t",
    **dict.fromkeys("accelerometer_clipping gyro_clipping".split(), "uint8_t"),
}
_STATUS_FIELDS = {
    "armed_time": "uint64_t",
    **dict.fromkeys("arming_state nav_state".split(), "uint8_t"),
    **dict.fromkeys("failsafe pre_flight_checks_pass".split(), "bool"),
}
_LANDED_FIELDS = dict.fromkeys("ground_contact landed".split(), "bool")
_MISSION_FIELDS = {
    "seq_reached": "int32_t",
    **dict.fromkeys("seq_current seq_total".split(), "uint16_t"),
    **dict.fromkeys("valid finished".split(), "bool"),
}


def _status_columns(rows: Rows, nav_states: Rows) -> Columns:
    return {
        "armed_time": np.where(rows["is_armed"], rows["armed_since_us"], 0),
        "arming_state": np.where(rows["is_armed"], ARMED, DISARMED),
        "nav_state": nav_states[rows["mode"]],
        "failsafe": rows["is_failsafe"],
        "pre_flight_checks_pass": rows["is_ready_to_arm"],
    }


def _landed_columns(rows: Rows) -> Columns:
    is_landed = rows["landed_state"] == LandedState.ON_GROUND
    return {"ground_contact": rows["has_ground_contact"] | is_landed, "landed": is_landed}


def _mission_columns(rows: Rows) -> Columns:
    return {
        "seq_reached": rows["mission_reached"],
        "seq_current": rows["mission_current"],
        "seq_total": rows["mission_count"],
        "valid": rows["mission_count"] > 0,
        "finished": rows["mission_state"] == COMPLETE,
    }


def _imu_columns(imu: Rows, gyro_limit: float, accel_limit: float) -> Columns:
    period_us = np.round(imu["dt_s"] * 1e6).astype(np.uint32)
    return {
        "timestamp": imu["time_us"],
        "gyro_rad": imu["gyro_frd"],
        "gyro_integral_dt": period_us,
        "accelerometer_timestamp_relative": 0,
        "accelerometer_m_s2": imu["accel_frd"],
        "accelerometer_integral_dt": period_us,
        "accelerometer_clipping": _clipped_axes(imu["accel_frd"], accel_limit),
        "gyro_clipping": _clipped_axes(imu["gyro_frd"], gyro_limit),
    }


def _clipped_axes(samples: Rows, limit: float) -> Rows:
    """Bit 0, 1, 2: x, y, z stands at the sensor's limit."""
    bits: Rows = (np.abs(samples) >= limit) @ np.array([1, 2, 4])
    return bits


def _open_log(
    target: Path | BinaryIO, table: ParameterTable, airframe: Airframe, on_trouble: Callable[[str], None]
) -> UlogWriter:
    return UlogWriter(
        target,
        0,
        {"sys_name": "Honeyguide", "ver_hw": "SIMULATED", "ver_sw": project_version(), "airframe": airframe.name},
        {name: table[name] for name in table},
        {name: table.declarations[name].default for name in table},
        on_trouble,
    )
