"""Setpoint against actual: position, velocity, attitude, rates."""

import numpy as np

from mission.log.euler_angles import euler_rad
from mission.review.curves import Panel, Rows, Section, curves
from mission.review.logged_flight import LoggedFlight, Topic

ACTUAL, SETPOINT, TRUE = "actual", "setpoint", "true"
AXES = (("x", "North"), ("y", "East"), ("z", "Down"))
Found = tuple[Rows, Rows] | None  # times, and columns of shape (rows, axes)


def position(flight: LoggedFlight) -> Section:
    found = {
        ACTUAL: _axes(flight.topic("vehicle_local_position"), "x y z"),
        SETPOINT: _setpoint(flight, "x y z", "position"),
        TRUE: _axes(flight.topic("vehicle_local_position_groundtruth"), "x y z"),
    }
    titles = [f"{name} of the origin" if name != "Down" else "Down from the origin" for _, name in AXES]
    missing = _missing(found, "vehicle_local_position", "vehicle_local_position_setpoint or trajectory_setpoint")
    return _section("position", "Position", "m", titles, found, missing, least_span=1.0)


def velocity(flight: LoggedFlight) -> Section:
    found = {
        ACTUAL: _axes(flight.topic("vehicle_local_position"), "vx vy vz"),
        SETPOINT: _setpoint(flight, "vx vy vz", "velocity"),
        TRUE: _axes(flight.topic("vehicle_local_position_groundtruth"), "vx vy vz"),
    }
    titles = [f"{name}wards" for _, name in AXES]
    missing = _missing(found, "vehicle_local_position", "vehicle_local_position_setpoint or trajectory_setpoint")
    return _section("velocity", "Velocity", "m/s", titles, found, missing, least_span=1.0)


def attitude(flight: LoggedFlight) -> Section:
    found = {
        ACTUAL: _euler_deg(flight.topic("vehicle_attitude"), "q"),
        SETPOINT: _attitude_setpoint(flight.topic("vehicle_attitude_setpoint")),
        TRUE: _euler_deg(flight.topic("vehicle_attitude_groundtruth"), "q"),
    }
    missing = _missing(found, "vehicle_attitude", "vehicle_attitude_setpoint")
    return _section("attitude", "Attitude", "deg", ("Roll", "Pitch", "Yaw"), found, missing, least_span=2.0)


def rates(flight: LoggedFlight) -> Section:
    actual = _degrees(_vector(flight.topic("vehicle_angular_velocity"), "xyz"))
    old = _axes(flight.topic("vehicle_attitude"), "rollspeed pitchspeed yawspeed")
    found = {
        ACTUAL: actual or _degrees(old),
        SETPOINT: _degrees(_axes(flight.topic("vehicle_rates_setpoint"), "roll pitch yaw")),
        TRUE: _degrees(_vector(flight.topic("vehicle_angular_velocity_groundtruth"), "xyz")),
    }
    missing = _missing(found, "vehicle_angular_velocity", "vehicle_rates_setpoint")
    titles = ("Roll rate", "Pitch rate", "Yaw rate")
    return _section("rates", "Rates", "deg/s", titles, found, missing, least_span=10.0)


def _section(
    key: str,
    title: str,
    unit: str,
    titles: list[str] | tuple[str, ...],
    found: dict[str, Found],
    missing: tuple[str, ...],
    least_span: float,
) -> Section:
    panels = []
    for axis, axis_title in enumerate(titles):
        lines = [
            curve
            for name, rows in found.items()
            if rows is not None
            for curve in curves(rows[0], rows[1][:, axis], [name], is_setpoint=name == SETPOINT)
        ]
        if lines:
            wraps = axis_title == "Yaw"
            panels.append(Panel(f"{key}{axis}", axis_title, unit, tuple(lines), least_span=least_span, wraps=wraps))
    return Section(key, title, tuple(panels), missing)


def _missing(found: dict[str, Found], actual: str, setpoint: str) -> tuple[str, ...]:
    names = {ACTUAL: actual, SETPOINT: setpoint}
    return tuple(f"no {what} (topic {topic})" for what, topic in names.items() if found[what] is None)


def _axes(topic: Topic | None, names: str) -> Found:
    columns = None if topic is None else topic.columns(*names.split())
    return None if topic is None or columns is None else (topic.time_s, columns)


def _vector(topic: Topic | None, name: str) -> Found:
    columns = None if topic is None else topic.vector(name, 3)
    return None if topic is None or columns is None else (topic.time_s, columns)


def _degrees(found: Found) -> Found:
    return None if found is None else (found[0], np.degrees(found[1]))


def _setpoint(flight: LoggedFlight, names: str, field: str) -> Found:
    """What the position controller was asked; the trajectory's where that was not logged."""
    return _axes(flight.topic("vehicle_local_position_setpoint"), names) or _vector(
        flight.topic("trajectory_setpoint"), field
    )


def _euler_deg(topic: Topic | None, name: str) -> Found:
    quaternions = None if topic is None else topic.vector(name, 4)
    if topic is None or quaternions is None:
        return None
    return topic.time_s, np.degrees(euler_rad(quaternions[:, [1, 2, 3, 0]]))


def _attitude_setpoint(topic: Topic | None) -> Found:
    if topic is None:
        return None
    quaternions = topic.vector("q_d", 4)
    if quaternions is not None and np.nanmax(np.abs(quaternions), initial=0.0) > 0.0:
        return _euler_deg(topic, "q_d")
    return _degrees(_axes(topic, "roll_body pitch_body yaw_body"))
