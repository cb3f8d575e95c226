"""Return: climb, fly to where RTL_TYPE says around what the fence excludes, and land there."""

from enum import IntEnum
from math import hypot, isfinite, radians, tan

from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import Mode, Severity
from autopilot.navigator.context import NavContext
from autopilot.navigator.fence.fence import Fence
from autopilot.navigator.mission.mission import Mission
from autopilot.navigator.modes.rtl_destination import Destination, Destinations
from autopilot.navigator.modes.rtl_landing import Arrival
from autopilot.navigator.paths.waypoint_path import WaypointPath
from autopilot.navigator.setpoint import Vector

_HEIGHT_M = 0.5  # height error at which the climb ends


class _Phase(IntEnum):
    CLIMB = 0
    WAY = 1
    ARRIVED = 2
    MISSION = 3  # flown from its landing part


class Return(FlightMode):
    """Mode Return. Nearer to its end than RTL_MIN_DIST it does not climb first.

    Args:
        context: what the navigator's modes share.
        destinations: where it may lead.
        fence: what to fly around.
        mission: flown from its landing part, if that is where it leads.
    """

    __slots__ = (
        "_arrival",
        "_back_d",
        "_context",
        "_destination",
        "_destinations",
        "_fence",
        "_items",
        "_mission",
        "_path",
        "_phase",
        "_start",
    )  # fmt: skip

    is_below_floor = takes_heading = True

    def __init__(self, context: NavContext, destinations: Destinations, fence: Fence, mission: Mission) -> None:
        self._context = context
        self._destinations = destinations
        self._fence = fence
        self._mission = mission
        self._path = WaypointPath(context)
        self._arrival = Arrival(context)
        self._phase = _Phase.CLIMB
        self._items = mission.items  # when the destination was chosen
        self._destination = Destination((0.0, 0.0, 0.0), "home")
        self._start: Vector = (0.0, 0.0, 0.0)
        self._back_d = 0.0  # [m] height of the way back

    def leave(self, following: Mode) -> None:
        self._mission.leave(following)  # it may end with its landing part

    def start(self) -> None:
        context = self._context
        context.use_return_speed()
        self._head_for(self._destinations.choose())

    def _head_for(self, destination: Destination) -> None:
        context = self._context
        self._destination = destination
        self._items = self._mission.items
        if destination.name != "home":
            context.announcer.statustext(Severity.INFO, f"Return to {destination.name}")
        here = context.stop_point()
        if destination.back:
            self._fly_back(here)
            return
        self._back_d = max(min(here[2], self._return_d(here)), self._fence.ceiling_d())
        self._start = (here[0], here[1], self._back_d)
        self._phase = _Phase.CLIMB
        context.fly_to(self._start, context.state.yaw_rad)

    def frame(self) -> None:
        context = self._context
        if context.is_on_ground and self._phase is not _Phase.MISSION:
            return
        if self._destination.landing_item is not None and self._phase is not _Phase.MISSION:
            if self._mission.items is not self._items:
                self._head_for(self._destinations.choose())  # the mission has been replaced
        if self._phase is _Phase.CLIMB:
            if context.state.estimate.pos_ned[2] < self._back_d + _HEIGHT_M:
                self._cruise()
        elif self._phase is _Phase.WAY:
            if self._path.frame():
                self._arrive()
        elif self._phase is _Phase.ARRIVED:
            self._arrival.frame()
        else:
            self._fly_mission()

    def _fly_mission(self) -> None:
        """The landing part of the mission. A part that does not end on the ground is followed by the way home."""
        context = self._context
        self._mission.frame()
        if context.is_on_ground:
            context.wants_lift = False  # whatever follows the landing is not part of the return
        elif not self._mission.is_flying:
            context.wish = context.next_hold = None
            self._head_for(self._destinations.home())

    def _return_d(self, here: Vector) -> float:
        """Down coordinate [m] of the way back, from the heights and the cone that the parameters give."""
        context = self._context
        destination = self._destination
        way_m = hypot(here[0] - destination.position[0], here[1] - destination.position[1])
        if way_m < context.number("RTL_MIN_DIST"):
            return here[2]
        height = context.number("RTL_RETURN_ALT")
        cone_deg = context.number("RTL_CONE_ANG")
        if cone_deg > 0.0:
            lowest = min(context.number("RTL_DESCEND_ALT"), height)
            height = max(min(height, way_m / tan(radians(min(cone_deg, 89.9)))), lowest)
        home_d = context.state.home_ned[2]
        down = (home_d if destination.landing_item is not None else destination.position[2]) - height
        if destination.landing_item is not None:
            down = min(down, destination.position[2])
        if isfinite(destination.lowest_d):
            down = min(down, destination.lowest_d)
        return down

    def _cruise(self) -> None:
        """Flies to the destination, around what the fence excludes."""
        position = self._destination.position
        goal = (position[0], position[1], self._back_d)
        points = self._fence.path(self._start, goal)
        say = self._context.announcer.statustext
        if points is None:
            say(Severity.WARNING, "No way back inside the fence: returning directly")
        elif len(points) > 1:
            say(Severity.INFO, f"Return around the fence, {len(points) - 1} corners")
        self._phase = _Phase.WAY
        self._path.start(self._start, points or [goal])

    def _fly_back(self, here: Vector) -> None:
        """Along the mission's places, at their heights."""
        *_, last = self._destination.back
        home = self._destination.position
        self._back_d = last[2]
        self._phase = _Phase.WAY
        self._path.start(here, [*self._destination.back, (home[0], home[1], last[2])])

    def _arrive(self) -> None:
        destination = self._destination
        if destination.landing_item is None:
            self._phase = _Phase.ARRIVED
            self._arrival.start(destination.position, destination.yaw, self._back_d)
            return
        self._phase = _Phase.MISSION
        self._mission.set_current(destination.landing_item)
        self._mission.start()
