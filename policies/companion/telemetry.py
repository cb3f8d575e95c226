"""What a companion knows of its vehicle and of the owner, as they told it last: rows that its MAVLink link fills."""

from dataclasses import dataclass
from math import isfinite, nan

from autopilot.interface.vehicle_state import Mode
from common.attitude import Quat, Vector, rotated
from common.geodesy import GeoPoint

RANGE_OLD_US = 500_000  # a range measured longer ago tells nothing of the ground below
GROUND_OLD_US = 5_000_000  # nor where that was, after so long; guess
NEVER_US = -(1 << 62)


@dataclass(slots=True)
class Own:
    """The vehicle as it estimates itself. Times of arrival are on the companion's clock."""

    q_ned_from_frd: Quat = (0.0, 0.0, 0.0, 1.0)
    omega_frd: Vector = (0.0, 0.0, 0.0)  # [rad/s]
    attitude_us: int = NEVER_US
    boot_us: int = NEVER_US  # the vehicle's clock at its newest attitude
    pos_ned: Vector = (nan, nan, nan)  # [m]
    vel_ned: Vector = (nan, nan, nan)  # [m/s]
    position_us: int = NEVER_US
    late_s: float = 0.0  # by now, since the older of the newest attitude and the newest position came in
    range_m: float = nan  # along the body's down axis; NaN: no return, or none heard of for RANGE_OLD_US
    range_us: int = NEVER_US
    ground_down_m: float = nan  # in ned, where the range finder saw ground last,
    ground_us: int = NEVER_US  # and when
    heartbeat_us: int = NEVER_US
    is_ground_vehicle: bool = False
    is_armed: bool = False
    is_on_ground: bool = True  # or just taking off, or landing
    is_landing: bool = False  # and not on the ground yet
    is_failsafe: bool = False  # as its heartbeat says
    health: int | None = None  # MAV_SYS_STATUS_SENSOR of all that works; None: not known
    is_battery_low: bool = False  # one of them
    alarm_us: int = NEVER_US  # when it said last that something is an emergency
    mode: Mode | None = None
    mode_name: str = "unknown"
    origin: GeoPoint | None = None  # of the local frame

    @property
    def is_range_heard(self) -> bool:
        """Whether the range finder tells anything, if only that there is nothing in its reach."""
        return self.attitude_us - self.range_us < RANGE_OLD_US

    @property
    def height_m(self) -> float:
        """Above the ground [m], by the range finder; NaN: not known."""
        return self.range_m * rotated(self.q_ned_from_frd, (0.0, 0.0, 1.0))[2]

    @property
    def carried_height_m(self) -> float:
        """The same, for a while as it moves on from where the range finder saw ground last; NaN: not known."""
        if isfinite(self.height_m) or self.attitude_us - self.ground_us > GROUND_OLD_US:
            return self.height_m
        return self.ground_down_m - self.pos_ned[2]

    @property
    def is_under_way(self) -> bool:
        """Whether it can be flown or driven: what drives can as soon as it is armed."""
        return self.is_armed and (self.is_ground_vehicle or not self.is_on_ground)


@dataclass(slots=True)
class Owner:
    """The owner as the phone reports: where it was when the report arrived."""

    pos_ned: Vector = (nan, nan, nan)  # [m] in the vehicle's local frame
    vel_ned: Vector = (0.0, 0.0, 0.0)  # [m/s]
    has_velocity: bool = False  # it says so itself
    std_m: float = nan  # of a horizontal axis, as the phone says; NaN: it does not
    arrived_us: int = NEVER_US
    count: int = 0  # reports so far
