"""What clients ask and report, in our frames and units: setpoints, targets, circles, calibrations."""

from dataclasses import dataclass
from enum import Enum
from math import nan


@dataclass(frozen=True, slots=True)
class OffboardSetpoint:
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
class TargetReport:
    """Where a target to follow says it is, when it said so."""

    pos_ned: tuple[float, float, float]  # [m]
    vel_ned: tuple[float, float, float] | None  # [m/s], None if not reported
    pos_std: float  # [m] per axis
    vel_std: float  # [m/s] per axis
    course_rad: float = nan  # where its nose points, NaN if not reported


@dataclass(frozen=True, slots=True)
class OrbitRequest:
    """A circle a client asks for; NaN is the default."""

    radius_m: float = nan  # positive is clockwise
    speed_m_s: float = nan  # negative turns the other way
    yaw: int = 5  # ORBIT_YAW_BEHAVIOUR
    turns_rad: float = 0.0  # 0: for ever
    lat_deg: float = nan
    lon_deg: float = nan
    alt_amsl_m: float = nan


class CalibrationKind(Enum):
    """What is calibrated; the value is the first word of its name in texts."""

    GYRO = "gyro"
    MAG = "mag"
    BARO = "baro"
    ACCEL = "accel"
    ACCEL_SIMPLE = "accel simple"  # the vehicle stays level
    LEVEL = "level"
