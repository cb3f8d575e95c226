"""Records a flight: the ULog, and the history that the summary and the plots are made from.

In: the live kernel rows, copied raw once per frame. Out: columns, written once per simulated second, so that logging
costs a flight faster than real time almost nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from autopilot.mavlink.identity import project_version
from autopilot.node import FlightController
from autopilot.vehicle import LandedState, Severity
from common.airframe import Airframe
from common.ulog import UlogTopic, UlogWriter
from mission.topics import TOPICS, Batch, Columns
from sim.rig import Rig

FLUSH_FRAMES = 50
AIDS = {"gnss_pos": 2, "gnss_vel": 3, "gnss_height": 1, "baro": 1, "mag": 3, "range": 1}  # and their components
BAND_SIGMA = 1.959964  # 95 % of a normal distribution lie within
NAVIGATION_STATES = {0: 4, 1: 17, 2: 3, 3: 5, 4: 18, 5: 14}  # Mode -> vehicle_status.nav_state of PX4
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


@dataclass(slots=True)
class History:
    """What the summary needs of each frame; arrays of shape (frames,) or (frames, 3 or 4)."""

    time_us: Rows
    pos_ned_true: Rows
    vel_ned_true: Rows
    q_true: Rows
    pos_ned_est: Rows
    vel_ned_est: Rows
    q_est: Rows
    is_armed: Rows
    mode: Rows
    mission_seq: Rows
    battery_remaining: Rows


class _RawRow:
    """Copies of the first row of a live structured view."""

    def __init__(self, rows: Rows) -> None:
        self._dtype = rows.dtype
        first = rows[0] if rows.ndim > 1 else rows[:1]
        self._buffer = first.view(np.uint8).reshape(-1).data
        self._copies: list[bytes] = []

    def copy(self) -> None:
        self._copies.append(self._buffer.tobytes())

    def take(self) -> Rows:
        """The copies since the last call."""
        rows = np.frombuffer(b"".join(self._copies), dtype=self._dtype)
        self._copies.clear()
        return rows


class Recorder:
    """Logs vehicle 0 of a rig; attached to its flight controller, as a MAVLink server is.

    Args:
        path: of the ULog; None keeps only the history.
        rig: the simulation.
        controller: the flight controller of vehicle 0.
        airframe: for the log's header.
    """

    def __init__(self, path: Path | None, rig: Rig, controller: FlightController, airframe: Airframe) -> None:
        autopilot = rig.arrays.autopilot
        self._controller = controller
        self._time_us: list[int] = []
        self._status: list[tuple[int | float, ...]] = []
        self._status_before = np.zeros(1, STATUS_DTYPE)
        self._mission_reached = -1
        self._body = _RawRow(rig.arrays.body.numpy())
        self._sensors = _RawRow(rig.arrays.sensors.numpy())
        self._control = _RawRow(autopilot.control.numpy())
        self._estimator = _RawRow(autopilot.ekf.rows.numpy())
        self._imu_ring = _RawRow(autopilot.ekf.imu_ring.numpy())
        self._imu_time_us = 0
        imu_model = rig.arrays.sensor_model.numpy()["imu"][0]
        self._imu_limits = (imu_model["gyro_limit"].copy(), imu_model["accel_limit"].copy())
        self._samples_before = np.zeros(1, dtype=rig.arrays.sensors.numpy()["samples"].dtype)
        self._judged_us = dict.fromkeys(AIDS, 0)
        self._in_band = {name: [0, 0] for name in AIDS}
        self._history: list[History] = []
        self._log = None if path is None else _open_log(path, controller, airframe)
        self._topics: list[tuple[UlogTopic, Callable[[Batch], Any]]] = []
        if self._log is not None:
            self._topics = [(self._log.add_topic(topic.name, topic.fields), topic.columns) for topic in TOPICS]
            self._imu_topic = self._log.add_topic("sensor_combined", _IMU_FIELDS)
            self._status_topic = self._log.add_topic("vehicle_status", _STATUS_FIELDS)
            self._landed_topic = self._log.add_topic("vehicle_land_detected", _LANDED_FIELDS)
            self._mission_topic = self._log.add_topic("mission_result", _MISSION_FIELDS)

    def frame(self, time_us: int) -> None:
        """Notes the frame that is ending."""
        state = self._controller.state
        if state.mission_state in (NO_MISSION, NOT_STARTED):
            self._mission_reached = -1
        self._time_us.append(time_us)
        self._status.append(
            (
                state.mode,
                state.is_armed,
                state.is_failsafe,
                state.is_ready_to_arm,
                state.armed_since_us,
                state.landed_state,
                state.has_ground_contact,
                state.mission_current,
                self._mission_reached,
                state.mission_count,
                state.mission_state,
                state.battery_remaining,
                state.battery_used_mah,
            )
        )
        for rows in (self._body, self._sensors, self._control, self._estimator, self._imu_ring):
            rows.copy()
        if len(self._time_us) >= FLUSH_FRAMES:
            self.flush()

    def statustext(self, severity: Severity, text: str) -> None:
        """Logs a text of the vehicle."""
        if self._log is not None:
            self.flush()
            self._log.message(self._controller.state.time_us, int(severity), text)

    def mission_item_reached(self, seq: int) -> None:
        """Logged with the mission's progress."""
        self._mission_reached = seq

    def mission_current_changed(self, seq: int) -> None:
        """Logged with the mission's progress."""

    def home_changed(self) -> None:
        """Is in the vehicle's texts."""

    def heartbeat_now(self) -> None:
        """Mode and arming are logged each frame."""

    def flush(self) -> None:
        """Writes what has been noted since the last flush."""
        if not self._time_us:
            return
        estimator = self._estimator.take()
        samples = self._sensors.take()["samples"]
        status = np.array(self._status, dtype=STATUS_DTYPE)
        batch = Batch(
            time_us=np.array(self._time_us, dtype=np.uint64),
            estimate=estimator["estimate"],
            samples=samples,
            samples_before=self._samples_before,
            actuators=self._control.take()["actuators"],
            health=estimator,
            body=self._body.take(),
            vehicle=status,
            origin=self._controller.state.origin,
        )
        self._time_us.clear()
        self._status.clear()
        self._samples_before = samples[-1:].copy()
        self._count_innovations(estimator, status["is_armed"])
        self._history.append(_history(batch))
        imu = self._imu_ring.take()
        if self._log is not None:
            self._write(batch, imu)

    def innovations_in_band(self) -> dict[str, float]:
        """Share of normalised innovations within their 95 % band while armed, per source; NaN where none came."""
        return {name: inside / total if total else float("nan") for name, (inside, total) in self._in_band.items()}

    def _count_innovations(self, health: Rows, is_armed: Rows) -> None:
        for name, components in AIDS.items():
            judged_us = health[name]["judged_time_us"]
            is_new = is_armed & (np.diff(judged_us, prepend=self._judged_us[name]) != 0)
            self._judged_us[name] = int(judged_us[-1])
            innov = health[name]["innov"][is_new, :components]
            innov_var = health[name]["innov_var"][is_new, :components]
            is_inside = np.abs(innov) <= BAND_SIGMA * np.sqrt(innov_var)
            self._in_band[name][0] += int(np.count_nonzero(is_inside & (innov_var > 0.0)))
            self._in_band[name][1] += int(np.count_nonzero(innov_var > 0.0))

    def close(self) -> History:
        """Completes the log and returns the whole flight's history."""
        self.flush()
        if self._log is not None:
            self._log.close()
        names = History.__dataclass_fields__
        if not self._history:
            return History(*(np.empty(0) for _ in names))
        return History(*(np.concatenate([getattr(part, name) for part in self._history]) for name in names))

    def _write(self, batch: Batch, imu_rings: Rows) -> None:
        for topic, columns in self._topics:
            topic.write(columns(batch))
        times, first = np.unique(imu_rings["time_us"], return_index=True)
        imu = imu_rings[first[times > self._imu_time_us]]
        if len(imu):
            self._imu_time_us = int(imu["time_us"][-1])
            self._imu_topic.write(_imu_columns(imu, *self._imu_limits))
        self._write_status(batch)

    def _write_status(self, batch: Batch) -> None:
        """Vehicle state, landing and mission progress: when one of them changed, and twice a second."""
        status = batch.vehicle
        before = np.concatenate([self._status_before, status[:-1]])
        self._status_before = status[-1:].copy()
        is_logged = batch.time_us % STATUS_PERIOD_US == 0
        for name in _CHANGES_SHOWN:
            is_logged |= status[name] != before[name]
        rows, time_us = status[is_logged], batch.time_us[is_logged]
        for topic, columns in (
            (self._status_topic, _status_columns(rows)),
            (self._landed_topic, _landed_columns(rows)),
            (self._mission_topic, _mission_columns(rows)),
        ):
            topic.write({"timestamp": time_us, **columns})


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
_NAVIGATION_STATE = np.array([NAVIGATION_STATES[mode] for mode in range(len(NAVIGATION_STATES))])


def _status_columns(rows: Rows) -> Columns:
    return {
        "armed_time": np.where(rows["is_armed"], rows["armed_since_us"], 0),
        "arming_state": np.where(rows["is_armed"], ARMED, DISARMED),
        "nav_state": _NAVIGATION_STATE[rows["mode"]],
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


def _history(batch: Batch) -> History:
    estimate, body, status = batch.estimate, batch.body, batch.vehicle
    return History(
        time_us=batch.time_us,
        pos_ned_true=body["pos_ned"],
        vel_ned_true=body["vel_ned"],
        q_true=body["q_ned_from_frd"],
        pos_ned_est=estimate["pos_ned"],
        vel_ned_est=estimate["vel_ned"],
        q_est=estimate["q_ned_from_frd"],
        is_armed=status["is_armed"],
        mode=status["mode"].astype(int),
        mission_seq=status["mission_current"].astype(int),
        battery_remaining=status["battery_remaining"],
    )


def _open_log(path: Path, controller: FlightController, airframe: Airframe) -> UlogWriter:
    table = controller.params
    return UlogWriter(
        path,
        0,
        {"sys_name": "Honeyguide", "ver_hw": "SIMULATED", "ver_sw": project_version(), "airframe": airframe.name},
        {name: table[name] for name in table},
        {name: table.declarations[name].default for name in table},
    )
