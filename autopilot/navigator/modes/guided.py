"""Guided: goes where commands and setpoints of a client say, by ArduPilot's rules, and holds otherwise.

It may be entered without any setpoint. A position is kept until something else is asked for; velocity, acceleration,
attitude and rates stop after GUID_TIMEOUT. A take-off stays in the mode.
"""

from enum import Enum, auto
from math import isfinite, nan

from autopilot.interface.client_requests import GoTo, OffboardSetpoint, TakeOff
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, LandedState, Mode, Reply, Severity, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.modes.goto import reposition_target
from autopilot.navigator.modes.takeoff import Climb, is_high, takeoff_refusal
from autopilot.navigator.paths.waypoint_path import WaypointPath
from autopilot.navigator.setpoint import Vector
from autopilot.navigator.takeoff_intent import Ask, vertical_ask
from autopilot.ports import SETPOINT_ATTITUDE, SETPOINT_LEAN, SETPOINT_TRAJECTORY
from common.attitude import yaw_of

THRUST_IS_THRUST = 8  # bit of GUID_OPTIONS
_LEAST_TAKEOFF_M = 0.5  # above the position where it stands; guess
_HIGHEST_M = 10_000.0


class _Task(Enum):
    PLACE = auto()
    CLIMB = auto()
    SETPOINT = auto()


class Guided(FlightMode):
    """Mode Guided, and what clients ask of it."""

    __slots__ = (
        "_climb",
        "_context",
        "_is_active",
        "_is_flown",
        "_is_line",
        "_is_reported",
        "_next",
        "_path",
        "_position",
        "_received_us",
        "_setpoint",
        "_task",
        "_yaw",
    )  # fmt: skip

    takes_heading = True
    begins_anew = False

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._climb = Climb(context)
        self._is_active = False
        self._task = _Task.PLACE
        self._position: Vector = (0.0, 0.0, 0.0)  # [m]
        self._yaw = 0.0  # [rad]
        self._is_line = False  # on a straight line to the position
        self._is_flown = False  # what is asked for is in the setpoint
        self._is_reported = False  # that it stands on the ground
        self._path = WaypointPath(context)  # around what the fence excludes
        self._next: tuple[Vector, float] | None = (
            None  # a position asked for before the mode was entered, or on take-off
        )
        self._setpoint: OffboardSetpoint | None = None
        self._received_us = 0

    # ---- the mode ----

    def start(self) -> None:
        """Holds where the vehicle can stop, or goes where a client has just asked it to go."""
        context = self._context
        self._is_active = True
        self._is_reported = False
        if self._next is not None:
            position, yaw = self._next
            self._next = None
            self._go(position, yaw, is_line=True)
        else:
            self._go(context.stop_point(), context.state.yaw_rad, is_line=False)

    def leave(self, following: Mode) -> None:
        if following is not Mode.GUIDED:
            self._is_active = False

    def forget(self) -> None:
        self._next = None

    def may_go(self, *, is_taking_off: bool) -> bool:  # noqa: ARG002
        return self._is_climbing

    def frame(self) -> None:
        context = self._context
        if self._task is _Task.CLIMB:
            if self._climb.frame() or (self._next is not None and is_high(context)):
                self._climbed()
        elif context.is_on_ground:
            self._stand()
        elif self._task is _Task.SETPOINT:
            self._follow()
        elif self._path.left:
            self._is_flown = not self._path.frame()
        elif not self._is_flown:
            self._is_flown = True
            context.fly_to(self._position, self._yaw, context.state.estimate.pos_ned if self._is_line else None)

    def _climbed(self) -> None:
        """A take-off is over: stays there, or goes where a client has sent it meanwhile."""
        if self._next is None:
            self._go(self._climb.target_ned, self._climb.yaw, is_line=False)
            self._is_flown = True
        else:
            position, self._next = self._next, None
            self._go(*position, is_line=True)

    def _go(self, position: Vector, yaw: float, *, is_line: bool) -> None:
        self._task = _Task.PLACE
        self._position, self._yaw, self._is_line = position, yaw, is_line
        self._is_flown = False
        self._path.stop()
        here = self._context.stop_point() if is_line else position
        points = self._context.find_path(here, position) if is_line else None
        if points is not None and len(points) > 1:
            self._path.start(here, points)
            self._is_flown = True

    def _stand(self) -> None:
        """On the ground: an attitude with thrust leaves it, everything else needs a take-off first."""
        context, setpoint = self._context, self._setpoint
        self._is_flown = False
        if self._task is not _Task.SETPOINT or setpoint is None or self._is_stale:
            return
        if setpoint.kind != SETPOINT_TRAJECTORY:
            context.wants_lift = (
                vertical_ask(setpoint, context.state.estimate, nan, context.craft.lift_thrust) is Ask.UP
            )
        elif not self._is_reported:
            self._is_reported = True
            context.announcer.statustext(Severity.WARNING, "Guided: on the ground, a takeoff comes first")

    @property
    def _is_stale(self) -> bool:
        return self._context.state.time_us - self._received_us > self._context.number("GUID_TIMEOUT") * 1e6

    def _follow(self) -> None:
        context, setpoint = self._context, self._setpoint
        if setpoint is None:
            return
        if not self._is_flown:
            self._is_flown = True
            context.setpoint.follow(setpoint, context.cruise_speed)
        elif not _is_position(setpoint) and self._is_stale:
            self._go(context.stop_point(), context.state.yaw_rad, is_line=False)

    # ---- what clients ask for ----

    def take(self, request: GoTo | OffboardSetpoint | TakeOff) -> Reply:
        match request:
            case GoTo():
                return self._go_to(request)
            case OffboardSetpoint():
                if self._context.flown is self:
                    self._receive(request)
                return ACCEPTED
            case TakeOff():
                return self._take_off(request.alt_amsl_m, request.yaw_rad)

    def _take_off(self, alt_amsl_m: float, yaw: float) -> Reply:
        """Climbs to an altitude over the position where it stands, and stays in the mode."""
        context = self._context
        refusal = takeoff_refusal(context, alt_amsl_m)
        if refusal:
            return Reply(Verdict.DENIED, refusal)
        state = context.state
        if not state.is_armed:
            return Reply(Verdict.TEMPORARILY_REJECTED, "not armed")
        if state.landed_state is not LandedState.ON_GROUND:
            return Reply(Verdict.TEMPORARILY_REJECTED, "in the air already")
        height_m = alt_amsl_m - state.position.alt_m
        if not isfinite(alt_amsl_m):
            alt_amsl_m = state.position.alt_m + context.number("MIS_TAKEOFF_ALT")
        elif not _LEAST_TAKEOFF_M <= height_m <= _HIGHEST_M:
            return Reply(Verdict.DENIED, f"{height_m:.1f} m above the ground is out of range")
        self._task = _Task.CLIMB
        self._next = None
        context.heading.end_turn()
        self._climb.start(context.down_of(alt_amsl_m), yaw)
        return ACCEPTED

    def _go_to(self, request: GoTo) -> Reply:
        """Goes to a position; what is NaN stays as it is."""
        context = self._context
        if not context.has_position:
            return Reply(Verdict.TEMPORARILY_REJECTED, "no valid position")
        if request.is_pause:
            return self._take((context.stop_point(), context.state.yaw_rad))
        is_held = self._is_active and self._task is _Task.PLACE
        base = self._position if is_held else context.stop_point()
        target = reposition_target(context, base, request)
        if isinstance(target, Reply):
            return target
        if context.find_path(context.stop_point(), target[0]) is None:
            return Reply(Verdict.DENIED, "there is no way to the target inside the fence")
        if isfinite(request.speed_m_s) and request.speed_m_s > 0.0:
            context.cruise_speed = request.speed_m_s
        return self._take(target)

    def _take(self, target: tuple[Vector, float]) -> Reply:
        if self._is_active and (is_high(self._context) or not self._is_climbing):
            self._context.heading.end_turn()
            self._go(*target, is_line=True)
        else:
            self._next = target
        return ACCEPTED

    @property
    def _is_climbing(self) -> bool:
        """Whether a take-off has been asked for and is not over."""
        return self._is_active and self._task is _Task.CLIMB and self._context.state.is_armed

    def _receive(self, setpoint: OffboardSetpoint) -> None:
        """An external setpoint, in the air or to leave the ground."""
        if isfinite(setpoint.yaw) or isfinite(setpoint.yaw_rate) or setpoint.kind != SETPOINT_TRAJECTORY:
            self._context.heading.end_turn()
        self._setpoint = self._as_flown(setpoint)
        self._received_us = self._context.state.time_us
        if self._task is not _Task.CLIMB or not self._context.is_on_ground:
            self._task = _Task.SETPOINT
            self._is_flown = False
            self._next = None

    def _as_flown(self, setpoint: OffboardSetpoint) -> OffboardSetpoint:
        """An attitude's thrust is a climb rate, 0.5 for none, unless GUID_OPTIONS says that it is a thrust."""
        context = self._context
        if setpoint.kind != SETPOINT_ATTITUDE or int(context.number("GUID_OPTIONS")) & THRUST_IS_THRUST:
            return setpoint
        fraction = 2.0 * setpoint.thrust - 1.0
        vertical = context.vertical
        speed = context.number(vertical.climb_speed if fraction > 0.0 else vertical.descend_speed)
        has_yaw_rate = isfinite(setpoint.yaw_rate)
        return OffboardSetpoint(
            setpoint.time_us,
            SETPOINT_LEAN,
            vel_ned=(nan, nan, -fraction * speed),
            accel_ned=(0.0, 0.0, nan),  # over ground the trajectory goes along with the vehicle
            yaw=nan if has_yaw_rate else yaw_of(setpoint.q_ned_from_frd),
            yaw_rate=setpoint.yaw_rate,
            q_ned_from_frd=setpoint.q_ned_from_frd,
        )


def _is_position(setpoint: OffboardSetpoint) -> bool:
    """Whether a setpoint names a position or a height, and nothing that moves."""
    moves = (*setpoint.vel_ned, *setpoint.accel_ned, setpoint.yaw_rate)
    return setpoint.kind == SETPOINT_TRAJECTORY and not any(isfinite(element) and element for element in moves)
