"""One flown item of a mission at a time: the way to its place, and what is done there.

In: an item and where its leg begins. Out: setpoints, and whether the item is done.
"""

from enum import IntEnum
from math import cos, hypot, isfinite, nan, pi, radians, sin

from autopilot.interface.item_lists import MissionItem
from autopilot.interface.vehicle_state import Reply, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.mission.item_commands import WAYPOINTS, Command, hold_time_s, is_here, passes_through
from autopilot.navigator.mission.mission_route import Route, distance_to_line
from autopilot.navigator.modes.land import Landing
from autopilot.navigator.modes.precision_landing import PrecisionLand
from autopilot.navigator.modes.takeoff import Climb
from autopilot.navigator.paths.spline import Polyline, Runner, Turns, bearing, between, distinct, spline
from autopilot.navigator.setpoint import Vector

_ON_PATH_M = 5.0  # a vehicle paused this near its leg goes back to it rather than straight on; guess
_LANDING_RADIUS_M = 1.0  # a descent begins this near its place
_IF_SEEN, _WITH_SEARCH = 1.0, 2.0  # PRECISION_LAND_MODE
_STANDING: Vector = (0.0, 0.0, 0.0)


class _Stage(IntEnum):
    IDLE = 0
    CLIMB = 1
    TRAVEL = 2
    WAIT = 3  # until a time
    STAY = 4  # for ever
    LAND = 5
    CURVE = 6
    LEVEL = 7  # until a height is reached


class Leg:
    """The item being flown."""

    def __init__(self, context: NavContext, route: Route, precision: PrecisionLand) -> None:
        self.target: Vector | None = None  # [m] place of the present leg or stay
        self.yaw = 0.0  # [rad]
        self._context = context
        self._route = route
        self._climb = Climb(context)
        self._landing = Landing(context)
        self._precision = precision
        self._is_precise = False  # the landing being flown
        self._stage = _Stage.IDLE
        self._item: MissionItem | None = None
        self._start: Vector = _STANDING  # [m] where the way to the target begins
        self._goal: Vector = _STANDING  # [m] where it ends, also after an interruption
        self._exit_speed = 0.0
        self._acceptance = 0.0  # [m] that the item or NAV_ACC_RAD asks for
        self._radius_sq = 0.0  # [m²] in which the position counts as reached
        self._alt_radius = 0.0  # [m]
        self._until_us = 0
        self._runner: Runner | None = None
        self._along: Vector = _STANDING  # direction in which the last leg ended; zero: at rest
        self._home: object = None  # that the target was computed with
        self._is_done = False

    # ---- what the mission asks for ----

    def stop(self) -> None:
        """Another mode took over; the leg is remembered, so that it can be gone on with."""
        self._stage = _Stage.IDLE

    def go_around(self, height_m: float) -> Reply:  # noqa: ARG002
        """Gives up a landing, of what cannot stop in the air."""
        return Reply(Verdict.TEMPORARILY_REJECTED, "not landing")

    def forget(self) -> None:
        """The next leg begins where the vehicle is."""
        self.target = None
        self._item = None
        self._along = _STANDING

    def begin(self, item: MissionItem, *, is_joined: bool) -> None:
        """Begins an item.

        Args:
            item: to fly.
            is_joined: from the position of the item before, rather than from where the vehicle is.
        """
        context = self._context
        command = item.command
        start = self.target if is_joined else None
        if start is None:
            self.target = None
            self._along = _STANDING
        before, self._item = self._item, item
        self._is_done = False
        if command == Command.DELAY:
            self._wait(hold_time_s(item))
        elif command == Command.LAND and context.is_on_ground:
            self._wait(0.0)
        elif command == Command.TAKEOFF:
            self._stage = _Stage.CLIMB
            self._climb.start(self._route.position_of(item)[2], radians(item.params[3]))
        elif command == Command.CONTINUE_AND_CHANGE_ALT:
            self._change_alt(item)
        elif context.is_on_ground:
            lowest = context.state.home_ned[2] - context.number("MIS_TAKEOFF_ALT")
            self._stage = _Stage.CLIMB
            self._climb.start(min(self._route.position_of(item)[2], lowest), nan)
        elif start is None and before is item and item.command != Command.SPLINE_WAYPOINT and self._is_on_path():
            self._travel(item, self._start)
        else:
            self._travel(item, start or context.stop_point())

    def frame(self) -> bool:
        """Flies on; true once the item is done."""
        context = self._context
        stage = self._stage
        if stage is _Stage.TRAVEL:
            self._check_travel()
        elif stage is _Stage.CURVE:
            self._run_curve()
        elif stage is _Stage.WAIT:
            return context.state.time_us >= self._until_us
        elif stage is _Stage.CLIMB:
            if self._climb.frame():
                self._climbed()
        elif stage is _Stage.LEVEL:
            if self.target is not None and abs(context.state.estimate.pos_ned[2] - self.target[2]) < self._alt_radius:
                if self._item is not None and self._item.command == Command.CONTINUE_AND_CHANGE_ALT:
                    self.target = None  # the next leg begins where the vehicle is
                self._is_done = True
        elif stage is _Stage.LAND:
            if self._is_precise:
                self._precision.frame()
            else:
                self._landing.frame()
            if context.is_on_ground:
                self.target = None
                return True
        return self._is_done

    def renew_speeds(self) -> None:
        """The speeds or what follows have changed: asks for the way anew."""
        item = self._item
        if item is None or self.target is None:
            return
        if self._stage is _Stage.TRAVEL and not self._context.is_on_ground:
            self._fly(item, self.target)
        elif self._stage is _Stage.CURVE and item.command == Command.LOITER_TURNS and self._runner is not None:
            left = self._runner.curve.length - self._runner.arc_length
            self._circle(item, self.target, left)
        elif self._stage is _Stage.CURVE and item.command == Command.SPLINE_WAYPOINT and self._runner is not None:
            position, along = self._runner.curve.at(self._runner.arc_length)
            self._spline(item, position, along, self.target, self._runner.speed)

    def distance_left(self) -> float:
        """Horizontal way [m] to the position of the leg; 0 without one."""
        if self.target is None:
            return 0.0
        here = self._context.state.estimate.pos_ned
        return hypot(self.target[0] - here[0], self.target[1] - here[1])

    # ---- the straight way ----

    def _is_on_path(self) -> bool:
        """Whether the vehicle is still on the leg that it was flying when it was interrupted."""
        return distance_to_line(self._context.state.estimate.pos_ned, self._start, self._goal) < _ON_PATH_M

    def _travel(self, item: MissionItem, start: Vector) -> None:
        """Starts the leg from `start` [m] to the item's place."""
        context = self._context
        self._start = start
        self._home = context.state.home
        self._alt_radius = context.alt_radius()
        target = self._goal_of(item, start)
        asked = radians(item.params[3]) if item.command in WAYPOINTS | {Command.LAND, Command.TAKEOFF} else nan
        if item.command == Command.LOITER_UNLIMITED:
            asked = radians(item.params[3])
        context.heading.is_item_yaw = isfinite(asked)
        self.yaw = context.leg_yaw = context.heading_to(start, target, asked)
        asked_m = max(item.params[1], abs(item.params[2])) if item.command in WAYPOINTS else 0.0
        radius = asked_m if asked_m > 0.0 else context.number("NAV_ACC_RAD")
        if item.command in (Command.LAND, Command.LOITER_TURNS):
            radius = min(radius, _LANDING_RADIUS_M)
        self._acceptance, self._radius_sq = radius, radius * radius
        if item.command == Command.SPLINE_WAYPOINT:
            self.target = self._goal = target
            estimate = context.state.estimate
            speed = hypot(estimate.vel_ned[0], estimate.vel_ned[1]) if self._along != _STANDING else 0.0
            self._spline(item, start, self._along, target, speed)
            return
        self._stage = _Stage.TRAVEL
        self._fly(item, target)

    def _fly(self, item: MissionItem, target: Vector) -> None:
        """Asks for the straight way from the leg's start to `target` [m]."""
        self.target = self._goal = target
        self._exit_speed, radius = self._route.passage(item, self._start, target, self._acceptance)
        self._radius_sq = radius * radius
        self._along = between(self._start, target) if self._exit_speed > 0.0 else _STANDING
        self._context.fly_to(target, self.yaw, self._start, self._exit_speed, radius)

    def _goal_of(self, item: MissionItem, start: Vector) -> Vector:
        """Where the way of an item ends [m]."""
        position = start if item.command == Command.LAND and is_here(item) else self._route.position_of(item)
        if item.command in (Command.LAND, Command.LOITER_TO_ALT):  # goes there at the height it comes from
            return position[0], position[1], start[2]
        if item.command == Command.LOITER_TURNS:
            radius = abs(self._circle_radius(item))
            angle = bearing(position, start) if hypot(position[0] - start[0], position[1] - start[1]) > 0.1 else 0.0
            return position[0] + radius * cos(angle), position[1] + radius * sin(angle), position[2]
        return position

    def _check_travel(self) -> None:
        item, target, context = self._item, self.target, self._context
        if item is None or target is None:
            return
        if context.state.home is not self._home:  # an altitude above home means another height now
            self._home = context.state.home
            target = self._goal_of(item, self._start)
            self._fly(item, target)
        here_n, here_e, here_d = context.state.estimate.pos_ned
        north, east = here_n - target[0], here_e - target[1]
        if north * north + east * east < self._radius_sq:
            if abs(here_d - target[2]) < self._alt_radius:
                self._arrive(item, target)
        elif self._exit_speed > 0.0 and north * self._along[0] + east * self._along[1] > 0.0:
            # Passed at the wrong height, so that it did not count: turns back, and stops there.
            self._exit_speed = 0.0
            self._along = _STANDING
            self._start = context.stop_point()
            context.fly_to(target, self.yaw, self._start)

    def _arrive(self, item: MissionItem, target: Vector) -> None:
        command = item.command
        if command == Command.LAND:
            self._stage = _Stage.LAND
            self._begin_landing(item, target)
        elif command == Command.LOITER_UNLIMITED:
            self._stage = _Stage.STAY
        elif command == Command.LOITER_TURNS:
            turns = item.params[0] if item.params[0] > 0.0 else 1.0
            self._circle(item, target, 2.0 * pi * abs(self._circle_radius(item)) * turns)
        elif command == Command.LOITER_TO_ALT:
            self._stage = _Stage.LEVEL
            position = self._route.position_of(item)
            self.target = self._goal = (position[0], position[1], position[2])
            self._context.fly_to(self.target, self.yaw)
        elif (command in WAYPOINTS or command == Command.LOITER_TIME) and hold_time_s(item) > 0.0:
            self._wait(hold_time_s(item))
        else:
            self._is_done = True

    def _begin_landing(self, item: MissionItem, target: Vector) -> None:
        """Lands, on a target if the item asks for it: parameter 2 is 1 if it happens to be seen, 2 with a search."""
        precision = self._precision
        self._is_precise = item.params[1] == _WITH_SEARCH or (item.params[1] == _IF_SEEN and precision.sees_target)
        if self._is_precise:
            precision.start()
            precision.frame()
        else:
            self._landing.start(target[0], target[1], self.yaw)
            self._landing.frame()

    # ---- climbing, waiting, changing height ----

    def _climbed(self) -> None:
        item = self._item
        self.target = self._goal = self._climb.target_ned
        self.yaw = self._climb.yaw
        if item is not None and (item.command != Command.TAKEOFF or self._is_elsewhere(item)):
            self._travel(item, self.target)
        else:
            self._is_done = True

    def _is_elsewhere(self, item: MissionItem) -> bool:
        if is_here(item) or self.target is None:
            return False
        position = self._route.position_of(item)
        return hypot(position[0] - self.target[0], position[1] - self.target[1]) > self._context.number("NAV_ACC_RAD")

    def _wait(self, time_s: float) -> None:
        context = self._context
        self._stage = _Stage.WAIT
        self._until_us = context.state.time_us + int(time_s * 1e6)
        self._along = _STANDING
        if self.target is None and not context.is_on_ground:
            self.target, self.yaw = context.stop_point(), context.state.yaw_rad
            self._goal = self.target
            context.fly_to(self.target, self.yaw)

    def _change_alt(self, item: MissionItem) -> None:
        """Goes on in the present direction until the height is reached."""
        context = self._context
        estimate = context.state.estimate
        vel_north, vel_east, _ = estimate.vel_ned
        down = self._route.position_of(item)[2]
        self._alt_radius = context.alt_radius()
        north, east, _ = context.stop_point()
        self.target = self._goal = (north, east, down)
        self._stage = _Stage.LEVEL
        speed = hypot(vel_north, vel_east)
        if speed < 1.0:
            context.fly_to(self.target, context.state.yaw_rad)
        else:
            context.setpoint.drift(vel_north, vel_east, down, context.state.yaw_rad)

    # ---- curves ----

    def _circle_radius(self, item: MissionItem) -> float:
        """[m] positive clockwise, negative counter-clockwise."""
        radius = item.params[2]
        return radius if isfinite(radius) and radius != 0.0 else self._context.number("NAV_LOITER_RAD")

    def _circle(self, item: MissionItem, edge: Vector, length: float) -> None:
        """Flies `length` metres around the item's place, from `edge`."""
        radius = self._circle_radius(item)
        position = self._route.position_of(item)
        pace = self._route.pace()
        speed = 0.0 if self._runner is None or self._stage is not _Stage.CURVE else self._runner.speed
        here = edge
        if self._stage is _Stage.CURVE and self._runner is not None:
            here, _ = self._runner.curve.at(self._runner.arc_length)
        turns = length / (2.0 * pi * abs(radius))
        self._runner = Runner(Turns(position, bearing(position, here), radius, turns, pace), pace, speed)
        self._stage = _Stage.CURVE

    def _spline(self, item: MissionItem, start: Vector, along: Vector, target: Vector, speed: float) -> None:
        """Flies the smooth curve from `start`, left in the direction `along`, to `target` [m]."""
        context, route = self._context, self._route
        following = route.next_position(item.seq + 1, target) if passes_through(item) else None
        arrive, exit_speed = _STANDING, 0.0
        pace = route.pace()
        if following is not None:
            after = route.next_nav(item.seq + 1)
            is_spline = after is not None and after.command == Command.SPLINE_WAYPOINT
            arrive = between(start if is_spline else target, following)
            out = between(target, following)
            exit_speed = min(pace.cruise, (pace.accel * hypot(out[0], out[1])) ** 0.5)
            if after is not None and is_spline:
                exit_speed = min(exit_speed, self._entry_speed(after, target, arrive, following))
        points = spline(start, along, target, arrive)
        here = context.state.estimate.pos_ned
        if along != _STANDING:
            ahead = between(here, start)
            if ahead[0] * along[0] + ahead[1] * along[1] > 0.0 and hypot(ahead[0], ahead[1]) > 0.5:
                points.insert(0, here)  # the waypoint before counted as reached a little early
        points = distinct(points)
        if len(points) < 2:
            self._is_done = True
            return
        self._exit_speed = exit_speed
        self._runner = Runner(Polyline(points, pace, exit_speed), pace, speed)
        self._along = arrive
        self._stage = _Stage.CURVE

    def _entry_speed(self, item: MissionItem, start: Vector, along: Vector, target: Vector) -> float:
        """Speed [m/s] at which the spline of the next item may be entered."""
        route = self._route
        following = route.next_position(item.seq + 1, target) if passes_through(item) else None
        arrive = _STANDING if following is None else between(start, following)
        pace = route.pace()
        points = distinct(spline(start, along, target, arrive))
        return Polyline(points, pace, pace.cruise if following else 0.0).top_speed(0.0) if len(points) > 1 else 0.0

    def _run_curve(self) -> None:
        item, runner, context = self._item, self._runner, self._context
        if item is None or runner is None:
            return
        here = context.state.estimate.pos_ned
        position, vel = runner.step(here)
        if runner.is_at_end:
            if self._exit_speed > 0.0:
                self._is_done = True
            else:
                self._end_curve(item, position, here)
            return
        yaw = self.yaw
        if item.command == Command.LOITER_TURNS:
            yaw = bearing(position, self._route.position_of(item))
        elif not context.heading.is_item_yaw and hypot(vel[0], vel[1]) > 0.1:
            yaw = bearing(_STANDING, vel)
        self.yaw = context.leg_yaw = yaw
        context.setpoint.track(position, vel, yaw)

    def _end_curve(self, item: MissionItem, position: Vector, here: Vector) -> None:
        """The moving point has come to rest: waits for the vehicle."""
        context = self._context
        self._along = _STANDING
        if self.target != position:
            self.target = self._goal = position
            context.fly_to(position, self.yaw)
        north, east = here[0] - position[0], here[1] - position[1]
        if north * north + east * east < max(self._radius_sq, 0.25) and abs(here[2] - position[2]) < self._alt_radius:
            if item.command != Command.LOITER_TURNS and hold_time_s(item) > 0.0:
                self._wait(hold_time_s(item))
            else:
                self._is_done = True
