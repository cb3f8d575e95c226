"""ArduPilot's Dock: drives up to a target that a companion sees (LANDING_TARGET), and stops before it."""

from math import atan2, hypot, sqrt

from autopilot.interface.client_requests import LandingTargetReport
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Reply, Severity
from autopilot.navigator.context import NavContext
from autopilot.navigator.target_filter import TargetFilter

_FRESH_US = 3_000_000  # a target not seen for longer is lost
_ACCEL_STD_M_S2 = 0.5  # of a target that hardly moves; guess
_SIGHT_STD_M = 0.1  # guess
_COURSE_M = 0.5  # nearer the course to the target is kept as it was


class RoverDock(FlightMode):
    """Mode Dock."""

    __slots__ = ("_context", "_course", "_is_docked", "_is_lost", "_target")

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._target = TargetFilter(_ACCEL_STD_M_S2)
        self._course = 0.0  # [rad]
        self._is_docked = self._is_lost = False

    def take(self, request: LandingTargetReport) -> Reply:
        """The target has been seen."""
        self._target.report(self._context.state.time_us, request.pos_ned, None, _SIGHT_STD_M)
        return ACCEPTED

    def refusal(self) -> str:
        return "" if self._sees_target else "no docking target in sight"

    def start(self) -> None:
        self._course = self._context.state.yaw_rad
        self._is_docked = self._is_lost = False

    def frame(self) -> None:
        context = self._context
        if self._is_docked or not self._sees_target:
            if not self._is_docked and not self._is_lost:
                context.announcer.statustext(Severity.WARNING, "Dock: target lost, waiting")
                self._is_lost = True
            context.setpoint.drive(speed=0.0, yaw_rate=0.0)
            return
        self._is_lost = False
        target, here = self._target.at(context.state.time_us), context.state.estimate.pos_ned
        away = (target[0] - here[0], target[1] - here[1])
        left_m = hypot(*away) - context.number("HG_RO_DOCK_STP")
        if left_m <= 0.0:
            self._is_docked = True
            context.announcer.statustext(Severity.INFO, "Docked")
            return
        if hypot(*away) > _COURSE_M:
            self._course = atan2(away[1], away[0])
        braking = sqrt(2.0 * 0.5 * context.number(context.craft.limits.accel_hor) * left_m)
        speed = max(min(context.number("HG_RO_DOCK_SPD"), braking), 0.1)
        context.setpoint.drive(speed=speed, yaw=self._course)

    @property
    def _sees_target(self) -> bool:
        return self._target.time_us is not None and self._context.state.time_us - self._target.heard_us < _FRESH_US
