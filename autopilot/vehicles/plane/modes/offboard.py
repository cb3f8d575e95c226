"""Offboard: what a client's setpoints mean to a plane, by PX4's rules."""

from math import hypot, isfinite, nan

from autopilot.interface.vehicle_state import Severity
from autopilot.navigator.context import NavContext
from autopilot.navigator.modes.offboard import Offboard
from autopilot.ports import SETPOINT_TRAJECTORY
from autopilot.vehicles.plane.modes.auto import circle


class PlaneOffboard(Offboard):
    """Mode Offboard: a position is circled, a velocity is course, climb rate and airspeed; attitudes and rates as said.

    It takes off from no runway: on the ground it stays.
    """

    __slots__ = ("_is_reported",)

    def __init__(self, context: NavContext) -> None:
        super().__init__(context)
        self._is_reported = False

    def start(self) -> None:
        super().start()
        self._is_reported = False

    def frame(self) -> None:
        latest, context = self.latest, self._context
        if latest is None or context.is_on_ground or latest is self._flown:
            return
        self._flown = latest
        if latest.kind != SETPOINT_TRAJECTORY:
            context.setpoint.follow(latest, context.cruise_speed)
        elif all(map(isfinite, latest.pos_ned)):
            circle(context, latest.pos_ned)
        elif isfinite(latest.vel_ned[0]) and isfinite(latest.vel_ned[1]):
            down = latest.vel_ned[2] if isfinite(latest.vel_ned[2]) else 0.0
            context.setpoint.move((latest.vel_ned[0], latest.vel_ned[1], down), nan)
            context.setpoint.set_speeds(hypot(*latest.vel_ned[:2]), nan, nan)
        elif not self._is_reported:
            self._is_reported = True
            context.announcer.statustext(Severity.WARNING, "Offboard: needs a position or a velocity")
            circle(context, context.state.estimate.pos_ned)
