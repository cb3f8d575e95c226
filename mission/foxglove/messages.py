"""Foxglove's messages from our records: vectors, poses, fixes, transforms."""

from collections.abc import Iterable, Sequence
from math import isfinite

from foxglove.messages import (
    FrameTransform,
    LaserScan,
    LocationFix,
    LocationFixPositionCovarianceType,
    Log,
    LogLevel,
    Pose,
    PoseInFrame,
    PosesInFrame,
    Quaternion,
    Timestamp,
    Vector3,
)

from autopilot.interface.vehicle_state import Severity
from common.attitude import quat_of, yaw_of
from common.geodesy import GeoPoint, geodetic_from_ned
from mission.foxglove.frames import ESTIMATE, LEVEL, MAP, VEHICLE, enu_from_ned, q_enu_from_flu
from mission.foxglove.vehicle_state import GnssFix, Motion, VehicleState

FULL_TURN = 6.283185307179586
_LEVELS = {
    Severity.EMERGENCY: LogLevel.Fatal,
    Severity.ALERT: LogLevel.Fatal,
    Severity.CRITICAL: LogLevel.Fatal,
    Severity.ERROR: LogLevel.Error,
    Severity.WARNING: LogLevel.Warning,
    Severity.DEBUG: LogLevel.Debug,
}


def timestamp(time_us: int) -> Timestamp:
    """Simulated time as a time stamp."""
    seconds, rest_us = divmod(int(time_us), 1_000_000)
    return Timestamp(seconds, rest_us * 1000)


def vector(values: Sequence[float]) -> Vector3:
    x, y, z = values
    return Vector3(x=float(x), y=float(y), z=float(z))


def quaternion(values: Sequence[float]) -> Quaternion:
    x, y, z, w = values
    return Quaternion(x=float(x), y=float(y), z=float(z), w=float(w))


def pose(pos_ned: Sequence[float], q_ned_from_frd: Sequence[float]) -> Pose:
    """A body's pose in `map`."""
    return Pose(position=vector(enu_from_ned(pos_ned)), orientation=quaternion(q_enu_from_flu(q_ned_from_frd)))


def pose_in_map(time_us: int, motion: Motion) -> PoseInFrame:
    return PoseInFrame(timestamp=timestamp(time_us), frame_id=MAP, pose=pose(motion.pos_ned, motion.q_ned_from_frd))


def poses_in_map(time_us: int, poses: Iterable[Pose]) -> PosesInFrame:
    return PosesInFrame(timestamp=timestamp(time_us), frame_id=MAP, poses=list(poses))


def is_known(motion: Motion | None) -> bool:
    """Whether it is a pose that can be shown."""
    return motion is not None and all(map(isfinite, (*motion.pos_ned, *motion.q_ned_from_frd)))


def transforms(state: VehicleState) -> list[FrameTransform]:
    """Where the vehicle's frames are in `map`; where there is no truth `vehicle` is the estimate."""
    motion, est = state.motion, state.est
    found = []
    if motion is not None and is_known(motion):
        found.append(_transform(state.time_us, VEHICLE, motion.pos_ned, motion.q_ned_from_frd))
    if est is not None and is_known(est):
        found.append(_transform(state.time_us, ESTIMATE, est.pos_ned, est.q_ned_from_frd))
        level = quat_of(yaw_of(tuple(est.q_ned_from_frd)), 0.0)
        found.append(_transform(state.time_us, LEVEL, est.pos_ned, level))
    return found


def _transform(time_us: int, child: str, pos_ned: Sequence[float], q_ned_from_frd: Sequence[float]) -> FrameTransform:
    return FrameTransform(
        timestamp=timestamp(time_us),
        parent_frame_id=MAP,
        child_frame_id=child,
        translation=vector(enu_from_ned(pos_ned)),
        rotation=quaternion(q_enu_from_flu(q_ned_from_frd)),
    )


def location(time_us: int, motion: Motion, origin: GeoPoint) -> LocationFix:
    """Where a body is on the map of the world."""
    north, east, down = (float(part) for part in motion.pos_ned)
    lat_deg, lon_deg, alt_m = geodetic_from_ned(north, east, down, origin)
    return LocationFix(timestamp=timestamp(time_us), frame_id=MAP, latitude=lat_deg, longitude=lon_deg, altitude=alt_m)


def gnss_location(fix: GnssFix) -> LocationFix:
    """A fix of the receiver; its variances are those of east, north and up."""
    level, upright = float(fix.pos_h_std) ** 2, float(fix.pos_v_std) ** 2
    return LocationFix(
        timestamp=timestamp(fix.time_us),
        frame_id=MAP,
        latitude=fix.lat_deg,
        longitude=fix.lon_deg,
        altitude=fix.alt_m,
        position_covariance=[level, 0.0, 0.0, 0.0, level, 0.0, 0.0, 0.0, upright],
        position_covariance_type=LocationFixPositionCovarianceType.DiagonalKnown,
    )


def ring_scan(time_us: int, ranges_m: Sequence[float]) -> LaserScan:
    """A ring's distances, which are clockwise from the nose; Foxglove's angles grow to the left."""
    count = len(ranges_m)
    ranges = [float(ranges_m[-k % count]) for k in range(count)]
    return LaserScan(
        timestamp=timestamp(time_us),
        frame_id=LEVEL,
        pose=Pose(position=vector((0.0, 0.0, 0.0)), orientation=quaternion((0.0, 0.0, 0.0, 1.0))),
        start_angle=0.0,
        end_angle=FULL_TURN * (count - 1) / count,
        ranges=ranges,
    )


def log_message(time_us: int, severity: int, text: str) -> Log:
    """A text of the vehicle."""
    level = _LEVELS.get(Severity(severity), LogLevel.Info)
    return Log(timestamp=timestamp(time_us), level=level, message=text, name="vehicle")
