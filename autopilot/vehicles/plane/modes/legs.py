"""One flown item of a plane's mission at a time: lines that end where the turn to the next begins, circles, landing.

In: an item and where its leg begins. Out: setpoints, and whether the item is done. A waypoint that is passed at another
height is circled until its height is reached, as PX4 does.
"""

from enum import IntEnum
from math import hypot, isfinite, nan, pi, radians, tan

from autopilot.interface.item_lists import MissionItem
from autopilot.interface.vehicle_state import Reply
from autopilot.navigator.context import NavContext
from autopilot.navigator.mission.item_commands import WAYPOINTS, Command, hold_time_s, is_here
from autopilot.navigator.mission.mission_legs import Leg
from autopilot.navigator.mission.mission_route import Route
from autopilot.navigator.modes.precision_landing import PrecisionLand
from autopilot.navigator.paths.spline import bearing
from autopilot.navigator.setpoint import Vector
from autopilot.vehicles.plane.modes.approach import _ENTRY_M, Approach
from autopilot.vehicles.plane.modes.auto import circle, is_round
from autopilot.vehicles.plane.modes.departure import Departure

_AHEAD_M = 500.0  # of a way without an end
_LOITERS = frozenset((Command.LOITER_UNLIMITED, Command.LOITER_TIME, Command.LOITER_TURNS, Command.LOITER_TO_ALT))
_BANKING_S = 0.8  # until it has banked, of a sharp turn; guess
_LINED_UP_M = 150.0  # way to a landing from which a straight one has a direction; guess


class _Stage(IntEnum):
    IDLE = 0
    DEPART = 1
    LINE = 2
    CIRCLE = 3  # until the item's condition
    LEVEL = 4  # straight on, until a height is reached
    LAND = 5


class PlaneLeg(Leg):
    """The item being flown by what cannot stop."""

    def __init__(self, context: NavContext, route: Route, precision: PrecisionLand) -> None:
        super().__init__(context, route, precision)
        self._departure = Departure(context)
        self._approach = Approach(context)
        self._phase = _Stage.IDLE
        self._since_us = 0  # on the circle, at its height
        self._turned_rad = 0.0
        self._bearing = nan
        self._length = 0.0  # [m] of the line
        self._turned_m = 0.0  # of the line, that the turn at its beginning has taken

    def stop(self) -> None:
        """Another mode took over; the leg is remembered, so that it can be gone on with."""
        self._phase = _Stage.IDLE

    def go_around(self, height_m: float) -> Reply:
        return self._approach.go_around(height_m) if self._phase is _Stage.LAND else super().go_around(height_m)

    def forget(self) -> None:
        """The next leg begins where the vehicle is."""
        self.target = self._item = None

    def begin(self, item: MissionItem, *, is_joined: bool) -> None:
        """Begins an item, from the place of the one before or from where the plane is."""
        context = self._context
        start = self.target if is_joined else None
        if start is None:
            self._turned_m = 0.0
        self._item, self._is_done, self._since_us = item, False, 0
        self._start = start or context.state.estimate.pos_ned
        if item.command == Command.LAND and context.is_on_ground:
            self._is_done = True
        elif item.command == Command.TAKEOFF or context.is_on_ground:
            lowest = context.state.home_ned[2] - context.number("MIS_TAKEOFF_ALT")
            asked = self._route.position_of(item)[2] if item.command == Command.TAKEOFF else lowest
            self._phase = _Stage.DEPART
            self._departure.start(min(asked, lowest))
        else:
            self._fly_item(item)

    def frame(self) -> bool:
        """Flies on; true once the item is done."""
        context, item = self._context, self._item
        if item is None:
            return False
        if self._phase is _Stage.DEPART:
            if self._departure.frame():
                self._departed(item)
        elif self._phase is _Stage.LINE:
            self._check_line(item)
        elif self._phase is _Stage.CIRCLE:
            self._check_circle(item)
        elif self._phase is _Stage.LEVEL:
            self._is_done = abs(context.state.estimate.pos_ned[2] - self._goal[2]) < context.alt_radius()
        elif self._phase is _Stage.LAND:
            self._approach.frame()
            if context.is_on_ground:
                self.target = None
                return True
        return self._is_done

    def renew_speeds(self) -> None:
        """The speeds or what follows have changed: asks for the way anew."""
        if self._phase is _Stage.LINE and self.target is not None:
            self._line(self.target)
        elif self._phase is _Stage.CIRCLE:
            circle(self._context, self._goal, self._radius_of(self._item))

    def _departed(self, item: MissionItem) -> None:
        self._start = self._context.state.estimate.pos_ned
        if item.command == Command.TAKEOFF:
            self.target, self._is_done = self._start, True
        else:
            self._fly_item(item)

    def _fly_item(self, item: MissionItem) -> None:
        context, command = self._context, item.command
        if self._phase is not _Stage.LINE:
            self._turned_m = 0.0
        if command == Command.LAND:
            self._land(item)
        elif command == Command.CONTINUE_AND_CHANGE_ALT:
            self._change_height(item)
        elif command in (Command.DELAY, Command.TAKEOFF):
            self._go_round(item, context.state.estimate.pos_ned)
        elif command in _LOITERS:
            self._go_round(item, self._route.position_of(item))
        else:
            self._line(self._route.position_of(item))

    # ---- lines ----

    def _line(self, target: Vector) -> None:
        self._phase = _Stage.LINE
        self.target = self._goal = target
        self._length = hypot(target[0] - self._start[0], target[1] - self._start[1])
        if self._length < 1.0:
            self._start = self._context.state.estimate.pos_ned
        context = self._context
        self.yaw = context.leg_yaw = bearing(self._start, target)
        context.setpoint.fly_to(target, nan, path_start_ned=self._start, cruise_speed=context.cruise_speed)

    def _check_line(self, item: MissionItem) -> None:
        """A waypoint is reached in its radius, where the turn to the next begins, or once it is passed."""
        here, goal = self._context.state.estimate.pos_ned, self._goal
        left_m = hypot(goal[0] - here[0], goal[1] - here[1])
        ahead = (goal[0] - here[0]) * (goal[0] - self._start[0]) + (goal[1] - here[1]) * (goal[1] - self._start[1])
        begin_m = self._turn_begin(item)
        if left_m > begin_m and ahead > 0.0:
            return
        self._turned_m = begin_m
        if hold_time_s(item) > 0.0 or abs(here[2] - goal[2]) > self._context.alt_radius():
            self._go_round(item, goal)
        else:
            self._is_done = True

    def _turn_begin(self, item: MissionItem) -> float:
        """[m] before a waypoint, at which the turn begins: that of a circle flown with HG_FW_ACC that touches both.

        It takes as much of the following line, and no more than the turn before has left of this one.
        """
        context = self._context
        asked_m = max(item.params[1], abs(item.params[2])) if item.command in WAYPOINTS else 0.0
        radius = asked_m if asked_m > 0.0 else context.number("NAV_ACC_RAD")
        following = self._route.next_position(item.seq + 1, self._goal)
        if following is None or hold_time_s(item) > 0.0:
            return radius
        turn = bearing(self._goal, following) - bearing(self._start, self._goal)
        half = 0.5 * abs((turn + pi) % (2.0 * pi) - pi)
        vel_n, vel_e, _ = context.state.estimate.vel_ned
        speed = hypot(vel_n, vel_e)
        turning_m = speed * speed / context.number("HG_FW_ACC")
        begin_m = turning_m * min(tan(min(half, 0.45 * pi)), 1.0) + min(half, 1.0) * _BANKING_S * speed
        following_m = hypot(following[0] - self._goal[0], following[1] - self._goal[1])
        return max(radius, min(begin_m, self._length - self._turned_m, following_m))

    def _change_height(self, item: MissionItem) -> None:
        """Straight on over ground until the height is reached."""
        vel_n, vel_e, _ = self._context.state.estimate.vel_ned
        speed = max(hypot(vel_n, vel_e), 1.0)
        here, down = self._start, self._route.position_of(item)[2]
        self._goal = (here[0] + _AHEAD_M * vel_n / speed, here[1] + _AHEAD_M * vel_e / speed, down)
        self.target = None
        self._phase = _Stage.LEVEL
        self._context.setpoint.fly_to(self._goal, nan, path_start_ned=(here[0], here[1], nan))

    # ---- circles ----

    def _radius_of(self, item: MissionItem | None) -> float:
        """[m] positive clockwise; 0: NAV_LOITER_RAD."""
        if item is None or item.command not in _LOITERS:
            return 0.0
        radius = item.params[1] if item.command == Command.LOITER_TO_ALT else item.params[2]
        return radius if isfinite(radius) else 0.0

    def _go_round(self, item: MissionItem, centre: Vector) -> None:
        self._phase = _Stage.CIRCLE
        self.target = self._goal = centre
        self._since_us = 0
        self._turned_rad, self._bearing = 0.0, nan
        circle(self._context, centre, self._radius_of(item))

    def _check_circle(self, item: MissionItem) -> None:
        context, command = self._context, item.command
        if command == Command.LOITER_UNLIMITED:
            return
        here = context.state.estimate.pos_ned
        is_there = is_round(context, self._goal, self._radius_of(item))
        if not is_there or abs(here[2] - self._goal[2]) > context.alt_radius():
            return
        if self._since_us == 0:
            self._since_us = context.state.time_us
        if command == Command.LOITER_TURNS:
            now = bearing(self._goal, here)
            if isfinite(self._bearing):
                self._turned_rad += abs((now - self._bearing + pi) % (2.0 * pi) - pi)
            self._bearing = now
            self._is_done = self._turned_rad >= 2.0 * pi * max(item.params[0], 0.0)
        else:
            wait_s = 0.0 if command == Command.LOITER_TO_ALT else hold_time_s(item)
            self._is_done = context.state.time_us - self._since_us >= int(wait_s * 1e6)

    # ---- landing ----

    def _land(self, item: MissionItem) -> None:
        """Straight in from the place before, if that is far enough and low enough for the slope; else by a circle."""
        context = self._context
        ground_d = context.state.home_ned[2] if is_here(item) else self._route.position_of(item)[2]
        place = context.state.home_ned if is_here(item) else self._route.position_of(item)
        self._phase = _Stage.LAND
        self.target = self._goal = (place[0], place[1], ground_d)
        way_m = hypot(place[0] - self._start[0], place[1] - self._start[1])
        slope = tan(radians(context.number("FW_LND_ANG")))
        yaw = bearing(self._start, place) if way_m > _LINED_UP_M else nan
        height_m = ground_d - self._start[2]
        is_lined_up = height_m <= _ENTRY_M + 1.0 and way_m * slope >= height_m
        self._approach.start(self._goal, yaw, is_lined_up=is_lined_up)
