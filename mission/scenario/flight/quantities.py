"""The quantities that conditions and checks speak of, from the state of a vehicle at one moment or at many.

In: rows of positions, velocities and attitudes, true and estimated. Out: an array, one value for each row. A condition
that is waited for in flight and a check after it use the same functions.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from mission.flight_base import FlightBase
from mission.log.euler_angles import euler_rad, tilt_deg
from mission.log.flight_recorder import History
from mission.log.flight_summary import rotation_error_ned
from mission.scenario.parts.conditions import Term
from sim.world.world import WorldMap

Rows = npt.NDArray[Any]


@dataclass(slots=True)
class Moments(History):
    """The state of a vehicle at some moments, and the world it is in."""

    world: WorldMap


def moments_of(history: History, world: WorldMap) -> Moments:
    """Those of a whole flight."""
    return Moments(**{each.name: getattr(history, each.name) for each in fields(history)}, world=world)


def moment_of(flight: FlightBase) -> Moments:
    """The present one."""
    truth, state = flight.rig.rows["truth"][:1], flight.controller.state
    estimate = state.estimate

    def row(values: Any) -> Rows:
        return np.array(values, float).reshape(1, -1)

    return Moments(
        time_us=np.array([flight.time_us]),
        pos_ned_true=truth["pos_ned"],
        vel_ned_true=truth["vel_ned"],
        q_true=truth["q_ned_from_frd"],
        pos_ned_est=row(estimate.pos_ned),
        vel_ned_est=row(estimate.vel_ned),
        q_est=row(estimate.q_ned_from_frd),
        is_armed=np.array([state.is_armed]),
        mode=np.array([int(state.mode)]),
        mission_seq=np.array([state.mission_current]),
        battery_remaining=np.array([state.battery_remaining]),
        airspeed=np.array([getattr(estimate, "airspeed", np.nan)]),
        world=flight.world,
    )


def _euler(q: Rows, axis: int) -> Rows:
    angle: Rows = np.degrees(euler_rad(q)[:, axis])
    return angle


def _position_error(m: Moments) -> Rows:
    error = m.pos_ned_est[:, :2].astype(float) - m.pos_ned_true[:, :2]
    distance: Rows = np.hypot(*error.T)
    return distance


def _attitude_error(m: Moments) -> Rows:
    error: Rows = rotation_error_ned(m.q_est.astype(float), m.q_true.astype(float))
    return error


def _above_ground(m: Moments) -> Rows:
    north, east, down = m.pos_ned_true.astype(float).T
    height: Rows = -down - m.world.height(north, east)
    return height


VALUES: dict[str, Callable[[Moments], Rows]] = {
    "time": lambda m: m.time_us * 1e-6,
    "north": lambda m: m.pos_ned_true[:, 0],
    "east": lambda m: m.pos_ned_true[:, 1],
    "altitude": lambda m: -m.pos_ned_true[:, 2],
    "above_ground": _above_ground,
    "distance": lambda m: np.hypot(m.pos_ned_true[:, 0], m.pos_ned_true[:, 1]),
    "speed": lambda m: np.hypot(m.vel_ned_true[:, 0], m.vel_ned_true[:, 1]),
    "climb": lambda m: -m.vel_ned_true[:, 2],
    "airspeed": lambda m: m.airspeed,
    "tilt": lambda m: tilt_deg(m.q_true),
    "roll": lambda m: _euler(m.q_true, 0),
    "pitch": lambda m: _euler(m.q_true, 1),
    "heading": lambda m: _euler(m.q_true, 2) % 360.0,
    "position_error": _position_error,
    "height_error": lambda m: np.abs(m.pos_ned_est[:, 2].astype(float) - m.pos_ned_true[:, 2]),
    "velocity_error": lambda m: np.linalg.norm(m.vel_ned_est.astype(float) - m.vel_ned_true, axis=1),
    "tilt_error": lambda m: np.degrees(np.hypot(*_attitude_error(m)[:, :2].T)),
    "heading_error": lambda m: np.degrees(np.abs(_attitude_error(m)[:, 2])),
    "clearance": lambda m: m.world.obstacle_distance(m.pos_ned_true.astype(float)),
    "battery": lambda m: m.battery_remaining,
    "mission_item": lambda m: m.mission_seq,
    "armed": lambda m: m.is_armed.astype(float),
}


def hold_now(flight: FlightBase, terms: tuple[Term, ...]) -> bool:
    """Whether a condition holds at the present moment; not before the vehicle's first estimate."""
    if flight.controller.state.estimate is None:
        return False
    now = moment_of(flight)
    return all(bool(term.holds(VALUES[term.quantity](now)[0])) for term in terms)
