"""Offboard: what a client's setpoints mean to a rover, by PX4's rules, or along the nose (HG_RO_OFFB_BODY)."""

from math import cos, isfinite, nan, sin

from autopilot.interface.client_requests import OffboardSetpoint
from autopilot.interface.vehicle_state import Severity
from autopilot.navigator.context import NavContext
from autopilot.navigator.modes.offboard import Offboard
from autopilot.ports import SETPOINT_TRAJECTORY


class RoverOffboard(Offboard):
    """Mode Offboard.

    A position is driven to. Of a velocity PX4 takes the size as a speed forward and the direction as a course; yaw, yaw
    rate and acceleration count for nothing. With HG_RO_OFFB_BODY its part along the nose is the speed, negative
    backwards, and yaw or yaw rate are followed.
    """

    __slots__ = ("_is_reported",)

    def __init__(self, context: NavContext) -> None:
        super().__init__(context)
        self._is_reported = False

    def start(self) -> None:
        super().start()
        self._is_reported = False

    def frame(self) -> None:
        latest = self.latest
        if latest is None or latest is self._flown:
            return
        self._flown = latest
        if latest.kind != SETPOINT_TRAJECTORY:
            self._stand("an attitude is nothing to a rover")
        elif isfinite(latest.pos_ned[0]) and isfinite(latest.pos_ned[1]):
            self._context.setpoint.fly_to(latest.pos_ned, nan, cruise_speed=self._context.cruise_speed)
        elif not (isfinite(latest.vel_ned[0]) and isfinite(latest.vel_ned[1])):
            self._stand("needs a position or a velocity")
        elif self._context.number("HG_RO_OFFB_BODY"):
            drive_along_nose(self._context, latest)
        else:
            self._context.setpoint.move((latest.vel_ned[0], latest.vel_ned[1], 0.0), nan)

    def _stand(self, reason: str) -> None:
        self._context.setpoint.drive(speed=0.0, yaw_rate=0.0)
        if not self._is_reported:
            self._is_reported = True
            self._context.announcer.statustext(Severity.WARNING, f"Offboard: {reason}")


def drive_along_nose(context: NavContext, setpoint: OffboardSetpoint) -> None:
    """Drives with the part of a velocity along the nose, and turns as the setpoint says; else where it points."""
    yaw = context.state.yaw_rad
    north, east, _ = setpoint.vel_ned
    speed = cos(yaw) * north + sin(yaw) * east
    if isfinite(setpoint.yaw) or isfinite(setpoint.yaw_rate):
        context.setpoint.drive(speed=speed, yaw=setpoint.yaw, yaw_rate=setpoint.yaw_rate)
    else:
        context.setpoint.move((north, east, 0.0), nan)
