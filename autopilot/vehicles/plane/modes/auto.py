"""The modes in which a plane flies by itself, where they differ from those of what can stop: Hold and Return."""

from math import hypot, isfinite, nan

from autopilot.interface.client_requests import GoTo
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Reply, Severity, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.mission.mission import Mission
from autopilot.navigator.modes.goto import reposition_target
from autopilot.navigator.modes.rtl_destination import Destination, Destinations
from autopilot.navigator.setpoint import Vector
from autopilot.vehicles.plane.modes.approach import Approach

_BANKED = (0.1305, 0.0, 0.0, 0.9914)  # 15 deg to the right: PX4's FW_GPSF_R
_ROUND_PART = 1.5  # of the circle's radius, within which a plane counts as there


def circle(context: NavContext, centre: Vector, radius: float = 0.0) -> None:
    """Asks for a circle round a place [m]; a radius of 0 is NAV_LOITER_RAD's, a negative one is flown to the left."""
    context.setpoint.fly_to(centre, nan, cruise_speed=context.cruise_speed, pass_radius=radius)


def is_round(context: NavContext, centre: Vector, radius: float = 0.0) -> bool:
    """Whether the plane is on a circle, or nearly."""
    north, east, _ = context.state.estimate.pos_ned
    size = abs(radius) or context.number("NAV_LOITER_RAD")
    return hypot(north - centre[0], east - centre[1]) < _ROUND_PART * size


class PlaneHold(FlightMode):
    """Mode Hold: circles where it was, where the mode before ended, or where a client sent it.

    Without a position it flies level circles by attitude: a bank and a height.
    """

    __slots__ = ("_centre", "_context", "_is_active", "_is_goto")

    finishes_takeoff = True

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._centre: Vector = (0.0, 0.0, 0.0)
        self._is_active = self._is_goto = False

    def take(self, request: GoTo) -> Reply:
        """Chooses the next place to circle."""
        context = self._context
        if not context.has_position:
            return Reply(Verdict.TEMPORARILY_REJECTED, "no valid position")
        here = context.state.estimate.pos_ned
        if request.is_pause:
            context.next_hold = (here, nan, False)
        else:
            target = reposition_target(context, self._centre if self._is_active else here, request)
            if isinstance(target, Reply):
                return target
            context.next_hold = (*target, True)
        if isfinite(request.speed_m_s) and request.speed_m_s > 0.0:
            context.cruise_speed = request.speed_m_s
        return ACCEPTED

    @property
    def is_underway(self) -> bool:
        return self._is_active and self._is_goto and not is_round(self._context, self._centre)

    def goes_away(self) -> bool:
        return self._context.next_hold is not None and self._context.next_hold[2]

    def leave(self, following: object) -> None:  # noqa: ARG002
        self._is_active = False

    def forget(self) -> None:
        self._context.next_hold = None

    def start(self) -> None:
        context = self._context
        self._is_active = True
        self._centre, self._is_goto = context.state.estimate.pos_ned, False
        if context.next_hold is not None:
            self._centre, _, self._is_goto = context.next_hold
            context.next_hold = None
        circle(context, self._centre)

    def frame(self) -> None:
        context = self._context
        if context.has_position:
            circle(context, self._centre)
        else:
            context.setpoint.lean(_BANKED, 0.0, nan)


class PlaneCircle(PlaneHold):
    """Mode Circle of ArduPilot: as Hold, and places that clients ask for are Hold's."""

    __slots__ = ()

    def forget(self) -> None:
        """Nothing has been asked of it: the place that waits is Hold's."""


class PlaneReturn(FlightMode):
    """Mode Return: at RTL_RETURN_ALT or its own height to where RTL_TYPE says, and lands there.

    With RTL_LAND_DELAY below 0 it circles there, at RTL_DESCEND_ALT.
    """

    __slots__ = ("_approach", "_centre", "_context", "_destination", "_destinations", "_is_landing", "_mission")

    def __init__(self, context: NavContext, destinations: Destinations, mission: Mission) -> None:
        self._context = context
        self._destinations = destinations
        self._mission = mission
        self._approach = Approach(context)
        self._destination: Destination
        self._centre: Vector = (0.0, 0.0, 0.0)
        self._is_landing = False

    def start(self) -> None:
        context = self._context
        context.use_return_speed()
        self._is_landing = False
        self._destination = destination = self._destinations.choose()
        if destination.name != "home":
            context.announcer.statustext(Severity.INFO, f"Return to {destination.name}")
        north, east, down = destination.position
        lowest_d = down - context.number("RTL_RETURN_ALT")
        self._centre = (north, east, min(lowest_d, context.state.estimate.pos_ned[2]))
        circle(context, self._centre)

    def frame(self) -> None:
        context = self._context
        if self._is_landing:
            if self._destination.landing_item is not None:
                self._mission.frame()
            else:
                self._approach.frame()
        elif is_round(context, self._centre):
            self._arrive()

    def go_around(self, height_m: float) -> Reply:
        if not self._is_landing:
            return super().go_around(height_m)
        is_mission = self._destination.landing_item is not None
        return self._mission.go_around(height_m) if is_mission else self._approach.go_around(height_m)

    def _arrive(self) -> None:
        context, destination = self._context, self._destination
        if destination.landing_item is not None:
            self._is_landing = True
            self._mission.set_current(destination.landing_item)
            self._mission.start()
        elif context.number("RTL_LAND_DELAY") < 0.0:
            north, east, down = destination.position
            self._centre = (north, east, down - context.number("RTL_DESCEND_ALT"))
            circle(context, self._centre)
        else:
            self._is_landing = True
            self._approach.start(destination.position)
