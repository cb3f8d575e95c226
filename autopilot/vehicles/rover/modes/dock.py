"""ArduPilot's Dock: drives up to a target that a companion sees (LANDING_TARGET), and stops its front before it."""

from math import atan2, hypot, pi, radians, sqrt

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
_ASTERN_RAD = radians(120.0)  # farther from the nose than this it is behind, and driven away from; guess
_AHEAD_RAD = radians(15.0)  # the nose shows to it; guess
_BACKING_M_S = 0.5  # and no faster; guess
_NEAR_RADII = 3.0  # of the smallest circle: nearer than this a target may be inside it


class RoverDock(FlightMode):
    """Mode Dock."""

    __slots__ = ("_away", "_context", "_is_docked", "_is_lost", "_target")

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._target = TargetFilter(_ACCEL_STD_M_S2)
        self._away = 0.0  # it drives away from the target first: 1 ahead, -1 backwards
        self._is_docked = self._is_lost = False

    def take(self, request: LandingTargetReport) -> Reply:
        """The target has been seen."""
        self._target.report(self._context.state.time_us, request.pos_ned, None, _SIGHT_STD_M)
        return ACCEPTED

    def refusal(self) -> str:
        return "" if self._sees_target else "no docking target in sight"

    def start(self) -> None:
        self._away = 0.0
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
        course, fastest = atan2(away[1], away[0]), context.number("HG_RO_DOCK_SPD")
        off_nose_rad = abs(wrapped(course - context.state.yaw_rad))
        self._away = self._way_out(hypot(*away), off_nose_rad)
        if self._away:
            speed, heading = min(fastest, _BACKING_M_S), course if self._away < 0.0 else wrapped(course + pi)
            context.setpoint.drive(speed=self._away * speed, yaw=heading)
            return
        left_m = hypot(*away) - context.craft.front_m - context.number("HG_RO_DOCK_STP")
        if left_m <= 0.0 and self._near_m == 0.0 and off_nose_rad > _AHEAD_RAD:
            context.setpoint.drive(speed=0.0, yaw=course)  # turns where it stands
            return
        if left_m <= 0.0:
            self._is_docked = True
            context.announcer.statustext(Severity.INFO, "Docked")
            return
        braking = sqrt(2.0 * 0.5 * planned_accel(context.number(context.craft.limits.accel_hor)) * left_m)
        context.setpoint.drive(speed=max(min(fastest, braking), 0.1), yaw=course)

    @property
    def _near_m(self) -> float:
        """Nearer than this a target may be where it cannot steer to; 0 for what turns on the spot."""
        turning = self._context.craft.limits.turning
        return 0.0 if turning is None else _NEAR_RADII * turning.radius(self._context.number)

    def _way_out(self, distance_m: float, off_nose_rad: float) -> float:
        """Which way what cannot turn on the spot gets away from a near target: 1 ahead, -1 backwards, 0: it need not.

        Backwards from one beside it, the nose turning there; ahead from one behind, to turn round where there is room.
        """
        if distance_m > self._near_m or (self._away < 0.0 and off_nose_rad < _AHEAD_RAD):
            return 0.0
        if self._away:
            return self._away
        if off_nose_rad > _ASTERN_RAD:
            return 1.0
        return -1.0 if off_nose_rad > _ABEAM_RAD else 0.0

    @property
    def _sees_target(self) -> bool:
        return self._target.time_us is not None and self._context.state.time_us - self._target.heard_us < _FRESH_US
