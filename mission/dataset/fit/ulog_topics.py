"""What a fit reads of a flight's ULog, in the forms that PX4's releases have given it: never the simulator's truth.

Topics are times [us] and rows of finite numbers, in order of time.
"""

from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyulog import ULog

from common.geodesy import DEFAULT_HOME
from mission.dataset.sources import Columns, columns_of, vector
from policies.datasets.episodes import DatasetError

MOTORS, OUTPUTS, POSITION, ATTITUDE = (
    "actuator_motors",
    "actuator_outputs",
    "vehicle_local_position",
    "vehicle_attitude",
)
RATES, IMU, BATTERY, LANDED = "vehicle_angular_velocity", "sensor_combined", "battery_status", "vehicle_land_detected"
TOPICS = (MOTORS, OUTPUTS, POSITION, ATTITUDE, RATES, IMU, BATTERY, LANDED)
_LATE_US = 250_000  # of a row after its sample: more is damage
_PULSES_US = 1000.0, 2000.0  # of an output at nothing and at full, where the log's parameters do not say it
_PULSE_LEAST_US, _PULSE_MOST_US = 900.0, 2200.0
_MOTOR_VALUES = 10  # more different ones has an output that is a motor
_CELL_MOST_V = 4.35  # of a lithium cell that is full
_MEASURED_LEAST_V = 2.0  # less is a battery that is not measured

Topic = tuple[NDArray[Any], NDArray[Any]]
"""Times [us] and rows."""


def needed(path: Path, log: ULog, topic: str) -> Columns:
    """A topic.

    Raises:
        DatasetError: the log has none.
    """
    columns = columns_of(log, topic)
    if columns is None:
        raise DatasetError(f"{path}: has no topic {topic}, which a fit needs")
    return columns


def fields(path: Path, columns: Columns, topic: str, names: str) -> NDArray[Any]:
    """Some fields of a topic as columns.

    Raises:
        DatasetError: it has one of them not.
    """
    for name in names.split():
        if name not in columns:
            raise DatasetError(f"{path}: topic {topic} has no field {name}, which a fit needs")
    return np.stack([columns[name] for name in names.split()], axis=1).astype(float)


def times_of(columns: Columns) -> NDArray[np.int64]:
    """When rows were valid: when they were sampled, where the log says it."""
    times = columns["timestamp"].astype(np.int64)
    sampled = columns.get("timestamp_sample", np.zeros_like(times)).astype(np.int64)
    return np.where((sampled > 0) & (np.abs(times - sampled) < _LATE_US), sampled, times)


def clean(topic: Topic) -> Topic:
    """Rows of finite numbers in order of time, one of each."""
    times, rows = topic
    is_finite = np.isfinite(rows).all(axis=1)
    times, first = np.unique(times[is_finite], return_index=True)
    return times, rows[is_finite][first].astype(float)


def velocity(path: Path, position: Columns) -> Topic:
    """North, east, down [m/s].

    Raises:
        DatasetError: the topic has them not.
    """
    return clean((times_of(position), fields(path, position, POSITION, "vx vy vz")))


def attitude(path: Path, log: ULog) -> Topic:
    """x, y, z, w from frd to ned, of which none lies on the other side of the sphere from the one before: q is -q.

    Raises:
        DatasetError: the log has none.
    """
    columns = needed(path, log, ATTITUDE)
    times, q = clean((times_of(columns), fields(path, columns, ATTITUDE, "q[1] q[2] q[3] q[0]")))
    leaps = (q[1:] * q[:-1]).sum(axis=1) < 0.0
    return times, np.asarray(q * np.cumprod(np.concatenate([[1.0], np.where(leaps, -1.0, 1.0)]))[: len(q), None])


def rates(path: Path, log: ULog) -> Topic:
    """Body rates [rad/s]: the estimate's, else the gyro's; until PX4 1.9 they may lie beside the attitude.

    Raises:
        DatasetError: the log has none.
    """
    columns = columns_of(log, RATES)
    if columns is not None:
        return clean((times_of(columns), fields(path, columns, RATES, "xyz[0] xyz[1] xyz[2]")))
    imu, beside = columns_of(log, IMU), columns_of(log, ATTITUDE)
    if imu is not None:
        return clean((times_of(imu), fields(path, imu, IMU, "gyro_rad[0] gyro_rad[1] gyro_rad[2]")))
    if beside is not None and "rollspeed" in beside:
        return clean((times_of(beside), fields(path, beside, ATTITUDE, "rollspeed pitchspeed yawspeed")))
    raise DatasetError(f"{path}: has no topic {RATES} nor {IMU}, one of which a fit needs")


def motors(path: Path, log: ULog, count: int, notes: list[str]) -> Topic:
    """Commands of each motor, 0 to 1.

    Raises:
        DatasetError: the log has none, or is of another number of motors.
    """
    columns = columns_of(log, MOTORS)
    if columns is None:
        return _pulses(path, log, count, notes)
    control = vector(columns, "control")
    used = control[:, (control > 0.0).any(axis=0)]  # NaN and nothing are no motor
    if used.shape[1] != count:
        raise DatasetError(f"{path}: {MOTORS} drives {used.shape[1]} motors, and the airframe has {count}")
    return clean((columns["timestamp"].astype(np.int64), np.clip(used, 0.0, 1.0)))


def _pulses(path: Path, log: ULog, count: int, notes: list[str]) -> Topic:
    """Commands from pulse lengths, which is all that PX4 logged until 1.12: the outputs that move are the motors."""
    instances = [data.data for data in log.data_list if data.name == OUTPUTS and len(data.data["timestamp"])]
    if not instances:
        raise DatasetError(f"{path}: has no topic {MOTORS} nor {OUTPUTS}, one of which a fit needs")
    for columns in instances:
        output = vector(columns, "output").astype(float)
        is_pulse = ((output >= _PULSE_LEAST_US) & (output <= _PULSE_MOST_US)).all(axis=0)
        moves = np.array([len(np.unique(column)) > _MOTOR_VALUES for column in output.T]) & is_pulse
        if moves.sum() == count:
            least, most = _pulse_bounds(log)
            notes.append(f"{path.name}: motor commands are those of pulses from {least:.0f} to {most:.0f} us")
            used = np.clip((output[:, moves] - least) / (most - least), 0.0, 1.0)
            return clean((columns["timestamp"].astype(np.int64), used))
    raise DatasetError(f"{path}: {OUTPUTS} has no {count} outputs that move, and the airframe has {count} motors")


def _pulse_bounds(log: ULog) -> tuple[float, float]:
    least, most = (
        float(log.initial_parameters.get(name, default))
        for name, default in zip(("PWM_MIN", "PWM_MAX"), _PULSES_US, strict=True)
    )
    return (least, most) if _PULSE_LEAST_US <= least < most <= _PULSE_MOST_US else _PULSES_US


def voltage(path: Path, log: ULog, cells: int, full_cell_v: float, notes: list[str]) -> Topic:
    """The battery's voltage over that of a full one, of as many cells as the log says or its voltage needs."""
    columns = columns_of(log, BATTERY)
    if columns is not None and "voltage_v" in columns:
        times, rows = clean((columns["timestamp"].astype(np.int64), columns["voltage_v"][:, None]))
        is_measured = rows[:, 0] > _MEASURED_LEAST_V
        if is_measured.any():
            times, rows = times[is_measured], rows[is_measured]
            said = int(np.median(columns["cell_count"])) if "cell_count" in columns else 0
            found = max(said, ceil(float(np.median(rows)) / _CELL_MOST_V))
            if found != cells:
                notes.append(f"{path.name}: its battery has {found} cells, the airframe's {cells}")
            return times, rows / (found * full_cell_v)
    notes.append(f"{path.name}: no voltage of a battery, which counts as full")
    return np.zeros(1, np.int64), np.ones((1, 1))


def altitude(position: Columns) -> Topic:
    """Above sea level [m]; where the log does not say where its origin lies, that is where flights boot."""
    ref_m = DEFAULT_HOME.alt_m
    if "ref_alt" in position:
        known = position["ref_alt"][np.isfinite(position["ref_alt"])]
        ref_m = float(np.median(known)) if len(known) else ref_m
    times, rows = clean((times_of(position), position["z"][:, None].astype(float)))
    return times, np.clip(ref_m - rows, -500.0, 10_000.0)
