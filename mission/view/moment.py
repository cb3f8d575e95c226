"""What is shown of a flight at one instant, read from a running flight.

In: the live rows of the simulator and the flight controller's state. Out: a `Moment`, which the live page shows at
once and a `Track` keeps for the replay. It looks at the truth: it is for people, nothing of it goes back into a flight.
"""

from dataclasses import dataclass, fields
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from autopilot.vehicle import Mode
from mission.flight import Flight
from sim.world.people import CHEST_M

Row = NDArray[np.float32]
ROTORS = 8  # as many as a vehicle can have
ACTIONS = 4  # what a policy chooses: velocity ahead, right and down, and yaw rate, each in [-1, 1]


@dataclass(frozen=True, slots=True)
class Moment:
    """One instant; unknown numbers are NaN."""

    time_s: float
    pos_ned: Row  # [m] (3,)
    vel_ned: Row  # [m/s] (3,)
    q_ned_from_frd: Row  # x, y, z, w
    rotor_speed: Row  # [rad/s] (ROTORS,)
    height_m: float  # above the ground
    battery: float  # [0..1] as the vehicle believes
    mode: int
    is_armed: bool
    goal_ned: Row  # [m] (3,) where the vehicle flies to
    owner_ned: Row  # [m] (3,) the feet of the person it follows
    owner_heading_rad: float
    action: Row  # (ACTIONS,)

    @property
    def mode_name(self) -> str:
        return Mode(self.mode).name.replace("_", " ").title()

    @property
    def speed_m_s(self) -> float:
        return float(np.linalg.norm(self.vel_ned))

    @property
    def distance_m(self) -> float:
        """From the vehicle to its owner's chest."""
        chest_ned = self.owner_ned - np.array([0.0, 0.0, float(CHEST_M)], np.float32)
        return float(np.linalg.norm(self.pos_ned - chest_ned))


NAMES = tuple(field.name for field in fields(Moment))
_NOWHERE = np.full(3, nan, np.float32)
_NO_ACTION = np.full(ACTIONS, nan, np.float32)


def moment_of(flight: Flight, action: Row | None = None) -> Moment:
    """The present instant of a flight, and what a policy on board chose last."""
    owner = flight.owner
    person: Any = None if owner is None else owner.people.numpy()[0]
    body: Any = flight.rig.arrays.body.numpy()[0]
    state = flight.controller.state
    return Moment(
        time_s=flight.time_us * 1e-6,
        pos_ned=body["pos_ned"].copy(),
        vel_ned=body["vel_ned"].copy(),
        q_ned_from_frd=body["q_ned_from_frd"].copy(),
        rotor_speed=body["rotor_speed"].copy(),
        height_m=float(body["height_agl_m"]),
        battery=state.battery_remaining,
        mode=int(state.mode),
        is_armed=state.is_armed,
        goal_ned=np.array(state.goal_ned, np.float32),
        owner_ned=_NOWHERE if person is None else person["pos_ned"].copy(),
        owner_heading_rad=nan if person is None else float(person["heading_rad"]),
        action=_NO_ACTION if action is None else np.array(action, np.float32),
    )
