"""The modes in which a rover drives by itself, where they differ from those of what flies: Hold and the ways back."""

from math import hypot

from autopilot.interface.client_requests import GoTo
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Mode, Reply, Severity
from autopilot.navigator.context import NavContext
from autopilot.navigator.fence.fence import Fence
from autopilot.navigator.modes.hold import Hold
from autopilot.navigator.modes.rtl_destination import Destinations
from autopilot.navigator.paths.breadcrumbs import Breadcrumbs
from autopilot.navigator.paths.waypoint_path import WaypointPath
from autopilot.vehicles.rover.modes.sticks import Position

_STANDING_M_S = 0.1


class RoverHold(Hold):
    """Mode Hold: stops and stands there, or at a place that it was sent to. Without a position it stands braked.

    Where it comes to stand is known once it does: a car in a turn, or one whose wheels slip, stops nowhere near the
    place that its speed points at, and would have to drive there.
    """

    __slots__ = ("_is_blind", "_is_stopping")

    def __init__(self, context: NavContext) -> None:
        super().__init__(context, steered=Position(context))
        self._is_blind = False
        self._is_stopping = False

    def take(self, request: GoTo) -> Reply:
        reply = super().take(request)
        if request.is_pause and reply is ACCEPTED:
            self._context.next_hold = None
        return reply

    def start(self) -> None:
        self._is_stopping = self._context.next_hold is None
        super().start()
        if self._is_stopping:
            self._is_flown = True
            self._context.setpoint.drive(speed=0.0, yaw_rate=0.0)

    def frame(self) -> None:
        context = self._context
        if not context.has_position:
            self._is_blind = True
            context.setpoint.idle()
            return
        if self._is_blind:
            self._is_blind = False
            self.start()
        super().frame()
        if self._is_stopping and not self._is_steered:
            self._stop()

    def _stop(self) -> None:
        """Chooses the place to hold, once it stands."""
        context = self._context
        vel_north, vel_east, _ = context.state.estimate.vel_ned
        if hypot(vel_north, vel_east) < context.number("RO_SPEED_TH"):
            self._is_stopping = False
            self.target_ned, self.yaw = context.state.estimate.pos_ned, context.state.yaw_rad
            context.fly_to(self.target_ned, self.yaw)

    def _follow_reset(self) -> None:
        if self._is_goto:
            super()._follow_reset()
        else:
            self.start()


class RoverLoiter(RoverHold):
    """Mode Loiter of ArduPilot: as Hold, and places that clients ask for are Hold's."""

    __slots__ = ()

    def forget(self) -> None:
        """Nothing has been asked of it: the place that waits is Hold's."""


class RoverReturn(FlightMode):
    """Mode Return: drives to where RTL_TYPE says, around what the fence excludes, and stands there."""

    __slots__ = ("_context", "_destinations", "_fence", "_path")

    def __init__(self, context: NavContext, destinations: Destinations, fence: Fence) -> None:
        self._context = context
        self._destinations = destinations
        self._fence = fence
        self._path = WaypointPath(context)

    def start(self) -> None:
        context = self._context
        context.use_return_speed()
        destination = self._destinations.choose()
        say = context.announcer.statustext
        if destination.name != "home":
            say(Severity.INFO, f"Return to {destination.name}")
        here = context.stop_point()
        if destination.back:
            self._path.start(here, [*destination.back, destination.position])
            return
        points = self._fence.path(here, destination.position)
        if points is None:
            say(Severity.WARNING, "No way back inside the fence: returning directly")
        elif len(points) > 1:
            say(Severity.INFO, f"Return around the fence, {len(points) - 1} corners")
        self._path.start(here, points or [destination.position])

    def leave(self, following: Mode) -> None:  # noqa: ARG002
        self._path.stop()

    def frame(self) -> None:
        context = self._context
        if self._path.frame():  # its last setpoint ends at the destination
            vel_north, vel_east, _ = context.state.estimate.vel_ned
            context.has_ended = hypot(vel_north, vel_east) < _STANDING_M_S and context.number("RTL_LAND_DELAY") >= 0.0


class RoverSmartReturn(FlightMode):
    """Mode Smart return: drives back along the way it came, without its loops, and stands where it was armed.

    What has been driven back is forgotten, so that a pilot who takes over and drives elsewhere returns from there.
    """

    __slots__ = ("_context", "_crumbs", "_path")

    def __init__(self, context: NavContext, crumbs: Breadcrumbs) -> None:
        self._context = context
        self._crumbs = crumbs
        self._path = WaypointPath(context)

    def refusal(self) -> str:
        return self._crumbs.refusal()

    def start(self) -> None:
        self._context.use_return_speed()
        here = self._context.stop_point()
        self._crumbs.points.append(here)
        self._crumbs.tidy()
        self._path.start(here, self._crumbs.points[-2::-1] or self._crumbs.points[:1])

    def leave(self, following: Mode) -> None:  # noqa: ARG002
        self._path.stop()

    def frame(self) -> None:
        is_done = self._path.frame()
        del self._crumbs.points[max(self._path.left, 1) :]
        context = self._context
        if is_done:
            vel_north, vel_east, _ = context.state.estimate.vel_ned
            context.has_ended = hypot(vel_north, vel_east) < _STANDING_M_S and context.number("RTL_LAND_DELAY") >= 0.0
