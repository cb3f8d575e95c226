"""ArduPilot's Dock: drives up to a target that a companion sees (LANDING_TARGET), and stops its front before it."""

from math import atan2, hypot, radians, sqrt

from autopilot.interface.client_requests import LandingTargetReport
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Reply, Severity
from autopilot.navigator.context import NavContext
from autopilot.navigator.target_filter import TargetFilter
from autopilot.vehicles.planned_limits import planned_accel
from common.attitude import wrapped

_FRESH_US = 3_000_000  # a target not seen for longer is lost
_ACCEL_STD_M_S2 = 0.5  # of a target that hardly moves; guess
_SIGHT_STD_M = 0.1  # guess
_ABEAM_RAD = radians(60.0)  # a target near by and farther from the nose is backed away from; guess
_AHEAD_RAD = radians(15.0)  # until it is there; guess
_NEAR_RADII = 3.0  # of the smallest circle: nearer than this a target may be inside it


class RoverDock(FlightMode):
    """Mode Dock."""

    __slots__ = ("_context", "_is_backing", "_is_docked", "_is_lost", "_target")

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._target = TargetFilter(_ACCEL_STD_M_S2)
        self._is_backing = self._is_docked = self._is_lost = False

    def take(self, request: LandingTargetReport) -> Reply:
        """The target has been seen."""
        self._target.report(self._context.state.time_us, request.pos_ned, None, _SIGHT_STD_M)
        return ACCEPTED

    def refusal(self) -> str:
        return "" if self._sees_target else "no docking target in sight"

    def start(self) -> None:
        self._is_backing = self._is_docked = self._is_lost = False

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
        course, fastest = atan2(away[1], away[0]), context.number("HG_RO_DOCK_SPD")
        self._is_backing = self._must_back(hypot(*away), abs(wrapped(course - context.state.yaw_rad)))
        if self._is_backing:
            context.setpoint.drive(speed=-fastest, yaw=course)
            return
        left_m = hypot(*away) - context.craft.front_m - context.number("HG_RO_DOCK_STP")
        if left_m <= 0.0:
            self._is_docked = True
            context.announcer.statustext(Severity.INFO, "Docked")
            return
        braking = sqrt(2.0 * 0.5 * planned_accel(context.number(context.craft.limits.accel_hor)) * left_m)
        context.setpoint.drive(speed=max(min(fastest, braking), 0.1), yaw=course)

    def _must_back(self, distance_m: float, off_nose_rad: float) -> bool:
        """Whether what cannot turn on the spot backs away from a target beside it, the nose turning there."""
        turning = self._context.craft.limits.turning
        radius_m = 0.0 if turning is None else turning.radius(self._context.number)
        if self._is_backing:
            return off_nose_rad > _AHEAD_RAD
        return distance_m < _NEAR_RADII * radius_m and off_nose_rad > _ABEAM_RAD

    @property
    def _sees_target(self) -> bool:
        return self._target.time_us is not None and self._context.state.time_us - self._target.heard_us < _FRESH_US
