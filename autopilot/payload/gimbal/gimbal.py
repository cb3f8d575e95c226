"""The gimbal: keeps the camera level and pointed, whatever the vehicle does.

In: where to point (angles, rates, a position on earth), the vehicle's attitude by estimate. Out: the camera's attitude.
Its motors have a largest rate and a range. It is worked out when somebody asks for it, not in every frame: it has moved
then by what its motors could do since. Left out: motor dynamics, the error of its own gyro.
"""

from dataclasses import dataclass
from math import atan2, hypot, isfinite, nan, radians

from autopilot.interface.vehicle_state import VehicleState
from common.attitude import Quat, inverse, product, quat_of, wrapped

# A common small mapping gimbal; guess.
PITCH_MIN, PITCH_MAX = radians(-90.0), radians(30.0)
YAW_MIN, YAW_MAX = radians(-160.0), radians(160.0)  # from the vehicle's nose
RATE_MAX = radians(90.0)  # [rad/s]
_RDF_IN_FRD: Quat = (0.5, 0.5, 0.5, 0.5)  # a camera that looks along the nose


@dataclass(slots=True)
class Aim:
    """Where it is to point."""

    pitch: float = 0.0  # [rad] from the horizon, up is positive
    yaw: float = 0.0  # [rad] from the nose, or from north if locked
    pitch_rate: float = nan  # [rad/s] NaN: go to the angle
    yaw_rate: float = nan
    is_yaw_locked: bool = False  # yaw holds its direction when the vehicle turns
    roi_ned: tuple[float, float, float] | None = None  # [m]


class Gimbal:
    """The gimbal of one vehicle."""

    def __init__(self, state: VehicleState) -> None:
        self._state = state
        self._time_us = 0
        self._vehicle_yaw = 0.0
        self.aim = Aim()
        self.pitch = 0.0  # [rad] of the camera from the horizon
        self.yaw = 0.0  # [rad] of the camera from the vehicle's heading
        self.omega = (0.0, 0.0)  # [rad/s] pitch and yaw rate of the last move

    def update(self) -> None:
        """Moves by what the motors could do since the last time."""
        state = self._state
        dt_s = (state.time_us - self._time_us) * 1e-6
        if dt_s <= 0.0:
            return
        self._time_us = state.time_us
        turned, self._vehicle_yaw = wrapped(state.yaw_rad - self._vehicle_yaw), state.yaw_rad
        aim = self.aim
        if aim.is_yaw_locked or aim.roi_ned is not None:
            self.yaw = wrapped(self.yaw - turned)  # stabilised: the camera has not turned with the vehicle
        pitch_goal, yaw_goal = self._goal()
        pitch_before, yaw_before = self.pitch, self.yaw
        if isfinite(aim.pitch_rate) and aim.roi_ned is None:
            pitch_goal = self.pitch + _bounded(aim.pitch_rate, RATE_MAX) * dt_s
            aim.pitch = pitch_goal = min(max(pitch_goal, PITCH_MIN), PITCH_MAX)
        if isfinite(aim.yaw_rate) and aim.roi_ned is None:
            yaw_goal = min(max(self.yaw + _bounded(aim.yaw_rate, RATE_MAX) * dt_s, YAW_MIN), YAW_MAX)
            aim.yaw = wrapped(yaw_goal + state.yaw_rad) if aim.is_yaw_locked else yaw_goal
        reach = RATE_MAX * dt_s
        self.pitch += _bounded(pitch_goal - self.pitch, reach)
        self.yaw = min(max(self.yaw + _bounded(yaw_goal - self.yaw, reach), YAW_MIN), YAW_MAX)
        self.omega = (self.pitch - pitch_before) / dt_s, (self.yaw - yaw_before) / dt_s

    def _goal(self) -> tuple[float, float]:
        """Pitch and yaw from the nose [rad] it is to take, within its range."""
        aim, state = self.aim, self._state
        pitch, yaw = aim.pitch, aim.yaw
        if aim.roi_ned is not None:
            north, east, down = (a - b for a, b in zip(aim.roi_ned, state.estimate.pos_ned, strict=True))
            level = hypot(north, east)
            pitch = atan2(-down, level)
            yaw = wrapped(atan2(east, north) - state.yaw_rad) if level > 0.1 else self.yaw
        elif aim.is_yaw_locked:
            yaw = wrapped(aim.yaw - state.yaw_rad)
        return min(max(pitch, PITCH_MIN), PITCH_MAX), min(max(yaw, YAW_MIN), YAW_MAX)

    # What it is told

    def point(
        self, pitch: float, yaw: float, pitch_rate: float = nan, yaw_rate: float = nan, *, is_yaw_locked: bool
    ) -> None:
        """Goes to angles, or turns at rates; NaN leaves an axis where it is. Angles and rates in rad and rad/s."""
        self.update()
        before = self.aim
        held_yaw = wrapped(self.yaw + self._state.yaw_rad) if is_yaw_locked else self.yaw
        is_same_frame = before.is_yaw_locked == is_yaw_locked and before.roi_ned is None
        self.aim = Aim(
            pitch=pitch if isfinite(pitch) else (before.pitch if before.roi_ned is None else self.pitch),
            yaw=yaw if isfinite(yaw) else (before.yaw if is_same_frame else held_yaw),
            pitch_rate=nan if isfinite(pitch) else pitch_rate,
            yaw_rate=nan if isfinite(yaw) else yaw_rate,
            is_yaw_locked=is_yaw_locked,
        )

    def neutral(self) -> None:
        """Level, along the nose."""
        self.point(0.0, 0.0, is_yaw_locked=False)

    def look_at(self, pos_ned: tuple[float, float, float]) -> None:
        """Follows a position on earth [m]."""
        self.update()
        self.aim = Aim(pitch=self.pitch, yaw=self.yaw, roi_ned=pos_ned)

    def look_away(self) -> None:
        """Stops following a position; back to neutral."""
        if self.aim.roi_ned is not None:
            self.neutral()

    # What it is at

    def q_ned_from_frd(self) -> Quat:
        """Attitude of the camera's body (x ahead) in ned."""
        self.update()
        return quat_of(self.yaw + self._state.yaw_rad, self.pitch)

    def q_heading_from_frd(self) -> Quat:
        """Attitude of the camera's body in the vehicle's levelled frame."""
        self.update()
        return quat_of(self.yaw, self.pitch)

    def q_ned_from_rdf(self) -> Quat:
        """Attitude of the camera by estimate."""
        return product(self.q_ned_from_frd(), _RDF_IN_FRD)

    def q_frd_from_rdf(self) -> Quat:
        """Attitude of the camera in the vehicle's body: what its joints do."""
        return product(inverse(self._state.estimate.q_ned_from_frd), self.q_ned_from_rdf())


def _bounded(value: float, most: float) -> float:
    return min(max(value, -most), most)
