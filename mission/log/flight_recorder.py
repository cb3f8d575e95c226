"""Records a flight: the ULog, and the history that the summary and the plots are made from.

In: the live kernel rows, copied raw once per frame. Out: columns, made for many frames at once, so that logging costs a
flight faster than real time almost nothing. The log is in pieces of a second, written as they end in a flight that
somebody may watch, and some at once in any other; its bytes are the same.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from autopilot.estimator.sensors import sensors_of
from autopilot.flight_controller import FlightController
from autopilot.interface.platform import LogListener
from autopilot.interface.vehicle_state import Severity
from autopilot.ports import AIRSPEED_VALID
from common.airframe import Airframe
from common.params import Parameter
from mission.log.control_topics import servo_topic
from mission.log.flight_log import STATUS_DTYPE, FlightLog
from mission.log.kept_frames import FrameChoice, KeptRows
from mission.log.motion_topics import STEERING_TOPIC
from mission.log.replay_topic import REPLAY_TOPIC, SHOWN
from mission.log.topic import Batch
from sim.rig import Rig

PIECE_FRAMES = 50
FRAMES_MAX = 5 * PIECE_FRAMES  # written at once
BAND_SIGMA = 1.959964  # 95 % of a normal distribution lie within
NO_MISSION, NOT_STARTED = 1, 2  # MISSION_STATE

Rows = npt.NDArray[Any]


HISTORY = np.dtype(
    [
        ("time_us", "u8"),
        ("pos_ned_true", "f4", 3),
        ("vel_ned_true", "f4", 3),
        ("q_true", "f4", 4),
        ("pos_ned_est", "f4", 3),
        ("vel_ned_est", "f4", 3),
        ("q_est", "f4", 4),
        ("is_armed", "?"),
        ("mode", "i4"),
        ("mission_seq", "i4"),
        ("battery_remaining", "f8"),
        ("airspeed", "f4"),
    ]
)


@dataclass(slots=True)
class History:
    """What the summary needs of each frame kept; arrays of shape (frames,) or (frames, 3 or 4)."""

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
    airspeed: Rows
    """[m/s] indicated, as it is believed; NaN: none."""


class _RawRow:
    """Copies of the first row of a live structured view, of as many frames as are written at once."""

    def __init__(self, rows: Rows) -> None:
        first = rows[0] if rows.ndim > 1 else rows[:1]
        self.source = first.view(np.uint8).reshape(-1).data
        self.copies = np.empty((FRAMES_MAX, *rows.shape[1:]), rows.dtype)
        self.target = self.copies.view(np.uint8).reshape(-1).data
        self.size = len(self.source)


class Recorder:
    """Logs vehicle 0 of a rig; attached to its flight controller, as a MAVLink server is.

    Args:
        path: of the ULog; None keeps only the history.
        rig: the simulation.
        controller: the flight controller of vehicle 0.
        airframe: for the log's header.
        on_trouble: is told when the log cannot be written, which then ends.
    """

    def __init__(
        self,
        path: Path | None,
        rig: Rig,
        controller: FlightController,
        airframe: Airframe,
        on_trouble: Callable[[str], None],
    ) -> None:
        live = rig.rows
        self._controller = controller
        self._time_us: list[int] = []
        self._status: list[tuple[int | float, ...]] = []
        self._mission_reached = -1
        self._truth = _RawRow(live["truth"])
        self._sensors = _RawRow(live["sensors"])
        self._control = _RawRow(live["autopilot.control"])
        self._estimator = _RawRow(live["autopilot.ekf.rows"])
        self._yaw = _RawRow(live["autopilot.ekf.yaw"])
        self._imu_ring = _RawRow(live["autopilot.ekf.imu_ring"])
        self._raw = (self._truth, self._sensors, self._control, self._estimator, self._yaw, self._imu_ring)
        imu_model = live["sensor_model"]["imu"][0]
        self._imu_limits = (float(imu_model["gyro_limit"]), float(imu_model["accel_limit"]))
        self._samples_before = np.zeros(1, dtype=live["sensors"]["samples"].dtype)
        sensors = sensors_of(controller.params)
        self._aids = {aid.name: aid.axes for sensor in sensors for aid in sensor.aids}  # and their components
        self._judged_us = dict.fromkeys(self._aids, 0)
        self._in_band = {name: [0, 0] for name in self._aids}
        self._choice = FrameChoice()
        self._is_kept: list[bool] = []
        self._begins = [0]  # the pieces, as indices of the frames noted
        self.is_live = False  # each piece is written when it ends
        self._history = KeptRows(HISTORY)
        self._path = path
        self._airframe = airframe
        self._on_trouble = on_trouble
        self._log: FlightLog | None = None if path is None else self._new_log()
        self._take_shown: Callable[[Rows], None] | None = None
        self._shown = np.zeros(FRAMES_MAX, SHOWN)
        self._changed: dict[str, int | float] = {}  # parameters, since the last flush
        controller.params.on_change(self._parameter_changed)

    def _new_log(self) -> FlightLog:
        params, before = self._controller.params, self._samples_before
        modes = self._controller.modes
        log = FlightLog(self._path, self._airframe, params, modes, self._imu_limits, before, self._on_trouble)
        servos = servo_topic(self._controller.state.outputs)
        if servos is not None:
            log.add(servos, {})
            log.add(STEERING_TOPIC, {})
        return log

    @property
    def folder(self) -> Path | None:
        """Of the run; none is kept."""
        return None if self._path is None else self._path.parent

    def keep_for_replay(self, take: Callable[[Rows], None], info: Mapping[str, Sequence[str]]) -> None:
        """The log, if there is one, shall also hold what a replay shows; before the first frame.

        Args:
            take: called once per frame, with the row of SHOWN to be filled.
            info: what the replay is made with; texts by key.
        """
        if self._log is not None:
            self._take_shown = take
            self._log.add(REPLAY_TOPIC, info)

    def keep_topic(
        self, name: str, fields: Mapping[str, str], info: Mapping[str, Sequence[str]]
    ) -> Callable[..., None]:
        """The log, if there is one, shall also hold a topic of somebody else's; before the first frame.

        Args:
            name: of the topic.
            fields: ULog type by field name.
            info: what it is read with; texts by key.

        Returns:
            What writes a row: its time [us], its values.
        """
        if self._log is None:
            return lambda *_: None
        return self._log.add_rows(name, fields, info).write_row

    def frame(self, time_us: int) -> None:
        """Notes the frame that is ending."""
        state = self._controller.state
        if state.mission_state in (NO_MISSION, NOT_STARTED):
            self._mission_reached = -1
        self._time_us.append(time_us)
        self._is_kept.append(self._choice.keeps(time_us, is_armed=state.is_armed))
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
        count = len(self._time_us)
        for rows in self._raw:
            end = count * rows.size
            rows.target[end - rows.size : end] = rows.source
        if self._take_shown is not None:
            self._take_shown(self._shown[count - 1])
        if count - self._begins[-1] >= PIECE_FRAMES:
            self._end_piece(count)

    def _end_piece(self, count: int) -> None:
        """Writes what has been noted if there is no room for more, or somebody waits for it."""
        is_heard = self._log is not None and self._log.is_heard
        if self.is_live or is_heard or self._changed or count == FRAMES_MAX:
            self.flush()
        else:
            self._begins.append(count)

    def statustext(self, severity: Severity, text: str) -> None:
        """Logs a text of the vehicle."""
        if self._log is not None:
            self.flush()
            self._log.text(self._controller.state.time_us, severity, text)

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
        self._write(len(self._time_us))

    def _write(self, count: int) -> None:
        """Writes the first frames noted."""
        if not count:
            return
        estimator = self._estimator.copies[:count]
        samples = self._sensors.copies[:count]["samples"]
        status = np.array(self._status[:count], dtype=STATUS_DTYPE)
        batch = Batch(
            time_us=np.array(self._time_us[:count], dtype=np.uint64),
            estimate=estimator["estimate"],
            samples=samples,
            samples_before=self._samples_before,
            actuators=self._control.copies[:count]["actuators"],
            health=estimator,
            yaw=self._yaw.copies[:count],
            truth=self._truth.copies[:count],
            vehicle=status,
            origin=self._controller.state.origin,
            outputs=self._controller.state.outputs,
            shown=None if self._take_shown is None else self._shown[:count],
            begins=tuple(begin for begin in self._begins if begin < count),
        )
        is_kept = np.array(self._is_kept[:count])
        self._samples_before = samples[-1:].copy()
        self._count_innovations(estimator, status["is_armed"])
        self._history.add(_history(batch), is_kept)
        if self._log is not None:
            self._log.write(batch, self._imu_ring.copies[:count], is_kept)
            for name, value in self._changed.items():
                self._log.parameter(name, value)
        self._changed.clear()
        self._forget(count)

    def _forget(self, count: int) -> None:
        """The first frames have been written: room for others."""
        rest = len(self._time_us) - count
        del self._time_us[:count], self._is_kept[:count], self._status[:count]
        self._begins = [0]
        if rest:
            for rows in self._raw:
                rows.copies[:rest] = rows.copies[count : count + rest]
            self._shown[:rest] = self._shown[count : count + rest]

    def _parameter_changed(self, declaration: Parameter) -> None:
        self._changed[declaration.name] = self._controller.params[declaration.name]

    # ---- autopilot.interface.platform.LogStream ----

    def listen(self, listener: LogListener) -> bytes:
        """What has been noted of the present piece is the listener's too: the moments before it began to listen."""
        self._write(self._begins[-1])
        since_us = self._time_us[0] if self._time_us else self._controller.state.time_us
        return self._stream().listen(listener, since_us)

    def stop_listening(self, listener: LogListener) -> None:
        self.flush()
        self._stream().stop_listening(listener)

    def topics(self) -> Sequence[str]:
        return self._stream().topics()

    def latest(self, topic: str) -> Mapping[str, Any] | None:
        self.flush()
        return self._stream().latest(topic)

    def _stream(self) -> FlightLog:
        """The log; where no file is written it begins when somebody wants it."""
        if self._log is None:
            self._log = self._new_log()
        return self._log

    def flush_file(self) -> None:
        """Hands everything up to now to the file system."""
        self.flush()
        if self._log is not None:
            self._log.flush()

    def log_parts(self) -> Sequence[Path]:
        """The files of the log, the last one under the name that it has or will have."""
        return self._stream().parts()

    def innovations_in_band(self) -> dict[str, float]:
        """Share of normalised innovations within their 95 % band while armed, per source; NaN where none came."""
        return {name: inside / total if total else float("nan") for name, (inside, total) in self._in_band.items()}

    def _count_innovations(self, health: Rows, is_armed: Rows) -> None:
        for name, components in self._aids.items():
            judged_us = health[name]["judged_time_us"]
            is_new = is_armed & (np.diff(judged_us, prepend=self._judged_us[name]) != 0)
            self._judged_us[name] = int(judged_us[-1])
            innov = health[name]["innov"][is_new, :components]
            innov_var = health[name]["innov_var"][is_new, :components]
            is_inside = np.abs(innov) <= BAND_SIGMA * np.sqrt(
                np.maximum(innov_var, 0.0)
            )  # a broken filter's may be negative
            self._in_band[name][0] += int(np.count_nonzero(is_inside & (innov_var > 0.0)))
            self._in_band[name][1] += int(np.count_nonzero(innov_var > 0.0))

    def close(self) -> History:
        """Completes the log and returns the whole flight's history."""
        self.flush()
        if self._log is not None:
            self._log.close()
        rows = self._history.all()
        return History(*(rows[name] for name in HISTORY.names or ()))


def _history(batch: Batch) -> Rows:
    """The frames as rows of HISTORY."""
    estimate, truth, status = batch.estimate, batch.truth, batch.vehicle
    rows = np.empty(len(batch.time_us), HISTORY)
    rows["time_us"] = batch.time_us
    rows["pos_ned_true"] = truth["pos_ned"]
    rows["vel_ned_true"] = truth["vel_ned"]
    rows["q_true"] = truth["q_ned_from_frd"]
    rows["pos_ned_est"] = estimate["pos_ned"]
    rows["vel_ned_est"] = estimate["vel_ned"]
    rows["q_est"] = estimate["q_ned_from_frd"]
    rows["is_armed"] = status["is_armed"]
    rows["mode"] = status["mode"]
    rows["mission_seq"] = status["mission_current"]
    rows["battery_remaining"] = status["battery_remaining"]
    rows["airspeed"] = np.where(estimate["flags"] & int(AIRSPEED_VALID), estimate["airspeed"], np.nan)
    return rows
