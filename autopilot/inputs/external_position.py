"""Positions from outside, on their way to the estimator: motion capture and visual odometry.

In: what a client says (autopilot.mavlink.services.inputs.external_position_messages), in ned or in a frame whose
heading is its own. Out: the live kernel row `ExternalSample` (autopilot.ports), one sample per frame. What they are
used for is EKF2_EV_CTRL's; the ned origin stays the boot home.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import cos, isfinite, isnan, nan, sin
from typing import Any

import numpy as np

from autopilot.ports import (
    EXTERNAL_HOLDS_HEIGHT,
    EXTERNAL_HOLDS_POS,
    EXTERNAL_HOLDS_VEL,
    EXTERNAL_HOLDS_YAW,
    YAW_ALIGNED,
)
from common.attitude import wrapped
from common.params import Parameter, ParameterTable

Vector = tuple[float, float, float]

_PX4 = "PX4 1.15 default"
_SYNCHRONOUS_US = (
    500_000  # a time stamp no older than that, and not of the future, is one on the vehicle's clock; guess
)
_WAITING_MAX = 4
_LAYOUT = struct.Struct("<q2i11f")
_FIELDS = (
    "time_us", "holds", "reset_count", "pos_ned", "vel_ned", "yaw", "pos_h_std", "pos_v_std", "vel_std", "yaw_std",
)  # fmt: skip

EXTERNAL_PARAMETERS: list[Parameter] = [
    Parameter("EKF2_EV_DELAY", 0.0, 0.0, 300.0, "ms", "age of positions from outside when they are stamped or come",
              _PX4),
    Parameter("EKF2_EV_NOISE_MD", 0, 0, 1, "", "noise of positions from outside: 0 as told, and at least that of the "
              "parameters, 1 of the parameters", _PX4),
    Parameter("EKF2_EV_QMIN", 0, 0, 100, "%", "odometry of a lower quality is not used", _PX4),
    Parameter("EKF2_EVP_NOISE", 0.1, 0.01, 10.0, "m", "position noise per axis", _PX4),
    Parameter("EKF2_EVV_NOISE", 0.1, 0.01, 10.0, "m/s", "velocity noise per axis", _PX4),
    Parameter("EKF2_EVA_NOISE", 0.1, 0.05, 1.0, "rad", "heading noise", _PX4),
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class ExternalReport:
    """One answer of a client. NaN: not told; a standard deviation that is infinite: told, and worth nothing."""

    kind: str  # whose reset counter it is
    time_us: int  # as stamped, on any clock
    pos: Vector = (nan, nan, nan)  # [m]
    vel: Vector = (nan, nan, nan)  # [m/s]
    yaw: float = nan  # [rad]
    pos_h_std: float = nan  # [m]
    pos_v_std: float = nan  # [m]
    yaw_std: float = nan  # [rad]
    vel_std: float = nan  # [m/s]
    reset_counter: int = 0  # modulo anything
    is_north_known: bool = True  # False: level and down, but its x axis points anywhere


@dataclass(frozen=True, slots=True)
class _Sample:
    """The row, as it waits to be written."""

    time_us: int
    holds: int
    reset_count: int
    pos_ned: Vector
    vel_ned: Vector
    yaw: float
    pos_h_std: float
    pos_v_std: float
    vel_std: float
    yaw_std: float


class ExternalPositions:
    """The estimator's input for what clients measure.

    Args:
        row: live structured view of length 1 of the kernel's `ExternalSample` rows; None: there is none.
        params: EKF2_EV*.
        now_us: the time of this frame.
        estimate: the latest `Estimate`, and its heading [rad].
    """

    __slots__ = ("_buffer", "_counters", "_estimate", "_last_us", "_now_us", "_params", "_reset_count", "_turn_rad",
                 "waiting")  # fmt: skip

    def __init__(
        self,
        row: np.ndarray[Any, Any] | None,
        params: ParameterTable,
        now_us: Callable[[], int],
        estimate: Callable[[], tuple[Any, float]],
    ) -> None:
        if row is not None and (row.shape != (1,) or row.dtype.names != _FIELDS or row.dtype.itemsize < _LAYOUT.size):
            raise ValueError("the row must be a view of one row of autopilot.ports.ExternalSample")
        self._buffer: Any = None if row is None else row.view(np.uint8).reshape(-1)
        self._params = params
        self._now_us = now_us
        self._estimate = estimate
        self._counters: dict[str, int] = {}  # by kind of message
        self._reset_count = 0
        self._turn_rad = nan  # from a frame of unknown heading to ned
        self._last_us = 0
        self.waiting: list[_Sample] = []

    def report(self, report: ExternalReport) -> str:
        """Takes what a client measured; returns why it cannot be used, empty if it can."""
        used = int(self._params["EKF2_EV_CTRL"])
        if self._buffer is None:
            return "there is nothing here that uses it"
        if not used:
            return "not used while EKF2_EV_CTRL is 0"
        self._note_counter(report)
        if not report.is_north_known:
            reason = self._find_north(report, used)
            if reason:
                return reason
            report = _turned(report, self._turn_rad)
        sample = self._sample(report)
        if sample.holds:
            self._queue(sample)
        return ""

    def write(self) -> None:
        """Copies the oldest sample that waits to the kernel row."""
        sample = self.waiting.pop(0)
        _LAYOUT.pack_into(
            self._buffer, 0, sample.time_us, sample.holds, sample.reset_count, *sample.pos_ned, *sample.vel_ned,
            sample.yaw, sample.pos_h_std, sample.pos_v_std, sample.vel_std, sample.yaw_std,
        )  # fmt: skip

    def _note_counter(self, report: ExternalReport) -> None:
        """A client that has set its answer anew says so by another count."""
        if self._counters.setdefault(report.kind, report.reset_counter) != report.reset_counter:
            self._counters[report.kind] = report.reset_counter
            self._reset_count += 1
            self._turn_rad = nan

    def _find_north(self, report: ExternalReport, used: int) -> str:
        """Learns the heading of the client's frame, once; if its heading is used, its x axis is north."""
        if used & EXTERNAL_HOLDS_YAW:
            self._turn_rad = 0.0
        elif isnan(self._turn_rad):
            estimate, yaw_rad = self._estimate()
            if not estimate.flags & YAW_ALIGNED:
                return "its frame has no north, and the heading is not known yet"
            if isnan(report.yaw):
                return "its frame has no north, and it does not tell its heading"
            self._turn_rad = yaw_rad - report.yaw
        return ""

    def _sample(self, report: ExternalReport) -> _Sample:
        north, east, down = report.pos
        holds = 0
        pos_h_std = self._std("EKF2_EVP_NOISE", report.pos_h_std)
        pos_v_std = self._std("EKF2_EVP_NOISE", report.pos_v_std)
        vel_std = self._std("EKF2_EVV_NOISE", report.vel_std)
        yaw_std = self._std("EKF2_EVA_NOISE", report.yaw_std)
        if isfinite(north + east) and isfinite(pos_h_std):
            holds |= EXTERNAL_HOLDS_POS
        if isfinite(down) and isfinite(pos_v_std):
            holds |= EXTERNAL_HOLDS_HEIGHT
        if isfinite(sum(report.vel)) and isfinite(vel_std):
            holds |= EXTERNAL_HOLDS_VEL
        if isfinite(report.yaw) and isfinite(yaw_std):
            holds |= EXTERNAL_HOLDS_YAW
        now_us = self._now_us()
        stamp_us = report.time_us if now_us - _SYNCHRONOUS_US <= report.time_us <= now_us else now_us
        time_us = max(stamp_us - round(self._params["EKF2_EV_DELAY"] * 1000.0), 1)
        return _Sample(
            time_us,
            holds,
            self._reset_count,
            (north, east, down) if holds & EXTERNAL_HOLDS_POS else (0.0, 0.0, down),
            report.vel if holds & EXTERNAL_HOLDS_VEL else (0.0, 0.0, 0.0),
            report.yaw if holds & EXTERNAL_HOLDS_YAW else 0.0,
            pos_h_std,
            pos_v_std,
            vel_std,
            yaw_std,
        )

    def _std(self, name: str, reported: float) -> float:
        """The standard deviation that is used; the parameter's where none is told."""
        least = float(self._params[name])
        if isnan(reported) or int(self._params["EKF2_EV_NOISE_MD"]):
            return least
        return max(reported, least)

    def _queue(self, sample: _Sample) -> None:
        """The newest of its kind takes the place of one that still waits; no two have the same time."""
        self.waiting = [each for each in self.waiting if each.holds != sample.holds][1 - _WAITING_MAX :]
        if sample.time_us <= self._last_us:
            sample = replace(sample, time_us=self._last_us + 1)
        self._last_us = sample.time_us
        self.waiting.append(sample)


def _turned(report: ExternalReport, angle_rad: float) -> ExternalReport:
    """The report in a frame turned back about down by an angle."""
    c, s = cos(angle_rad), sin(angle_rad)
    (x, y, z), (vx, vy, vz) = report.pos, report.vel
    yaw = wrapped(report.yaw + angle_rad)
    pos, vel = (c * x - s * y, s * x + c * y, z), (c * vx - s * vy, s * vx + c * vy, vz)
    return replace(report, pos=pos, vel=vel, yaw=yaw)
