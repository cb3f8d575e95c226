"""What clients ask and report, as values in our frames and units: `Vehicle.request` takes each of them.

A `ModeRequest` is carried out by a flight mode whose row takes it, and the vehicle changes to that. A `Report` is
handed to every mode whose row takes it. Altitudes are AMSL [m]; NaN is the default.
"""

from dataclasses import dataclass, field
from enum import Enum
from math import nan
from typing import ClassVar

from autopilot.interface.vehicle_state import Mode


@dataclass(frozen=True, slots=True)
class ModeRequest:
    """What a mode is asked to do."""

    in_air: ClassVar[bool] = False  # may be asked in the air only, or on the way up
    stays: ClassVar[bool] = False  # the present mode carries it out, if it can
    mode: Mode = field(kw_only=True)  # carries it out otherwise; a vehicle without it takes one that can


@dataclass(frozen=True, slots=True)
class TakeOff(ModeRequest):
    """To an altitude over the position where the vehicle stands."""

    stays: ClassVar[bool] = True
    alt_amsl_m: float = nan
    yaw_rad: float = nan
    mode: Mode = field(default=Mode.TAKEOFF, kw_only=True)


@dataclass(frozen=True, slots=True)
class LandAt(ModeRequest):
    """At a position; NaN: here."""

    lat_deg: float = nan
    lon_deg: float = nan
    yaw_rad: float = nan
    mode: Mode = field(default=Mode.LAND, kw_only=True)


@dataclass(frozen=True, slots=True)
class GoTo(ModeRequest):
    """To a position, a height or a heading, and hold there; what is NaN stays as it is, all NaN: hold here."""

    in_air: ClassVar[bool] = True
    lat_deg: float = nan
    lon_deg: float = nan
    alt_amsl_m: float = nan
    yaw_rad: float = nan
    speed_m_s: float = nan
    mode: Mode = field(default=Mode.HOLD, kw_only=True)

    @property
    def is_pause(self) -> bool:
        return all(each != each for each in (self.lat_deg, self.lon_deg, self.alt_amsl_m, self.yaw_rad))


@dataclass(frozen=True, slots=True)
class OrbitRequest(ModeRequest):
    """A circle; NaN is the default."""

    in_air: ClassVar[bool] = True
    radius_m: float = nan  # positive is clockwise
    speed_m_s: float = nan  # negative turns the other way
    yaw: int = 5  # ORBIT_YAW_BEHAVIOUR
    turns_rad: float = 0.0  # 0: for ever
    lat_deg: float = nan
    lon_deg: float = nan
    alt_amsl_m: float = nan
    mode: Mode = field(default=Mode.ORBIT, kw_only=True)


@dataclass(frozen=True, slots=True)
class ChangeMode:
    """Another mode; the present one ends what it was sent to do."""

    mode: Mode


@dataclass(frozen=True, slots=True)
class StartMission:
    """The mission from one item to another."""

    first: int = -1  # -1: where it stands
    last: int = -1  # -1: to its end


@dataclass(frozen=True, slots=True)
class SetCurrentItem:
    """The item of the mission that is flown next, or now."""

    seq: int
    is_reset: bool = False  # every jump counts from the beginning again


@dataclass(frozen=True, slots=True)
class ChangeSpeed:
    """A speed from now on."""

    speed_m_s: float
    kind: int = 1  # as SPEED_TYPE: 2 climb, 3 descent, else over ground


@dataclass(frozen=True, slots=True)
class SetReverse:
    """Ways are driven backwards from now on, or forwards again, until the mode changes."""

    is_reversed: bool


@dataclass(frozen=True, slots=True)
class SetHome:
    """Another home; NaN: here."""

    lat_deg: float = nan
    lon_deg: float = nan
    alt_amsl_m: float = nan


class Report:
    """What a client tells a mode, whether it is being flown or not."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class OffboardSetpoint(Report):
    """An external setpoint in our frames; NaN frees an element. `kind` is a SETPOINT_* of autopilot.ports."""

    time_us: int
    kind: int
    pos_ned: tuple[float, float, float] = (nan, nan, nan)
    vel_ned: tuple[float, float, float] = (nan, nan, nan)
    accel_ned: tuple[float, float, float] = (nan, nan, nan)
    yaw: float = nan
    yaw_rate: float = nan
    q_ned_from_frd: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)  # x, y, z, w
    omega_frd: tuple[float, float, float] = (nan, nan, nan)
    thrust: float = nan


@dataclass(frozen=True, slots=True)
class TargetReport(Report):
    """Where a target to follow says it is, when it said so."""

    pos_ned: tuple[float, float, float]  # [m]
    vel_ned: tuple[float, float, float] | None  # [m/s], None if not reported
    pos_std: float  # [m] per axis
    vel_std: float  # [m/s] per axis
    course_rad: float = nan  # where its nose points, NaN if not reported


@dataclass(frozen=True, slots=True)
class LandingTargetReport(Report):
    """Where a target to land on has been seen."""

    pos_ned: tuple[float, float, float]  # [m]


Request = ModeRequest | Report | ChangeMode | StartMission | SetCurrentItem | ChangeSpeed | SetReverse | SetHome


class CalibrationKind(Enum):
    """What is calibrated; the value is the first word of its name in texts."""

    GYRO = "gyro"
    MAG = "mag"
    BARO = "baro"
    ACCEL = "accel"
    ACCEL_SIMPLE = "accel simple"  # the vehicle stays level
    LEVEL = "level"
