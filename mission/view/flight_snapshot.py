"""What is shown of a flight at one instant: a row, and a `Moment` to read it.

In: the live rows of the simulator and the flight controller's state. Out: moments, as the live page shows them; those
of replays and films come from the log. It is the truth: for people, nothing of it goes back into a flight.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from autopilot.vehicles.default_class import DEFAULT_CLASS
from autopilot.vehicles.vehicle_class import VehicleClass
from common.airframe import Airframe
from common.kernels import TICK_US
from mission.flight_base import FlightBase
from mission.log.replay_topic import ACTIONS, MOTORS, OWNER
from sim.bodies.vehicles import class_of
from sim.world.people import CHEST_M

Row = NDArray[np.float32]


def _titles(vehicle: VehicleClass) -> dict[int, str]:
    return {int(mode): mode.name.replace("_", " ").title() for mode in sorted(vehicle.modes)}


DEFAULT_TITLES = _titles(DEFAULT_CLASS)
MOMENT = np.dtype(
    [
        ("time_s", "f8"),
        ("pos_ned", "f4", 3),  # [m]
        ("vel_ned", "f4", 3),  # [m/s]
        ("q_ned_from_frd", "f4", 4),  # x, y, z, w
        ("motor_speed", "f4", MOTORS),  # [rad/s]
        ("steering_rad", "f4"),  # of steered wheels, to the right
        ("height_m", "f4"),  # above the ground
        ("is_on_ground", "?"),
        ("battery", "f4"),  # [0..1] as the vehicle believes
        ("mode", "i4"),
        ("is_armed", "?"),
        ("goal_ned", "f4", 3),  # [m] where the vehicle flies to; NaN: nowhere
        ("action", "f4", ACTIONS),  # of the policy on board; NaN: none
        ("owner", OWNER),  # a stature of 0: nobody
    ]
)
"""One row of a `Moment`, or of a recording."""


@dataclass(frozen=True, slots=True)
class Moment:
    """One instant, read from a row of `MOMENT`."""

    row: Any
    modes: Mapping[int, str] = field(default_factory=lambda: DEFAULT_TITLES)
    """Titles of the vehicle's."""

    @property
    def time_s(self) -> float:
        return float(self.row["time_s"])

    @property
    def tick(self) -> int:
        """Of the simulator, by which boxes move."""
        return round(self.time_s * 1e6 / TICK_US)

    @property
    def pos_ned(self) -> Row:
        """Of the vehicle [m], shape (3,)."""
        place: Row = self.row["pos_ned"]
        return place

    @property
    def q_ned_from_frd(self) -> tuple[float, float, float, float]:
        x, y, z, w = (float(value) for value in self.row["q_ned_from_frd"])
        return x, y, z, w

    @property
    def goal_ned(self) -> Row:
        """Where it flies to [m], shape (3,); NaN: nowhere."""
        place: Row = self.row["goal_ned"]
        return place

    @property
    def mode_name(self) -> str:
        number = int(self.row["mode"])
        return self.modes.get(number, f"Mode {number}")

    @property
    def speed_m_s(self) -> float:
        return float(np.linalg.norm(self.row["vel_ned"]))

    @property
    def has_owner(self) -> bool:
        return bool(self.row["owner"]["stature_m"] > 0.0)

    @property
    def owner_ned(self) -> Row:
        """The feet of the person it follows [m], shape (3,)."""
        place: Row = self.row["owner"]["pos_ned"]
        return place

    @property
    def distance_m(self) -> float:
        """From the vehicle to its owner's chest; NaN without one."""
        return float(distances_m(self.row)) if self.has_owner else nan


def mode_titles(airframe: Airframe) -> dict[int, str]:
    """What the modes of a vehicle are called, by number."""
    return _titles(class_of(airframe).vehicle)


def distances_m(rows: Any) -> Any:
    """From the vehicle to its owner's chest [m], for one row or many."""
    off = rows["owner"]["pos_ned"] - rows["pos_ned"] - np.array([0.0, 0.0, float(CHEST_M)], np.float32)
    return np.linalg.norm(off, axis=-1)


def moment_of(flight: FlightBase, action: Row | None = None) -> Moment:
    """The present instant of a flight, and what a policy on board chose last."""
    truth: Any = flight.rig.rows["truth"][0]
    state = flight.controller.state
    row = np.zeros((), MOMENT)
    for name in ("pos_ned", "vel_ned", "q_ned_from_frd", "is_on_ground"):
        row[name] = truth[name]
    row["motor_speed"] = truth["motor_speed"]
    row["steering_rad"] = truth["steering_rad"]
    row["time_s"] = flight.time_us * 1e-6
    row["height_m"] = truth["height_agl_m"]
    row["battery"] = state.battery_remaining
    row["mode"], row["is_armed"] = state.mode, state.is_armed
    row["goal_ned"] = state.goal_ned
    row["action"] = nan if action is None else action
    if flight.owner is not None:
        row["owner"] = flight.owner.people.numpy()[0]
    return Moment(row, mode_titles(flight.airframe))
