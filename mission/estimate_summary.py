"""A replayed estimate judged: how each source fared, and how far it lies from other answers to the same flight."""

from dataclasses import asdict, dataclass
from math import isfinite, nan
from typing import Any

import numpy as np

from autopilot.ports import HEIGHT_VALID, POSITION_VALID, VELOCITY_VALID, YAW_ALIGNED
from common.geodesy import GeoPoint, ned_from_geodetic
from mission.angles import euler_rad
from mission.estimate_run import SOURCES, Replay
from mission.sensor_log import Rows, SensorLog, Track

BAND_SIGMA = 1.959964  # 95 % of a normal distribution lie within


@dataclass(frozen=True, slots=True)
class SourceSummary:
    """One source of measurements."""

    judged: int  # samples whose innovation was computed
    fused: int
    rejected: int  # by the gate
    resets: int  # times the state was set to a sample, the first included
    in_band: float  # share of normalised innovations within 1.96 sigma, NaN where none was judged


@dataclass(frozen=True, slots=True)
class Difference:
    """RMS of our estimate minus another answer, while ours is valid; NaN where there is nothing to compare."""

    pos_n_m: float
    pos_e_m: float
    pos_d_m: float  # a constant offset removed: height references differ
    vel_n_m_s: float
    vel_e_m_s: float
    vel_d_m_s: float
    tilt_deg: float
    yaw_deg: float


@dataclass(frozen=True, slots=True)
class EstimateSummary:
    """The figures of one replay."""

    log: str
    duration_s: float
    samples: dict[str, int]  # per sensor, as given to the estimator
    origin: GeoPoint | None
    sources: dict[str, SourceSummary]
    valid: dict[str, float]  # share of the time in which a part of the estimate was valid
    final_gyro_bias_frd_rad_s: tuple[float, ...]
    final_accel_bias_frd_m_s2: tuple[float, ...]
    final_body_field_frd_gauss: tuple[float, ...]
    reset_count: int
    fault_count: int
    differences: dict[str, Difference]
    parameters: dict[str, float]
    notes: list[str]

    def as_json(self) -> dict[str, Any]:
        """JSON values; NaN as null."""
        plain: dict[str, Any] = _without_nan(asdict(self))
        return plain


def summarise_replay(log: SensorLog, replay: Replay, parameters: dict[str, float]) -> EstimateSummary:
    """Judges a replay that has at least one row of output."""
    estimate = replay.estimate
    last = replay.output[-1]
    flags = {"position": POSITION_VALID, "velocity": VELOCITY_VALID, "height": HEIGHT_VALID, "yaw": YAW_ALIGNED}
    return EstimateSummary(
        log=log.recording.path.name,
        duration_s=log.duration_s,
        samples={name: len(getattr(log, name)) for name in ("imu", "gnss", "baro", "mag", "range")},
        origin=log.origin,
        sources={name: _source(replay.events[name], components) for name, components in SOURCES.items()},
        valid={name: float(np.mean((estimate["flags"] & flag) != 0)) for name, flag in flags.items()},
        final_gyro_bias_frd_rad_s=tuple(last["estimate"]["gyro_bias_frd"].tolist()),
        final_accel_bias_frd_m_s2=tuple(last["estimate"]["accel_bias_frd"].tolist()),
        final_body_field_frd_gauss=tuple(last["body_field_frd"].tolist()),
        reset_count=sum(int(np.count_nonzero(events["is_reset"])) for events in replay.events.values()),
        fault_count=replay.fault_count,
        differences={track.name: difference(estimate, track, log.origin) for track in log.recording.tracks},
        parameters=parameters,
        notes=log.recording.notes,
    )


def _source(events: Rows, components: int) -> SourceSummary:
    normalised = events["innov"][:, :components] / np.sqrt(events["innov_var"][:, :components])
    fused, resets = int(np.count_nonzero(events["is_fused"])), int(np.count_nonzero(events["is_reset"]))
    return SourceSummary(
        judged=len(events),
        fused=fused,
        rejected=len(events) - fused - resets,
        resets=resets,
        in_band=float(np.mean(np.abs(normalised) <= BAND_SIGMA)) if len(events) else nan,
    )


def difference(estimate: Rows, track: Track, origin: GeoPoint | None) -> Difference:
    """RMS of the estimate minus a track; each row of the track meets our row at or before its time.

    Args:
        estimate: Estimate rows, every 20 ms.
        track: the other answer.
        origin: of our ned.
    """
    has_pos = (estimate["flags"] & (POSITION_VALID | VELOCITY_VALID)) == (POSITION_VALID | VELOCITY_VALID)
    ours, theirs = _matched(estimate["time_us"], has_pos, track.pos_time_us)
    if len(ours):
        pos_error = estimate["pos_ned"][ours].astype(float) - track_pos_ned(track, origin)[theirs]
        pos_error[:, 2] -= pos_error[:, 2].mean()
        if track.ref is None or origin is None:
            pos_error -= pos_error.mean(axis=0)
        vel_error = estimate["vel_ned"][ours].astype(float) - track.vel_ned[theirs]
        rms = np.sqrt(np.mean(np.square(np.hstack([pos_error, vel_error])), axis=0)).tolist()
    else:
        rms = [nan] * 6
    ours, theirs = _matched(estimate["time_us"], (estimate["flags"] & YAW_ALIGNED) != 0, track.q_time_us)
    tilt, yaw = _attitude_rms(estimate["q_ned_from_frd"][ours].astype(float), track.q_ned_from_frd[theirs])
    return Difference(rms[0], rms[1], rms[2], rms[3], rms[4], rms[5], tilt, yaw)


def track_pos_ned(track: Track, origin: GeoPoint | None) -> Rows:
    """Positions [m] of a track from our origin; from its own where either is not known."""
    if track.ref is None or origin is None:
        return track.pos_ned
    # Tangent planes some 100 m apart are parallel to 1e-5: the shift of the origin is enough.
    shift_ned = ned_from_geodetic(track.ref.lat_deg, track.ref.lon_deg, track.ref.alt_m, origin)
    pos_ned: Rows = track.pos_ned + np.array(shift_ned)
    return pos_ned


def _matched(time_us: Rows, is_valid: Rows, other_time_us: Rows) -> tuple[Rows, Rows]:
    """Indices of rows of ours and of theirs at most 20 ms apart, where ours is valid."""
    latest = np.searchsorted(time_us, other_time_us, side="right") - 1
    index = np.maximum(latest, 0)
    is_near = (latest >= 0) & is_valid[index] & (other_time_us - time_us[index] <= 20_000)
    return index[is_near], np.flatnonzero(is_near)


def _attitude_rms(ours: Rows, theirs: Rows) -> tuple[float, float]:
    """RMS tilt and heading difference [deg] of (x, y, z, w) rows."""
    if not len(ours):
        return nan, nan
    sine = np.linalg.norm(np.cross(_down_frd(ours), _down_frd(theirs)), axis=1)
    tilt = np.arcsin(np.clip(sine, 0.0, 1.0))
    yaw = (euler_rad(ours)[:, 2] - euler_rad(theirs)[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    return float(np.degrees(np.sqrt(np.mean(tilt**2)))), float(np.degrees(np.sqrt(np.mean(yaw**2))))


def _down_frd(quaternions: Rows) -> Rows:
    """The ned down axis in the body."""
    x, y, z, w = quaternions.T
    return np.stack([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)], axis=1)


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not isfinite(value) else value
