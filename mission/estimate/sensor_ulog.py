"""PX4 flight logs as recordings: which topics and fields hold the sensors, from PX4 1.5 of 2016 to today's.

Sensors come from the topics PX4's own estimator reads, and from raw ones where those were not logged. Times are those
of validity: `timestamp_sample` where it is set, less the EKF2_*_DELAY of the log where it is not.
"""

from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from autopilot.estimator.sensor_spec import SensorSpec
from autopilot.estimator.sensors import FUSED_SENSORS
from common.geodesy import GeoPoint
from mission.estimate.sensor_log import (
    BARO_DTYPE,
    FIX_DTYPE,
    IMU_DTYPE,
    MAG_DTYPE,
    MIN_IMU_RATE_HZ,
    RANGE_DTYPE,
    UNKNOWN_STD,
    Recording,
    Rows,
    SensorLogError,
    Track,
    empty,
)
from mission.log.ulog_file import UlogDamage, read_topics

MAGIC = b"ULog\x01\x12\x35"
OWN_NAME = "Honeyguide"  # sys_name of this project's logs
PX4_GPS_DELAY_MS = 110.0  # PX4's default of EKF2_GPS_DELAY
MAX_DELAY_MS = 300.0  # PX4's maximum of the EKF2_*_DELAY
RELATIVE_INVALID = 2**31 - 1  # PX4's RELATIVE_TIMESTAMP_INVALID
MAX_STRAY_M, MAX_STRAY_M_S = 5.0, 5.0  # of a record of the log's answer from its neighbours; guess
STRAY_ROWS = 2  # neighbours on each side: two damaged records in a row are found
MAX_NORM_ERROR = 0.01  # of an attitude quaternion
REF_ROWS = 5
FACING_DOWN = 25  # distance_sensor.orientation
SEA_LEVEL_PA, HEIGHT_SCALE_M, ISA_EXPONENT = 101325.0, 44330.77, 5.2558797  # ISO 2533, as in the barometer's fusion

READ_HERE = {"gnss", "baro", "mag", "range"}  # from all forms that they have had
OTHERS = tuple(sensor for sensor in FUSED_SENSORS if sensor.name not in READ_HERE)
TOPICS = (
    "sensor_combined vehicle_imu vehicle_gps_position sensor_gps vehicle_air_data sensor_baro vehicle_magnetometer "
    "sensor_mag distance_sensor vehicle_attitude vehicle_local_position vehicle_attitude_groundtruth "
    "vehicle_local_position_groundtruth"
).split() + [sensor.topic.name for sensor in OTHERS if sensor.topic]


class _Columns:
    """One topic instance: its fields as arrays."""

    def __init__(self, data: dict[str, npt.NDArray[Any]], place: str) -> None:
        self._data = data
        self._place = place

    def __contains__(self, name: str) -> bool:
        return name in self._data

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        if name not in self._data:
            raise SensorLogError(f"{self._place} has no field {name}")
        return self._data[name]

    def get(self, name: str, default: float) -> npt.NDArray[Any]:
        """The field, or its default where this version of the topic has none."""
        return self[name] if name in self else np.full(len(self["timestamp"]), default)

    def vector(self, name: str, count: int = 3) -> npt.NDArray[Any]:
        return np.stack([self[f"{name}[{axis}]"] for axis in range(count)], axis=1)

    def axes(self, names: str) -> npt.NDArray[Any]:
        return np.stack([self[name] for name in names.split()], axis=1)

    def time_us(self, delay_s: float = 0.0) -> npt.NDArray[Any]:
        """Times of validity: `timestamp_sample`, or `timestamp` less the sensor's delay where it is not set."""
        timestamp = self["timestamp"].astype(np.int64)
        sampled = self.get("timestamp_sample", 0).astype(np.int64)
        return np.where(sampled > 0, sampled, timestamp - round(delay_s * 1e6))


class _Log:
    """The topics of a log, by name."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self.ulog = read_topics(path, TOPICS)
        except UlogDamage as error:
            raise SensorLogError(str(error)) from error
        values = self.ulog.initial_parameters.items()  # bytes where the type is damaged
        self.parameters = {name: float(value) for name, value in values if isinstance(value, int | float)}

    def topic(self, name: str, *needed: str) -> _Columns | None:
        """The first instance of a topic, if it was logged with the needed fields."""
        instances = sorted((data for data in self.ulog.data_list if data.name == name), key=lambda data: data.multi_id)
        columns = self._columns(instances[0]) if instances else None
        return columns if columns is not None and all(field in columns for field in ("timestamp", *needed)) else None

    def instances(self, name: str) -> list[_Columns]:
        return [self._columns(data) for data in self.ulog.data_list if data.name == name]

    def _columns(self, data: Any) -> _Columns:
        return _Columns(data.data, f"{self.path}: topic {data.name}")

    def delay_s(self, name: str, default_ms: float = 0.0) -> float:
        """A delay parameter of the log."""
        value_ms = self.parameters.get(name, default_ms)
        return (value_ms if 0.0 <= value_ms <= MAX_DELAY_MS else default_ms) * 1e-3


@np.errstate(invalid="ignore", over="ignore")  # numbers of a damaged log; `prepare` leaves them out
def read_ulog(path: Path, *, ignores_velocity_flag: bool = False) -> Recording:
    """Reads the sensors of a PX4 log; one that was cut short is read as far as it goes.

    Args:
        path: of the log.
        ignores_velocity_flag: GNSS velocities count as valid though the receiver says they are not.

    Raises:
        SensorLogError: it cannot be read, or has no IMU samples.
    """
    log = _Log(path)
    is_own = log.ulog.msg_info_dict.get("sys_name") == OWN_NAME
    gnss_delay_s = log.delay_s("EKF2_GPS_DELAY", 0.0 if is_own else PX4_GPS_DELAY_MS)
    notes: list[str] = []
    recording = Recording(
        path=path,
        imu=_imu(log),
        fixes=_fixes(log, gnss_delay_s, ignores_velocity_flag),
        baro=_baro(log),
        mag=_mag(log),
        range=_range(log),
        others={sensor.name: _sampled(log, sensor) for sensor in OTHERS},
        is_own=is_own,
        parameters=log.parameters,
        gnss_delay_s=gnss_delay_s,
        notes=notes,
    )
    for name, suffix in (("log's own estimate", ""), ("truth in the log", "_groundtruth")):
        track = _track(log, name, suffix, notes)
        if track is not None:
            recording.tracks.append(track)
    if log.ulog.file_corruption:
        recording.notes.append("the log is damaged: what could be read of it was used")
    if log.ulog.dropouts:
        lost_s = sum(dropout.duration for dropout in log.ulog.dropouts) * 1e-3
        recording.notes.append(f"the logger dropped data {len(log.ulog.dropouts)} time(s), {lost_s:.2f} s together")
    return recording


def _imu(log: _Log) -> Rows:
    combined = log.topic("sensor_combined", "gyro_rad[0]", "accelerometer_m_s2[0]")
    if combined is not None:
        imu = np.zeros(len(combined["timestamp"]), dtype=IMU_DTYPE)
        imu["time_us"] = combined["timestamp"].astype(np.int64)
        imu["gyro_frd"] = combined.vector("gyro_rad")
        imu["accel_frd"] = combined.vector("accelerometer_m_s2")
        imu["dt_s"] = combined.get("gyro_integral_dt", 0.0) * 1e-6  # 1.4 and before wrote seconds: read as unknown
        return imu
    integrated = log.topic("vehicle_imu", "delta_angle[0]", "delta_velocity[0]", "delta_angle_dt", "delta_velocity_dt")
    if integrated is not None:
        times = integrated.time_us()
        if len(times) > 1 and np.median(np.diff(times)) < 1e6 / MIN_IMU_RATE_HZ:
            angle_dt_s = np.maximum(integrated["delta_angle_dt"], 1) * 1e-6
            vel_dt_s = np.maximum(integrated["delta_velocity_dt"], 1) * 1e-6
            imu = np.zeros(len(times), dtype=IMU_DTYPE)
            imu["time_us"] = times
            imu["dt_s"] = angle_dt_s
            imu["gyro_frd"] = integrated.vector("delta_angle") / angle_dt_s[:, None]
            imu["accel_frd"] = integrated.vector("delta_velocity") / vel_dt_s[:, None]
            return imu
    raise SensorLogError(
        f"{log.path}: no IMU samples: topic sensor_combined is missing, and vehicle_imu is missing or slower than "
        f"{MIN_IMU_RATE_HZ:g} Hz"
    )


def _fixes(log: _Log, delay_s: float, ignores_velocity_flag: bool) -> Rows:
    fields = ("vel_n_m_s", "vel_e_m_s", "vel_d_m_s", "eph", "epv", "s_variance_m_s", "fix_type", "satellites_used")
    gps = log.topic("vehicle_gps_position", *fields) or log.topic("sensor_gps", *fields)
    if gps is None or not ("latitude_deg" in gps or "lat" in gps):
        return empty(FIX_DTYPE)
    fixes = np.zeros(len(gps["timestamp"]), dtype=FIX_DTYPE)
    fixes["time_us"] = gps.time_us(delay_s)
    if "latitude_deg" in gps:
        fixes["lat_deg"], fixes["lon_deg"] = gps["latitude_deg"], gps["longitude_deg"]
        fixes["alt_m"] = gps["altitude_msl_m"]
    else:  # until 1.14: integers of 1e-7 degrees and of millimetres
        fixes["lat_deg"], fixes["lon_deg"] = gps["lat"] * 1e-7, gps["lon"] * 1e-7
        fixes["alt_m"] = gps["alt"] * 1e-3
    vel_ned = gps.axes("vel_n_m_s vel_e_m_s vel_d_m_s")
    has_vel = np.isfinite(vel_ned).all(axis=1) & np.isfinite(gps["s_variance_m_s"])
    if not ignores_velocity_flag:
        has_vel &= gps.get("vel_ned_valid", 1.0) != 0
    fixes["vel_ned"] = np.where(has_vel[:, None], vel_ned, 0.0)
    fixes["pos_h_std"], fixes["pos_v_std"] = gps["eph"], gps["epv"]
    fixes["vel_std"] = np.where(has_vel, gps["s_variance_m_s"], UNKNOWN_STD)
    fixes["fix_type"] = gps["fix_type"]
    fixes["satellites"] = gps["satellites_used"]
    return fixes


def _baro(log: _Log) -> Rows:
    delay_s = log.delay_s("EKF2_BARO_DELAY")
    air = log.topic("vehicle_air_data", "baro_pressure_pa")
    if air is not None:
        return _pressures(air.time_us(delay_s), air["baro_pressure_pa"], air.get("baro_temp_celcius", 15.0))
    raw = log.topic("sensor_baro", "pressure")
    if raw is not None:
        pressure = raw["pressure"].astype(float)
        if np.nanmedian(pressure) < 2000.0:  # until 1.13 in millibar
            pressure = pressure * 100.0
        return _pressures(raw.time_us(delay_s), pressure, raw.get("temperature", 15.0))
    for name in ("vehicle_air_data", "sensor_combined"):  # the latter until 1.7
        heights = log.topic(name, "baro_alt_meter")
        if heights is not None:
            height_m = heights["baro_alt_meter"].astype(float)
            pressure = SEA_LEVEL_PA * np.maximum(1.0 - height_m / HEIGHT_SCALE_M, 0.0) ** ISA_EXPONENT
            times = _relative_times(heights, "baro_timestamp_relative")
            return _pressures(times, pressure, heights.get("baro_temp_celcius", 15.0))
    return empty(BARO_DTYPE)


def _pressures(time_us: Rows, pressure_pa: Rows, temperature_c: Rows) -> Rows:
    baro = np.zeros(len(time_us), dtype=BARO_DTYPE)
    baro["time_us"] = time_us
    baro["pressure_pa"] = pressure_pa
    baro["temperature_c"] = np.where(np.isfinite(temperature_c), temperature_c, 15.0)
    return baro


def _relative_times(columns: _Columns, name: str) -> npt.NDArray[Any]:
    """Times of a value that was logged beside the IMU; 0 where there was none."""
    relative = columns.get(name, 0).astype(np.int64)
    return np.where(relative == RELATIVE_INVALID, 0, columns["timestamp"].astype(np.int64) + relative)


def _mag(log: _Log) -> Rows:
    delay_s = log.delay_s("EKF2_MAG_DELAY")
    calibrated = log.topic("vehicle_magnetometer", "magnetometer_ga[0]")
    if calibrated is not None:
        return _fields(calibrated.time_us(delay_s), calibrated.vector("magnetometer_ga"))
    raw = log.topic("sensor_mag", "x", "y", "z")
    if raw is not None:
        return _fields(raw.time_us(delay_s), raw.axes("x y z"))
    combined = log.topic("sensor_combined", "magnetometer_ga[0]")  # until 1.7
    if combined is not None:
        times = _relative_times(combined, "magnetometer_timestamp_relative")
        return _fields(times, combined.vector("magnetometer_ga"))
    return empty(MAG_DTYPE)


def _fields(time_us: Rows, field_frd_gauss: Rows) -> Rows:
    mag = np.zeros(len(time_us), dtype=MAG_DTYPE)
    mag["time_us"] = time_us
    mag["field_frd_gauss"] = field_frd_gauss
    return mag


def _range(log: _Log) -> Rows:
    delay_s = log.delay_s("EKF2_RNG_DELAY")
    for sensor in log.instances("distance_sensor"):
        faces_down = sensor.get("orientation", FACING_DOWN) == FACING_DOWN
        if faces_down.any() and "current_distance" in sensor:
            distance = sensor["current_distance"].astype(float)
            ranges = np.zeros(len(distance), dtype=RANGE_DTYPE)
            ranges["time_us"] = sensor.time_us(delay_s)
            ranges["distance_m"] = distance
            ranges["is_valid"] = (
                (distance >= sensor.get("min_distance", 0.0))
                & (distance <= sensor.get("max_distance", np.inf))
                & (sensor.get("signal_quality", -1) != 0)
            )
            downward: Rows = ranges[faces_down]
            return downward
    return empty(RANGE_DTYPE)


def _sampled(log: _Log, sensor: SensorSpec) -> Rows:
    """The samples of a sensor, from its topic as this project writes it."""
    topic = sensor.topic
    columns = (
        log.topic(topic.name, *(f"{field}[0]" if kind.endswith("]") else field for field, kind in topic.fields.items()))
        if topic
        else None
    )
    if topic is None or columns is None:
        return empty(sensor.dtype)
    rows = np.zeros(len(columns["timestamp"]), dtype=sensor.dtype)
    for field, part in topic.holds.items():
        width = rows[part].shape[1:]
        rows[part] = columns.vector(field, *width) if width else columns[field]
    return rows


def _track(log: _Log, name: str, suffix: str, notes: list[str]) -> Track | None:
    place = log.topic(f"vehicle_local_position{suffix}", "x", "y", "z", "vx", "vy", "vz")
    attitude = log.topic(f"vehicle_attitude{suffix}", "q[0]")
    if place is None or attitude is None:
        return None
    is_valid = np.ones(len(place["timestamp"]), dtype=bool)
    for flag in ("xy_valid", "v_xy_valid", "z_valid"):
        is_valid &= place.get(flag, 1.0) != 0
    pos_ned = place.axes("x y z").astype(float)
    vel_ned = place.axes("vx vy vz").astype(float)
    q = attitude.vector("q", 4)[:, [1, 2, 3, 0]].astype(float)
    is_unit = np.abs(np.linalg.norm(q, axis=1) - 1.0) < MAX_NORM_ERROR
    is_whole = is_valid.copy()
    is_whole[is_valid] = _is_smooth(pos_ned[is_valid], MAX_STRAY_M) & _is_smooth(vel_ned[is_valid], MAX_STRAY_M_S)
    stray_count = np.count_nonzero(is_valid & ~is_whole) + np.count_nonzero(~is_unit)
    if stray_count:
        notes.append(f"{stray_count} damaged record(s) of the {name} were left out")
    last = {
        field: float(np.median(place.get(field, np.nan)[-REF_ROWS:])) for field in ("ref_lat", "ref_lon", "ref_alt")
    }
    has_ref = all(isfinite(value) for value in last.values()) and (last["ref_lat"], last["ref_lon"]) != (0.0, 0.0)
    return Track(
        name=name,
        ref=GeoPoint(last["ref_lat"], last["ref_lon"], last["ref_alt"]) if has_ref else None,
        pos_time_us=place.time_us()[is_whole],
        pos_ned=pos_ned[is_whole],
        vel_ned=vel_ned[is_whole],
        q_time_us=attitude.time_us()[is_unit],
        q_ned_from_frd=q[is_unit],
    )


def _is_smooth(vectors: npt.NDArray[Any], most: float) -> npt.NDArray[Any]:
    """Whether each row is a finite number and not alone far from its neighbours: within `most` of their median."""
    if not len(vectors):
        return np.zeros(0, dtype=bool)
    finite = np.where(np.isfinite(vectors), vectors, np.inf)
    window = np.pad(finite, ((STRAY_ROWS, STRAY_ROWS), (0, 0)), mode="edge")
    neighbours = np.stack([window[first : first + len(vectors)] for first in range(2 * STRAY_ROWS + 1)])
    smooth: npt.NDArray[Any] = (np.abs(vectors - np.median(neighbours, axis=0)) < most).all(axis=1)
    return smooth
