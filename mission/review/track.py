"""Where the vehicle was: the track in local metres, home, waypoints, and its attitude for the replay.

The map's origin is that of the vehicle's local frame; two flights share the first one's.
"""

import json
from dataclasses import dataclass

import numpy as np

from common.geodesy import GeoPoint, ned_from_geodetic
from mission.review.curves import Rows
from mission.review.logged_flight import LoggedFlight, Topic

PATH_KEY = "replay_path"  # of our logs' information
MOMENTS_MAX = 3000
MOMENT_S = 0.1  # no closer than this
WAYPOINT_APART_M = 0.5
REACH_M = 100_000.0  # a place farther from the track is none: a damaged row, or never set


@dataclass(frozen=True, slots=True)
class Track:
    """One flight in space."""

    time_s: Rows  # (n,)
    pos_ned: Rows  # [m] (n, 3)
    q_ned_from_frd: Rows  # (n, 4), x y z w
    setpoint_ned: Rows  # [m] (m, 3); empty without one
    home_ned: Rows | None  # [m]
    waypoints_ned: Rows  # [m] (k, 3)
    origin: GeoPoint | None
    source: str  # of what it is made


def track(flight: LoggedFlight, origin: GeoPoint | None = None) -> Track | None:
    """The track by the estimate, or by GNSS where no estimate was logged; None without both.

    Args:
        flight: the log.
        origin: of the map; None: the flight's own.
    """
    own = _origin(flight)
    local = flight.topic("vehicle_local_position")
    pos = None if local is None else local.columns("x", "y", "z")
    if local is not None and pos is not None:
        time_s, source = local.time_s, "vehicle_local_position"
    else:
        found = _gnss(flight, own or origin)
        if found is None:
            return None
        time_s, pos, own = found
        source = "GNSS positions"
    shift = np.zeros(3)
    if origin is not None and own is not None and origin != own:
        apart = np.array(ned_from_geodetic(own.lat_deg, own.lon_deg, own.alt_m, origin))
        shift = apart if np.linalg.norm(apart) < REACH_M else shift  # flown elsewhere: laid over by their origins
    is_good = np.isfinite(pos).all(axis=1)
    time_s, pos = time_s[is_good], pos[is_good]
    if len(time_s) < 2:
        return None
    times = _moments(time_s)
    at = np.stack([np.interp(times, time_s, pos[:, axis]) for axis in range(3)], axis=1)
    home, waypoints = _home(flight, own), _waypoints(flight, own)
    waypoints = waypoints[np.linalg.norm(waypoints - at[0], axis=1) < REACH_M]
    return Track(
        times,
        at + shift,
        _attitude(flight, times),
        _setpoints(flight) + shift,
        None if home is None else home + shift,
        waypoints + shift if len(waypoints) else waypoints,
        origin or own,
        source,
    )


def _moments(time_s: Rows) -> Rows:
    length_s = float(time_s[-1] - time_s[0])
    count = int(np.clip(length_s / MOMENT_S, 2, MOMENTS_MAX))
    return np.linspace(float(time_s[0]), float(time_s[-1]), count)


def _origin(flight: LoggedFlight) -> GeoPoint | None:
    local = flight.topic("vehicle_local_position")
    ref = None if local is None else local.columns("ref_lat", "ref_lon", "ref_alt")
    if ref is None:
        return None
    is_set = np.isfinite(ref).all(axis=1) & (np.abs(ref[:, :2]) > 0.0).any(axis=1)
    if not is_set.any():
        return None
    lat, lon, alt = np.median(ref[is_set], axis=0)
    return GeoPoint(float(lat), float(lon), float(alt))


def _gnss(flight: LoggedFlight, origin: GeoPoint | None) -> tuple[Rows, Rows, GeoPoint] | None:
    gnss = flight.first("vehicle_gps_position", "sensor_gps", "vehicle_global_position")
    points = None if gnss is None else geodetic_columns(gnss)
    if gnss is None or points is None or not len(points):
        return None
    is_fix = np.isfinite(points).all(axis=1) & (np.abs(points[:, :2]).sum(axis=1) > 0.0)
    if not is_fix.any():
        return None
    points = points[is_fix]
    at = origin or GeoPoint(*(float(value) for value in points[0]))
    return gnss.time_s[is_fix], np.array([_ned(point, at) for point in points]), at


def _ned(point: Rows, origin: GeoPoint) -> Rows:
    """Of latitude [deg], longitude [deg] and altitude [m]."""
    lat_deg, lon_deg, alt_m = (float(value) for value in point)
    return np.array(ned_from_geodetic(lat_deg, lon_deg, alt_m, origin))


def geodetic_columns(topic: Topic) -> Rows | None:
    """Latitude [deg], longitude [deg], altitude [m] of a topic; PX4's older ones hold 1e-7 degrees and millimetres."""
    points = topic.columns("latitude_deg", "longitude_deg", "altitude_msl_m")
    if points is None:
        points = topic.columns("lat", "lon", "alt")
        if points is not None and topic["lat"].dtype.kind in "iu":
            points = points * np.array([1e-7, 1e-7, 1e-3])
    return points


def _attitude(flight: LoggedFlight, times: Rows) -> Rows:
    topic = flight.topic("vehicle_attitude")
    wxyz = None if topic is None else topic.vector("q", 4)
    if topic is None or wxyz is None or not len(topic):
        return np.tile([0.0, 0.0, 0.0, 1.0], (len(times), 1))
    is_good = np.isfinite(wxyz).all(axis=1) & (np.abs(np.linalg.norm(wxyz, axis=1) - 1.0) < 0.1)
    if not is_good.any():
        return np.tile([0.0, 0.0, 0.0, 1.0], (len(times), 1))
    rows = np.clip(np.searchsorted(topic.time_s[is_good], times), 0, int(is_good.sum()) - 1)
    found: Rows = wxyz[is_good][rows][:, [1, 2, 3, 0]]
    return found


def _setpoints(flight: LoggedFlight) -> Rows:
    topic = flight.topic("vehicle_local_position_setpoint")
    points = None if topic is None else topic.columns("x", "y", "z")
    if topic is None or points is None:
        return np.zeros((0, 3))
    points = points[np.isfinite(points).all(axis=1)]
    stride = max(1, -(-len(points) // MOMENTS_MAX))
    return points[::stride]


def _home(flight: LoggedFlight, origin: GeoPoint | None) -> Rows | None:
    if flight.is_own:
        return np.zeros(3)  # our vehicles boot at the origin of the frame
    topic = flight.topic("home_position")
    points = None if topic is None else topic.columns("lat", "lon", "alt")
    if points is None or origin is None:
        return None
    points = points[np.isfinite(points).all(axis=1) & (np.abs(points[:, :2]).sum(axis=1) > 0.0)]
    if not len(points):
        return None
    at = np.median(points, axis=0)  # of a damaged log a single row may be anything
    return _ned(at, origin)


def _waypoints(flight: LoggedFlight, origin: GeoPoint | None) -> Rows:
    """Places that the navigator led to, in their order, each once while it stayed the same; of ours the plan's."""
    if PATH_KEY in flight.pieces:
        try:
            planned = np.array(json.loads(flight.pieces[PATH_KEY]), float).reshape(-1, 3)
        except ValueError:
            planned = np.zeros((0, 3))
        return planned[1:]  # the first is where it takes off
    topic = flight.topic("position_setpoint_triplet")
    points = None if topic is None else topic.columns("current.lat", "current.lon", "current.alt")
    if topic is None or points is None or origin is None:
        return np.zeros((0, 3))
    is_set = np.isfinite(points).all(axis=1) & (np.abs(points[:, :2]).sum(axis=1) > 0.0)
    if (valid := topic.get("current.valid")) is not None:
        is_set &= valid != 0
    found: list[Rows] = []
    for point in points[is_set]:
        ned = _ned(point, origin)
        if not found or np.linalg.norm(ned - found[-1]) > WAYPOINT_APART_M:
            found.append(ned)
    return np.array(found).reshape(-1, 3)
