"""What a flight was, in figures: the table at the top of its review."""

from datetime import UTC, datetime

import numpy as np

from mission.log.euler_angles import tilt_deg
from mission.review.logged_flight import LoggedFlight
from mission.review.panels.sensors import gnss_topic
from mission.review.timeline import Timeline
from mission.review.track import Track

# MAV_TYPE, of what flies PX4 most
TYPES = {
    1: "plane",
    2: "quadrotor",
    3: "coaxial helicopter",
    4: "helicopter",
    10: "rover",
    11: "boat",
    13: "hexarotor",
    14: "octorotor",
    15: "tricopter",
    19: "VTOL, two rotors",
    20: "VTOL, four rotors",
    21: "VTOL, tilting rotors",
    22: "VTOL",
}
RELEASES = {0: "dev", 64: "alpha", 128: "beta", 192: "rc", 255: ""}  # last byte of PX4's ver_sw_release
EPOCH_2000_US = 946_684_800_000_000  # receivers without time tell less


def summary(flight: LoggedFlight, timeline: Timeline, track: Track | None) -> list[tuple[str, str]]:
    """Rows of the table; what the log does not tell is left out."""
    rows = [("Vehicle", _vehicle(flight)), ("Firmware", _firmware(flight)), ("Date", _date(flight))]
    rows.append(("Log", _duration(flight.duration_s)))
    airborne_s = sum(span.length_s for span in timeline.airborne)
    if timeline.airborne:
        rows.append(("In the air", _duration(airborne_s)))
    if track is not None:
        rows += _motion(flight, track)
    rows.append(("Greatest tilt", _tilt(flight, timeline)))
    topic = flight.topic("battery_status")
    used = None if topic is None else topic.get("discharged_mah")
    if used is not None and np.nanmax(used, initial=0.0) > 0.0:
        rows.append(("Charge drawn", f"{np.nanmax(used):.0f} mAh"))
    return [(name, value) for name, value in rows if value]


def changed_parameters(flight: LoggedFlight) -> list[tuple[str, float, float]]:
    """Name, value and default of those that the log says were changed."""
    found = [
        (name, flight.parameters[name], default)
        for name, default in flight.defaults.items()
        if name in flight.parameters and not np.isclose(flight.parameters[name], default, rtol=1e-5, atol=1e-9)
    ]
    return sorted(found)


def distance_m(track: Track) -> float:
    return float(np.linalg.norm(np.diff(track.pos_ned, axis=0), axis=1).sum())


def _motion(flight: LoggedFlight, track: Track) -> list[tuple[str, str]]:
    home_down = track.home_ned[2] if track.home_ned is not None else track.pos_ned[0, 2]
    away = track.pos_ned[:, :2] - (track.home_ned[:2] if track.home_ned is not None else track.pos_ned[0, :2])
    origin = "home" if track.home_ned is not None else "the first point"
    rows = [
        ("Distance flown", _metres(distance_m(track))),
        ("Greatest height", f"{np.max(home_down - track.pos_ned[:, 2]):.1f} m above {origin}"),
        ("Farthest away", f"{_metres(float(np.max(np.linalg.norm(away, axis=1))))} from {origin}"),
    ]
    local = flight.topic("vehicle_local_position")
    velocity = None if local is None else local.columns("vx", "vy", "vz")
    if velocity is not None and np.isfinite(velocity).all(axis=1).any():
        level = np.linalg.norm(velocity[:, :2], axis=1)
        rows.append(("Greatest speed", f"{np.nanmax(level):.1f} m/s over ground"))
        climb, sink = max(0.0, -float(np.nanmin(velocity[:, 2]))), max(0.0, float(np.nanmax(velocity[:, 2])))
        rows.append(("Climb and descent", f"up to {climb:.1f} and {sink:.1f} m/s"))
    return rows


def _vehicle(flight: LoggedFlight) -> str:
    status = flight.topic("vehicle_status")
    kind = ""
    if status is not None and (types := status.get("system_type")) is not None:
        kind = TYPES.get(int(types[-1]), f"MAV_TYPE {int(types[-1])}")
    airframe = str(flight.info.get("airframe", ""))
    if not airframe and (number := flight.parameters.get("SYS_AUTOSTART")):
        airframe = f"airframe {number:.0f}"
    return ", ".join(part for part in (kind, airframe, str(flight.info.get("ver_hw", ""))) if part)


def _firmware(flight: LoggedFlight) -> str:
    name, version = str(flight.info.get("sys_name", "")), str(flight.info.get("ver_sw", ""))
    release = flight.info.get("ver_sw_release")
    if isinstance(release, int):
        major, minor, patch, kind = release.to_bytes(4, "big", signed=release < 0)
        word = RELEASES.get(kind, "")
        return f"{name} {major}.{minor}.{patch}{f' {word}' if word else ''} ({version[:8]})"
    return f"{name} {version}".strip()


def _date(flight: LoggedFlight) -> str:
    topic = gnss_topic(flight)
    times = None if topic is None else topic.get("time_utc_usec")
    if times is None or not (times > EPOCH_2000_US).any():
        return ""
    first = int(times[times > EPOCH_2000_US][0])
    try:
        return datetime.fromtimestamp(first * 1e-6, UTC).strftime("%Y-%m-%d %H:%M UTC")
    except (OverflowError, ValueError, OSError):
        return ""


def _tilt(flight: LoggedFlight, timeline: Timeline) -> str:
    topic = flight.topic("vehicle_attitude")
    wxyz = None if topic is None else topic.vector("q", 4)
    if topic is None or wxyz is None:
        return ""
    in_air = timeline.in_air(topic.time_s)
    rows = wxyz[in_air] if in_air.any() else wxyz
    rows = rows[np.isfinite(rows).all(axis=1)]
    if not len(rows):
        return ""
    return f"{tilt_deg(rows[:, [1, 2, 3, 0]]).max():.0f} deg"


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest:02d} s" if minutes else f"{seconds:.1f} s"


def _metres(metres: float) -> str:
    return f"{metres / 1000.0:.2f} km" if metres >= 1000.0 else f"{metres:.0f} m"
