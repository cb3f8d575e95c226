"""Recorded sensors, made ready for the estimator: sorted, without gaps, in the tangent plane of the first good fix.

In: the tables of one log, as `sensor_ulog` and `sensor_csv` read them. Out: rows of the kernels' sample structs, one
array per sensor, and the stretches of IMU samples that hold together.
"""

from dataclasses import dataclass, field
from itertools import pairwise
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from autopilot.estimator.sensor_spec import SensorSpec
from autopilot.estimator.sensors import FUSED_SENSORS
from autopilot.ports import BaroSample, GnssSample, ImuSample, MagSample, RangeSample
from common.geodesy import GeoPoint, geodetic_from_ned, ned_from_geodetic
from common.params import ParameterTable

Rows = npt.NDArray[Any]


def row_dtype(struct: Any) -> np.dtype[Any]:
    """NumPy's type of the rows of a kernel struct."""
    dtype: np.dtype[Any] = np.dtype(struct.numpy_dtype())
    return dtype


IMU_DTYPE = row_dtype(ImuSample)
GNSS_DTYPE = row_dtype(GnssSample)
BARO_DTYPE = row_dtype(BaroSample)
MAG_DTYPE = row_dtype(MagSample)
RANGE_DTYPE = row_dtype(RangeSample)
FIX_DTYPE = np.dtype(
    [
        ("time_us", "<i8"),
        ("lat_deg", "<f8"),
        ("lon_deg", "<f8"),
        ("alt_m", "<f8"),  # above mean sea level
        ("vel_ned", "<f4", (3,)),
        ("pos_h_std", "<f4"),
        ("pos_v_std", "<f4"),
        ("vel_std", "<f4"),
        ("fix_type", "<i4"),
        ("satellites", "<i4"),
    ]
)

MIN_IMU_RATE_HZ = 40.0  # guess: below it an attitude cannot be integrated
MIN_DURATION_S = 1.0
STANDING_SPEED_M_S = 0.5  # guess: several deviations of a receiver's velocity at rest
UNKNOWN_STD = 1.0e3  # [m/s] accuracy of a velocity that the receiver calls invalid
STANDING_S = 10.0  # later fixes share the slow error of the first: averaging more of them gains little
IMU_PERIOD_S = 0.004  # the estimator's tick: faster samples are merged to about that
MAX_UNCOVERED = 0.002  # of the time, by integration times that are taken as they are; guess
HELD_GAP_S = 0.1  # up to here the last rate holds; the estimator integrates no longer interval
FILLED_GAP_S = 1.0  # up to here samples are interpolated; a longer gap starts the estimator anew
MAX_SPAN_US = 86_400_000_000  # times further than a day from the middle of a log, and
MAX_VALUE = 1.0e6  # numbers of such size come from a damaged file
# The estimator's rings hold 16 samples (4 of GNSS) of the last 0.2 s: faster ones would be lost before their turn.
MIN_INTERVAL_S = 0.015
MIN_GNSS_INTERVAL_S = 0.045


class SensorLogError(ValueError):
    """The log cannot be used; the message is one sentence that names it."""


@dataclass(slots=True)
class Recording:
    """The tables of one log as read; times in microseconds, of validity."""

    path: Path
    imu: Rows  # IMU_DTYPE; dt_s is the integration time of the sample, 0: unknown
    fixes: Rows  # FIX_DTYPE
    baro: Rows  # BARO_DTYPE
    mag: Rows  # MAG_DTYPE
    range: Rows  # RANGE_DTYPE
    others: dict[str, Rows] = field(default_factory=dict)  # further fused sensors, by name
    is_own: bool = False  # written by this project: its parameters mean what they mean here
    parameters: dict[str, float] = field(default_factory=dict)
    gnss_delay_s: float = 0.0  # subtracted from the receiver's times already
    tracks: list["Track"] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)  # what the reader of the results should know


@dataclass(frozen=True, slots=True)
class Track:
    """Somebody else's answer to the same flight: the log's own estimate, or the truth of a simulator."""

    name: str
    ref: GeoPoint | None  # origin of its pos_ned
    pos_time_us: Rows  # (rows,)
    pos_ned: Rows  # [m], (rows, 3)
    vel_ned: Rows  # [m/s], (rows, 3)
    q_time_us: Rows  # (rows,)
    q_ned_from_frd: Rows  # x, y, z, w, (rows, 4)


@dataclass(frozen=True, slots=True)
class SensorLog:
    """Samples ready for the estimator; times are positive and strictly increasing."""

    recording: Recording
    origin: GeoPoint | None  # of ned; None without any fix
    imu: Rows
    gnss: Rows
    baro: Rows
    mag: Rows
    range: Rows
    others: dict[str, Rows]  # further fused sensors, by name
    stretches: list[tuple[int, int]]  # first and last + 1 IMU sample of each part without a long gap

    def samples_of(self, sensor: SensorSpec) -> Rows:
        """The samples of a fused sensor."""
        rows: Rows = getattr(self, sensor.name, self.others.get(sensor.name, empty(sensor.dtype)))
        return rows

    @property
    def duration_s(self) -> float:
        return float(self.imu["time_us"][-1] - self.imu["time_us"][0]) * 1e-6


def empty(dtype: np.dtype[Any]) -> Rows:
    return np.zeros(0, dtype=dtype)


def prepare(recording: Recording, table: ParameterTable) -> SensorLog:
    """The samples of a recording, cleaned; what was changed or is missing is added to its notes.

    Args:
        recording: as read.
        table: the estimator's parameters: which fix is good enough to be the origin.

    Raises:
        SensorLogError: the IMU samples are too few or too slow.
    """
    notes = recording.notes
    imu = _prepare_imu(recording)
    on_globe = (np.abs(recording.fixes["lat_deg"]) <= 90.0) & (np.abs(recording.fixes["lon_deg"]) <= 180.0)
    fixes = _thinned(_sorted(recording.fixes[on_globe], "GNSS", notes), MIN_GNSS_INTERVAL_S)
    origin = _own_origin(recording) or _origin(fixes, table, notes)
    slow = {
        name: _thinned(_sorted(getattr(recording, name), label, notes), MIN_INTERVAL_S)
        for name, label in (("baro", "barometer"), ("mag", "magnetometer"), ("range", "range finder"))
    }
    for name, label in (("baro", "barometer"), ("mag", "magnetometer")):
        if not len(slow[name]):
            notes.append(f"no {label} samples")
    labels = {sensor.name: sensor.label for sensor in FUSED_SENSORS}
    others = {
        name: _thinned(_sorted(rows, labels[name], notes), MIN_INTERVAL_S) for name, rows in recording.others.items()
    }
    breaks = np.flatnonzero(np.diff(imu["time_us"]) > FILLED_GAP_S * 1e6) + 1
    bounds = [0, *breaks.tolist(), len(imu)]
    stretches = list(pairwise(bounds))
    if len(stretches) > 1:
        notes.append(f"{len(stretches) - 1} gap(s) above {FILLED_GAP_S:g} s: the estimator started anew after each")
    return SensorLog(recording, origin, imu, _projected(fixes, origin), **slow, others=others, stretches=stretches)


def _prepare_imu(recording: Recording) -> Rows:
    """IMU samples of at most about 250 Hz, their gaps filled as far as they may be."""
    imu = _sorted(recording.imu, "IMU", recording.notes)
    span_s = float(imu["time_us"][-1] - imu["time_us"][0]) * 1e-6 if len(imu) else 0.0
    if span_s < MIN_DURATION_S:
        raise SensorLogError(
            f"{recording.path}: {span_s:.2f} s of IMU samples, at least {MIN_DURATION_S:g} s are needed"
        )
    period_s = float(np.median(np.diff(imu["time_us"]))) * 1e-6
    if period_s > 1.0 / MIN_IMU_RATE_HZ:
        raise SensorLogError(
            f"{recording.path}: the IMU was recorded at {1.0 / period_s:.0f} Hz, "
            f"at least {MIN_IMU_RATE_HZ:g} Hz are needed"
        )
    imu["dt_s"] = _intervals(imu, period_s)
    group = round(IMU_PERIOD_S / period_s)
    if group > 1:
        imu = _merged(imu, group)
        period_s *= group
    return _filled(imu, period_s, recording.notes)


def _intervals(imu: Rows, period_s: float) -> Rows:
    """[s] what each sample stands for: its integration time or, after lost samples, the time since the last.

    Where integration times are unknown, or together are not the time that passed, each stands for the time since the
    last: no rotation is lost with samples that jitter.
    """
    since_s = np.diff(imu["time_us"], prepend=imu["time_us"][0] - round(period_s * 1e6)) * 1e-6
    dt_s = imu["dt_s"].astype(float)
    is_known = (dt_s > 0.0) & (dt_s < HELD_GAP_S)
    is_near = since_s <= HELD_GAP_S
    dt_s = np.where(is_known, dt_s, np.where(is_near, since_s, period_s))
    dt_s = np.where((since_s > 1.5 * dt_s) & is_near, since_s, dt_s)
    is_covered = abs(dt_s[is_near].sum() / since_s[is_near].sum() - 1.0) < MAX_UNCOVERED
    return dt_s if is_covered else np.where(is_near, since_s, dt_s)


def _merged(imu: Rows, group: int) -> Rows:
    """Every `group` samples as one: mean rate and force over their time, valid at the last."""
    starts = np.arange(0, len(imu) - group + 1, group)
    imu = imu[: len(starts) * group]
    merged = imu[starts + group - 1].copy()
    dt_s = imu["dt_s"].astype(float)
    merged["dt_s"] = np.add.reduceat(dt_s, starts)
    for name in ("gyro_frd", "accel_frd"):
        merged[name] = np.add.reduceat(imu[name] * dt_s[:, None], starts) / np.add.reduceat(dt_s, starts)[:, None]
    return merged


def _filled(imu: Rows, period_s: float, notes: list[str]) -> Rows:
    """The samples with others interpolated into their gaps."""
    since_s = np.diff(imu["time_us"]) * 1e-6
    gaps = np.flatnonzero(since_s - imu["dt_s"][1:] > HELD_GAP_S / 2)
    if not len(gaps):
        return imu
    notes.append(
        f"{len(gaps)} gap(s) in the IMU samples, {since_s[gaps].sum():.2f} s together, "
        f"the longest {since_s[gaps].max():.2f} s"
    )
    times = []
    for first in gaps[since_s[gaps] <= FILLED_GAP_S]:
        start, end = imu["time_us"][first], imu["time_us"][first + 1] - round(float(imu["dt_s"][first + 1]) * 1e6)
        times.append(np.linspace(start, end, max(2, ceil((end - start) * 1e-6 / period_s) + 1))[1:].astype(np.int64))
    if not times:
        return imu
    filler = np.zeros(sum(map(len, times)), dtype=IMU_DTYPE)
    filler["time_us"] = np.concatenate(times)
    filler["dt_s"] = (
        np.concatenate([np.full(len(part), part[1] - part[0] if len(part) > 1 else 0) for part in times]) * 1e-6
    )
    filler["dt_s"][filler["dt_s"] == 0.0] = period_s
    for name in ("gyro_frd", "accel_frd"):
        for axis in range(3):
            filler[name][:, axis] = np.interp(filler["time_us"], imu["time_us"], imu[name][:, axis])
    both = np.concatenate([imu, filler])
    return both[np.unique(both["time_us"], return_index=True)[1]]


def _sorted(rows: Rows, label: str, notes: list[str]) -> Rows:
    """Rows of believable numbers, by time, one per time; a time of 0 would mean `never measured`."""
    if not len(rows):
        return rows
    is_good = (rows["time_us"] > 0) & (np.abs(rows["time_us"] - np.median(rows["time_us"])) < MAX_SPAN_US)
    for name in rows.dtype.names or ():
        believable = np.abs(rows[name]) < MAX_VALUE if name != "time_us" else is_good
        is_good &= believable if believable.ndim == 1 else believable.all(axis=1)
    if not is_good.all():
        notes.append(f"{np.count_nonzero(~is_good)} {label} sample(s) without a usable time or value were left out")
    rows = rows[is_good]
    return rows[np.unique(rows["time_us"], return_index=True)[1]].copy()


def _thinned(rows: Rows, min_interval_s: float) -> Rows:
    """Every k-th row, so that they are not closer than the estimator's rings allow."""
    if len(rows) < 3:
        return rows
    interval_s = float(np.median(np.diff(rows["time_us"]))) * 1e-6
    return rows[:: max(1, ceil(min_interval_s / interval_s - 0.01))]


def _own_origin(recording: Recording) -> GeoPoint | None:
    """The origin that this project's estimator used in flight."""
    return recording.tracks[0].ref if recording.is_own and recording.tracks else None


# field of a fix, its name, unit, the parameter that bounds it, and +1: from below, -1: from above
_CRITERIA = (
    ("satellites", "satellites", "", "EKF2_REQ_NSATS", 1),
    ("pos_h_std", "horizontal accuracy", " m", "EKF2_REQ_EPH", -1),
    ("pos_v_std", "vertical accuracy", " m", "EKF2_REQ_EPV", -1),
)


def _origin(fixes: Rows, table: ParameterTable, notes: list[str]) -> GeoPoint | None:
    """The first place known: the mean of the good fixes from the first on, as long as the vehicle stands there.

    The estimator takes the place where it is aligned for the origin; one fix alone may lie a metre from there.
    """
    has_fix = fixes["fix_type"] >= table["EKF2_REQ_FIX"]
    if not has_fix.any():
        notes.append("no GNSS fix: position and velocity are dead reckoning, magnetic declination is taken as 0")
        return None
    is_good, refusals = has_fix.copy(), []
    for name, what, unit, parameter, sign in _CRITERIA:
        limit, values = table[parameter], fixes[name]
        passes = values >= limit if sign > 0 else values <= limit
        is_good &= passes
        if not passes[has_fix].any():
            best = values[has_fix].max() if sign > 0 else values[has_fix].min()
            relation = "at most" if sign > 0 else "at least"
            refusals.append(f"{what} {relation} {best:.3g}{unit}, {parameter} asks for {limit:g}{unit}")
    if not is_good.any():
        why = "; ".join(refusals) or "none meets all criteria at once"
        notes.append(f"no GNSS fix is accurate enough to be used ({why}): position and velocity are dead reckoning")
    elif not (has_vel := fixes["vel_std"][is_good] <= table["EKF2_REQ_SACC"]).any():
        if (fixes["vel_std"][is_good] >= UNKNOWN_STD).all():
            why = "the receiver calls it invalid"
        else:
            why = f"EKF2_REQ_SACC asks for {table['EKF2_REQ_SACC']:g} m/s"
        notes.append(f"no GNSS velocity is used: {why}; position and height are")
    elif not has_vel.all():
        notes.append(f"{np.count_nonzero(~has_vel)} GNSS fix(es) without a good velocity gave position and height only")
    chosen = fixes[is_good if is_good.any() else has_fix]
    first = GeoPoint(float(chosen["lat_deg"][0]), float(chosen["lon_deg"][0]), float(chosen["alt_m"][0]))
    is_away = np.linalg.norm(chosen["vel_ned"], axis=1) > STANDING_SPEED_M_S
    is_away |= chosen["vel_std"] > table["EKF2_REQ_SACC"]  # who knows whether it stands
    is_away |= chosen["time_us"] - chosen["time_us"][0] > STANDING_S * 1e6
    standing = chosen[: max(1, int(np.argmax(is_away)) if is_away.any() else len(chosen))]
    north, east, down = _projected(standing, first)["pos_ned"].astype(float).mean(axis=0).tolist()
    return GeoPoint(*geodetic_from_ned(north, east, down, first))


def _projected(fixes: Rows, origin: GeoPoint | None) -> Rows:
    """The fixes in the tangent plane of the origin."""
    if origin is None:
        return empty(GNSS_DTYPE)
    gnss = np.zeros(len(fixes), dtype=GNSS_DTYPE)
    for name in ("time_us", "fix_type", "satellites", "vel_ned", "pos_h_std", "pos_v_std", "vel_std"):
        gnss[name] = fixes[name]
    places = zip(fixes["lat_deg"].tolist(), fixes["lon_deg"].tolist(), fixes["alt_m"].tolist(), strict=True)
    for index, place in enumerate(places):
        gnss["pos_ned"][index] = ned_from_geodetic(*place, origin)
    return gnss
