"""Hold: stays at one position, or goes to one and stays there."""

from math import isfinite

from autopilot.interface.client_requests import GoTo
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Mode, Reply, Verdict
from autopilot.navigator.context import NavContext, distance
from autopilot.navigator.modes.goto import reposition_target
from autopilot.navigator.paths.waypoint_path import WaypointPath
from autopilot.navigator.setpoint import Vector


class Hold(FlightMode):
    """Mode Hold: the position is where the mode before ended, where a client sent the vehicle, or where it can stop.

    Where a pilot's sticks steer it (ArduPilot's LOITER), it is another mode as long as he steers.

    Args:
        context: shared by the modes.
        steered: the mode that follows his sticks.
    """

    __slots__ = (
        "_context",
        "_is_active",
        "_is_flown",
        "_is_goto",
        "_is_steered",
        "_path",
        "_reset_count",
        "_steered",
        "_via",
        "target_ned",
        "yaw",
    )  # fmt: skip

    finishes_takeoff = takes_heading = True

    def __init__(self, context: NavContext, steered: FlightMode) -> None:
        self._context = context
        self._is_active = False  # not while a take-off is finished first
        self._is_flown = False
        self._is_goto = False  # on a straight line to the position
        self._steered = steered
        self._path = WaypointPath(context)
        self._via: list[Vector] = []  # [m] points to go over on the next way to a position
        self._is_steered = False
        self._reset_count = 0  # of the estimate
        self.target_ned: Vector = (0.0, 0.0, 0.0)  # [m]
        self.yaw = 0.0  # [rad]

    def take(self, request: GoTo) -> Reply:
        """Chooses the next position to hold."""
        context = self._context
        if not context.has_position:
            return Reply(Verdict.TEMPORARILY_REJECTED, "no valid position")
        if request.is_pause:
            context.next_hold = (context.stop_point(), context.state.yaw_rad, False)
        else:
            target = reposition_target(context, self.target_ned if self._is_active else context.stop_point(), request)
            if isinstance(target, Reply):
                return target
            points = context.find_path(context.stop_point(), target[0])
            if points is None:
                return Reply(Verdict.DENIED, "there is no way to the target inside the fence")
            self._via = points[:-1]
            context.next_hold = (*target, True)
        if isfinite(request.speed_m_s) and request.speed_m_s > 0.0:
            context.cruise_speed = request.speed_m_s
        return ACCEPTED

    @property
    def is_underway(self) -> bool:
        if not self._is_active:  # a take-off is finished before it goes there
            return self._context.state.is_armed
        way_m = distance(self._context.state.estimate.pos_ned, self.target_ned)
        return self._is_goto and way_m > self._context.number("NAV_ACC_RAD")

    def goes_away(self) -> bool:
        next_hold = self._context.next_hold
        return next_hold is not None and next_hold[2]

    def leave(self, following: Mode) -> None:  # noqa: ARG002
        self._is_active = False

    def forget(self) -> None:
        self._context.next_hold = None
        self._via = []

    def start(self) -> None:
        context = self._context
        self._is_active = True
        if context.next_hold is not None:
            self.target_ned, self.yaw, self._is_goto = context.next_hold
            context.next_hold = None
        else:
            self._is_goto = False
            self.target_ned, self.yaw = context.stop_point(), context.state.yaw_rad
        via, self._via = self._via if self._is_goto else [], []
        self._is_flown = bool(via)
        if via:
            self._path.start(context.stop_point(), [*via, self.target_ned])
        else:
            self._path.stop()
        self._reset_count = context.state.estimate.reset_count

    def frame(self) -> None:
        context = self._context
        if context.state.sticks.steer_hold and self._follow_sticks():
            return
        if context.state.estimate.reset_count != self._reset_count:
            self._follow_reset()
        if self._path.left:
            self._is_flown = not self._path.frame()
        elif context.is_on_ground:
            self._is_flown = False
        elif not self._is_flown:
            self._is_flown = True
            context.fly_to(self.target_ned, self.yaw, context.state.estimate.pos_ned if self._is_goto else None)

    def _follow_sticks(self) -> bool:
        """Flies as the sticks say and returns whether somebody steers; once nobody does, it stops."""
        state = self._context.state
        if state.sticks.has_pilot(state.time_us):
            self._is_steered = True
            self._steered.frame()
        elif self._is_steered:
            self._is_steered = False
            self.start()
        return self._is_steered

    def _follow_reset(self) -> None:
        """The estimate has jumped: a vehicle that holds stays where it is, one that was sent still goes there."""
        estimate = self._context.state.estimate
        self._reset_count = estimate.reset_count
        if not self._is_goto:
            north, east, down = self.target_ned
            jump = estimate.pos_reset_ned
            self.target_ned = (north + jump[0], east + jump[1], down)
            self._is_flown = False
