"""How far a replayed estimate lies from another answer to the same flight: rms, median and largest."""

from dataclasses import dataclass
from math import nan

import numpy as np

from autopilot.ports import POSITION_VALID, VELOCITY_VALID, YAW_ALIGNED
from common.geodesy import GeoPoint, ned_from_geodetic
from mission.estimate.sensor_log import Rows, Track
from mission.log.euler_angles import euler_rad

MAX_STEP_US = 60_000  # between rows of ours that are interpolated: three of 50 Hz


@dataclass(frozen=True, slots=True)
class Deviation:
    """One figure of our estimate minus another answer, per quantity; NaN where there is nothing to compare."""

    pos_n_m: float
    pos_e_m: float
    pos_d_m: float
    pos_m: float  # of the three
    vel_n_m_s: float
    vel_e_m_s: float
    vel_d_m_s: float
    vel_m_s: float
    tilt_deg: float
    yaw_deg: float


@dataclass(frozen=True, slots=True)
class Difference:
    """Our estimate minus another answer, while both are valid."""

    rms: Deviation
    median: Deviation  # of absolute values
    largest: Deviation
    no_position: str  # why position and velocity are not compared; empty: they are
    no_attitude: str


def difference(estimate: Rows, track: Track, origin: GeoPoint | None, *, own_origins: bool = False) -> Difference:
    """The estimate, interpolated to the times of a track, minus the track.

    Args:
        estimate: Estimate rows, every 20 ms.
        track: the other answer.
        origin: of our ned.
        own_origins: positions count from where each began; otherwise only heights, whose references always differ.
    """
    flags = estimate["flags"]
    is_valid = (flags & (POSITION_VALID | VELOCITY_VALID)) == (POSITION_VALID | VELOCITY_VALID)
    rows, part, theirs = _matched(estimate["time_us"], is_valid, track.pos_time_us)
    no_position = _reason(track, len(track.pos_time_us), "position", is_valid, len(rows))
    pos_error = _between(estimate["pos_ned"], rows, part) - track_pos_ned(track, origin)[theirs]
    vel_error = _between(estimate["vel_ned"], rows, part) - track.vel_ned[theirs]
    if len(rows):
        offset_ned = np.median(pos_error, axis=0)
        if track.ref is not None and origin is not None and not own_origins:
            offset_ned[:2] = 0.0
        pos_error -= offset_ned
    is_aligned = (flags & YAW_ALIGNED) != 0
    rows, part, theirs = _matched(estimate["time_us"], is_aligned, track.q_time_us)
    no_attitude = _reason(track, len(track.q_time_us), "heading", is_aligned, len(rows))
    tilt, yaw = _attitude_error(_between_quaternions(estimate["q_ned_from_frd"], rows, part), track, theirs)
    columns = [*pos_error.T, _length(pos_error), *vel_error.T, _length(vel_error), tilt, yaw]
    return Difference(
        rms=Deviation(*(float(np.sqrt(np.mean(column**2))) if len(column) else nan for column in columns)),
        median=Deviation(*(float(np.median(np.abs(column))) if len(column) else nan for column in columns)),
        largest=Deviation(*(float(np.abs(column).max()) if len(column) else nan for column in columns)),
        no_position=no_position,
        no_attitude=no_attitude,
    )


def track_pos_ned(track: Track, origin: GeoPoint | None) -> Rows:
    """Positions [m] of a track from our origin; from its own where either is not known."""
    if track.ref is None or origin is None:
        return track.pos_ned
    # Tangent planes some 100 m apart are parallel to 1e-5: the shift of the origin is enough.
    shift_ned = ned_from_geodetic(track.ref.lat_deg, track.ref.lon_deg, track.ref.alt_m, origin)
    pos_ned: Rows = track.pos_ned + np.array(shift_ned)
    return pos_ned


def _reason(track: Track, track_count: int, what: str, is_valid: Rows, common_count: int) -> str:
    """Why there is nothing to compare, as half a sentence; empty if there is."""
    if common_count:
        return ""
    if not track_count:
        return f"the {track.name} was never valid"
    return f"no valid {what} of ours" if not is_valid.any() else "never valid at the same time"


def _matched(time_us: Rows, is_valid: Rows, other_time_us: Rows) -> tuple[Rows, Rows, Rows]:
    """Rows of ours before the times of others, the part of the way to the next row, and rows of theirs."""
    if len(time_us) < 2:
        none = np.zeros(0, dtype=np.intp)
        return none, np.zeros(0), none
    before = np.searchsorted(time_us, other_time_us, side="right") - 1
    index = np.clip(before, 0, len(time_us) - 2)
    step_us = np.diff(time_us)[index]
    part = (other_time_us - time_us[index]) / step_us
    is_between = (part >= 0.0) & (part <= 1.0) & (step_us <= MAX_STEP_US) & is_valid[index] & is_valid[index + 1]
    return index[is_between], part[is_between], np.flatnonzero(is_between)


def _between(columns: Rows, rows: Rows, part: Rows) -> Rows:
    first, second = columns[rows].astype(float), columns[rows + 1].astype(float)
    mixed: Rows = first + part[:, None] * (second - first)
    return mixed


def _between_quaternions(quaternions: Rows, rows: Rows, part: Rows) -> Rows:
    first, second = quaternions[rows].astype(float), quaternions[rows + 1].astype(float)
    second = np.where((first * second).sum(axis=1, keepdims=True) < 0.0, -second, second)
    mixed = first + part[:, None] * (second - first)
    unit: Rows = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
    return unit


def _attitude_error(ours: Rows, track: Track, rows: Rows) -> tuple[Rows, Rows]:
    """Tilt and heading difference [deg] of (x, y, z, w) rows."""
    theirs = track.q_ned_from_frd[rows]
    sine = np.linalg.norm(np.cross(_down_frd(ours), _down_frd(theirs)), axis=1)
    tilt = np.arcsin(np.clip(sine, 0.0, 1.0))
    yaw = (euler_rad(ours)[:, 2] - euler_rad(theirs)[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    return np.degrees(tilt), np.degrees(yaw)


def _down_frd(quaternions: Rows) -> Rows:
    """The ned down axis in the body."""
    x, y, z, w = quaternions.T
    return np.stack([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)], axis=1)


def _length(vectors: Rows) -> Rows:
    length: Rows = np.linalg.norm(vectors, axis=1)
    return length
