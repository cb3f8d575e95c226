"""Smart return: back along the way it came, without its loops, and down where it took off."""

from math import hypot

from autopilot.interface.mode_spec import FlightMode
from autopilot.navigator.context import NavContext
from autopilot.navigator.modes.rtl_landing import Arrival
from autopilot.navigator.paths.breadcrumbs import Breadcrumbs
from autopilot.navigator.paths.waypoint_path import WaypointPath
from autopilot.navigator.setpoint import Vector


class SmartReturn(FlightMode):
    """Mode Smart return.

    What has been flown back is forgotten, so that a pilot who takes over and flies elsewhere returns from there.
    """

    __slots__ = ("_arrival", "_column", "_context", "_crumbs", "_has_arrived", "_path")

    is_below_floor = takes_heading = True

    def __init__(self, context: NavContext, crumbs: Breadcrumbs) -> None:
        self._context = context
        self._crumbs = crumbs
        self._path = WaypointPath(context)
        self._arrival = Arrival(context)
        self._column = 0  # points of the take-off, which are not flown back
        self._has_arrived = False

    def refusal(self) -> str:
        return self._crumbs.refusal()

    def start(self) -> None:
        context = self._context
        context.use_return_speed()
        here = context.stop_point()
        self._crumbs.points.append(here)
        self._crumbs.tidy()
        back = self._crumbs.points[-2::-1]
        home = self._crumbs.points[0]
        while len(back) > 1 and _is_over(back[-2], home, context.number("SRTL_ACCURACY")):
            del back[-1]  # the take-off itself: the landing goes down there
        self._column = len(self._crumbs.points) - 1 - len(back)
        self._has_arrived = False
        if back:
            self._path.start(here, back)
        else:
            self._arrive()

    def frame(self) -> None:
        if self._context.is_on_ground:
            return
        if self._has_arrived:
            self._arrival.frame()
            return
        is_done = self._path.frame()
        del self._crumbs.points[max(self._path.left + self._column, 1) :]
        if is_done:
            self._arrive()

    def _arrive(self) -> None:
        self._has_arrived = True
        state = self._context.state
        north, east, _ = self._crumbs.points[0]
        self._arrival.start((north, east, state.home_ned[2]), state.home_yaw_rad, state.estimate.pos_ned[2])


def _is_over(a: Vector, b: Vector, near_m: float) -> bool:
    return hypot(a[0] - b[0], a[1] - b[1]) < near_m
