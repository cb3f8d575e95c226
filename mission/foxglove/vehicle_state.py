"""What is told of a vehicle at one instant, whoever knows it: a running flight, or a kept log.

Frames are ours (ned, frd); what is not known is None or NaN, and is left out of what Foxglove gets.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from typing import NamedTuple

from common.geodesy import GeoPoint

Floats = Sequence[float]
NOWHERE = (nan, nan, nan)


class Motion(NamedTuple):
    """Pose and velocities."""

    pos_ned: Floats  # [m]
    vel_ned: Floats  # [m/s]
    q_ned_from_frd: Floats  # x, y, z, w
    omega_frd: Floats  # [rad/s]


class Battery(NamedTuple):
    voltage_v: float
    current_a: float
    remaining: float  # [0..1] as the vehicle believes


class GnssFix(NamedTuple):
    """A solution of the receiver."""

    time_us: int
    lat_deg: float
    lon_deg: float
    alt_m: float
    pos_h_std: float  # [m]
    pos_v_std: float  # [m]


class Person(NamedTuple):
    """Whom the vehicle follows."""

    pos_ned: Floats  # [m] of the feet
    heading_rad: float
    stature_m: float


@dataclass(frozen=True, slots=True)
class VehicleState:
    """One instant."""

    time_us: int
    origin: GeoPoint  # of ned
    true: Motion | None = None
    est: Motion | None = None
    setpoint: Motion | None = None
    outputs: Floats = ()  # [0..1] or [-1..1] of motors and servos
    test_ratios: Mapping[str, float] = field(default_factory=dict)  # by what is fused; above 1 is rejected
    battery: Battery | None = None
    gnss: GnssFix | None = None  # the newest
    mode: str = ""
    is_armed: bool = False
    goal_ned: Floats = NOWHERE  # [m] where it goes to
    owner: Person | None = None
    ring_m: Floats = ()  # [m] of a ring of range finders, clockwise from the nose; inf: nothing there
    ring_time_us: int = 0

    @property
    def motion(self) -> Motion | None:
        """The truth, or what comes next to it."""
        return self.true or self.est
