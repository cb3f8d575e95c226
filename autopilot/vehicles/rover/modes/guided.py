"""Guided: places, velocities and headings of a client, by the rules of ArduPilot's Rover.

A place stays until another is asked for. All that moves the vehicle otherwise must be renewed within GUID_TIMEOUT, or
it stops. A yaw or a yaw rate beside a velocity is followed, and the velocity is then a speed along the nose: forwards
or backwards, as it points. A yaw or a yaw rate alone turns on the spot what can turn there.
"""

from itertools import pairwise
from math import cos, hypot, isfinite, nan, sin

from autopilot.interface.client_requests import GoTo, OffboardSetpoint
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Mode, Reply, Severity, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.modes.goto import reposition_target
from autopilot.navigator.paths.waypoint_path import WaypointPath
from autopilot.navigator.setpoint import Vector
from autopilot.ports import SETPOINT_ATTITUDE, SETPOINT_RATE
from common.attitude import yaw_of

_LOOK_US = 1_000_000  # how often the way of a stream is looked at anew
NO_WAY = "there is no way to the target inside the fence"


class RoverGuided(FlightMode):
    """Mode Guided."""

    __slots__ = (
        "_context", "_goal", "_is_active", "_looked_us", "_next", "_path", "_received_us", "_refused", "_setpoint",
    )  # fmt: skip

    begins_anew = False

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._path = WaypointPath(context)  # around what the fence excludes
        self._goal: Vector | None = None  # [m] where it goes, or has gone
        self._refused: Vector | None = None  # [m] place of a stream that cannot be gone to, which is said once
        self._next: Vector | None = None  # [m] asked for before the mode was entered
        self._setpoint: OffboardSetpoint | None = None  # that must be renewed
        self._received_us = 0
        self._looked_us = 0  # whether the way of a stream is still free
        self._is_active = False

    # ---- the mode ----

    def start(self) -> None:
        """Stops, or goes where a client has just asked it to go."""
        self._is_active = True
        target, self._next = self._next, None
        self._setpoint = self._refused = None
        if target is None or not self._go(target):
            self._stop_going()
            self._stand()

    def leave(self, following: Mode) -> None:
        if following is not Mode.GUIDED:
            self._is_active = False
            self._setpoint = None

    def forget(self) -> None:
        self._next = None

    def frame(self) -> None:
        context, setpoint = self._context, self._setpoint
        if self._path.left:
            self._path.frame()
        elif setpoint is not None:
            silence_s = (context.state.time_us - self._received_us) * 1e-6
            if silence_s > context.number("GUID_TIMEOUT"):
                self._setpoint = None
                self._stand()
                seconds = context.number("GUID_TIMEOUT")
                context.announcer.statustext(Severity.WARNING, f"target not received last {seconds:g}secs, stopping")
            else:
                self._drive(setpoint)

    def _stand(self) -> None:
        self._context.setpoint.drive(speed=0.0, yaw_rate=0.0)

    def _go(self, target: Vector) -> bool:
        """Sets out for a place; whether there is a way."""
        context = self._context
        here = context.stop_point()
        points = context.find_path(here, target)
        if points is None:
            return False
        self._setpoint, self._goal = None, target
        self._path.start(here, points)
        return True

    def _stop_going(self) -> None:
        self._goal = None
        self._path.stop()

    def _drive(self, setpoint: OffboardSetpoint) -> None:
        context = self._context
        drive = context.setpoint.drive
        north, east, _ = setpoint.vel_ned
        has_turn = isfinite(setpoint.yaw) or isfinite(setpoint.yaw_rate)
        if setpoint.kind in (SETPOINT_ATTITUDE, SETPOINT_RATE):
            speed = setpoint.thrust * max(context.number(context.craft.limits.cruise_speed), 0.0)
            if setpoint.kind == SETPOINT_RATE:
                drive(speed=speed, yaw_rate=setpoint.omega_frd[2])
            elif isfinite(setpoint.yaw_rate):
                drive(speed=speed, yaw_rate=setpoint.yaw_rate)
            else:
                drive(speed=speed, yaw=yaw_of(setpoint.q_ned_from_frd))
        elif not (isfinite(north) and isfinite(east)):
            if has_turn:
                drive(speed=0.0, yaw=setpoint.yaw, yaw_rate=nan if isfinite(setpoint.yaw) else setpoint.yaw_rate)
            else:
                self._stand()
        elif has_turn:
            yaw = context.state.yaw_rad
            speed = hypot(north, east)
            if cos(yaw) * north + sin(yaw) * east < 0.0:
                speed = -speed
            drive(speed=speed, yaw=setpoint.yaw, yaw_rate=nan if isfinite(setpoint.yaw) else setpoint.yaw_rate)
        elif hypot(north, east) > 0.0:
            context.setpoint.move((north, east, 0.0), nan)
        else:
            self._stand()

    # ---- what clients ask for ----

    def take(self, request: GoTo | OffboardSetpoint) -> Reply:
        if isinstance(request, OffboardSetpoint):
            if self._context.flown is self and self._is_active:
                self._receive(request)
            return ACCEPTED
        return self._go_to(request)

    def _receive(self, setpoint: OffboardSetpoint) -> None:
        north, east, down = setpoint.pos_ned
        if isfinite(north) and isfinite(east):
            down = down if isfinite(down) else self._context.state.estimate.pos_ned[2]
            self._head_for((north, east, down))
            return
        self._stop_going()
        self._setpoint, self._refused = setpoint, None
        self._received_us = self._context.state.time_us

    def _head_for(self, target: Vector) -> None:
        """A client's stream asks for a place: the same again changes nothing, unless the fence has changed."""
        now_us = self._context.state.time_us
        is_again = _is_at(self._goal, target) or _is_at(self._refused, target)
        if is_again and now_us - self._looked_us < _LOOK_US:
            return
        self._looked_us = now_us
        refusal = self._context.fence_refusal(target)
        if not refusal and not (_is_at(self._goal, target) and self._is_way_free()) and not self._go(target):
            refusal = NO_WAY
        if refusal:
            self._stop_going()
            self._stand()
            if not _is_at(self._refused, target):
                self._context.announcer.statustext(Severity.WARNING, f"Guided: {refusal}")
        self._refused = target if refusal else None

    def _is_way_free(self) -> bool:
        """Whether nothing excluded lies on what is left of the way."""
        context = self._context
        points = [context.state.estimate.pos_ned, *self._path.points[len(self._path.points) - self._path.left :]]
        return all(len(context.find_path(a, b) or ()) == 1 for a, b in pairwise(points))

    def _go_to(self, request: GoTo) -> Reply:
        """Goes to a position; what is NaN stays as it is."""
        context = self._context
        if not context.state.is_armed:
            return Reply(Verdict.TEMPORARILY_REJECTED, "not armed")
        if not context.has_position:
            return Reply(Verdict.TEMPORARILY_REJECTED, "no valid position")
        here = context.stop_point()
        target = here
        if not request.is_pause:
            chosen = reposition_target(context, here, request)
            if isinstance(chosen, Reply):
                return chosen
            target = chosen[0]
            if context.find_path(here, target) is None:
                return Reply(Verdict.DENIED, NO_WAY)
        if isfinite(request.speed_m_s) and request.speed_m_s > 0.0:
            context.cruise_speed = request.speed_m_s
        if self._is_active:
            self._go(target)
        else:
            self._next = target
        return ACCEPTED


def _is_at(place: Vector | None, target: Vector) -> bool:
    """Whether a place is another, heights apart."""
    return place is not None and place[:2] == target[:2]
