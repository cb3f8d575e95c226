"""Mission: flies the stored items one after the other.

In: items, checked when they were loaded. Out: setpoints, the current item, each item reached once. Items that take no
time (speed, jump, home) are done in the frame in which they become current.
"""

from collections.abc import Callable, Sequence
from enum import IntEnum
from math import hypot, inf, isfinite, nan, radians, sqrt

from autopilot.navigator.context import NavContext
from autopilot.navigator.items import (
    MAX_ITEMS,
    NAV_COMMANDS,
    RELATIVE_FRAMES,
    Command,
    hold_time_s,
    is_here,
    refuse_items,
    warning_of,
)
from autopilot.navigator.land import Landing
from autopilot.navigator.setpoint import Vector
from autopilot.navigator.takeoff import Climb
from autopilot.vehicle import ItemRefusal, MissionItem, Mode, Reply, Severity, Verdict

CORNER_ACCEL_SHARE = 0.5  # of MPC_ACC_HOR, used to turn from one leg to the next; the rest keeps to the line: guess
_SLOWEST_CORNER_M_S = 0.5  # slower than this it is simpler to stop


class MissionState(IntEnum):
    """Numbered as MISSION_STATE."""

    UNKNOWN = 0
    NO_MISSION = 1
    NOT_STARTED = 2
    ACTIVE = 3
    PAUSED = 4
    COMPLETE = 5


class _Stage(IntEnum):
    IDLE = 0
    CLIMB = 1
    TRAVEL = 2
    WAIT = 3  # until a time
    STAY = 4  # for ever
    LAND = 5


class Mission:
    """Mode Mission and the stored mission.

    Args:
        context: what the navigator's modes share.
        set_home: sets home to latitude [deg], longitude [deg], altitude above sea level [m]; all NaN: here.
    """

    capacity = MAX_ITEMS

    def __init__(self, context: NavContext, set_home: Callable[[float, float, float], Reply]) -> None:
        self.items: tuple[MissionItem, ...] = ()
        self._context = context
        self._set_home = set_home
        self._climb = Climb(context)
        self._landing = Landing(context)
        self._stage = _Stage.IDLE
        self._index = 0
        self._jumps_left: dict[int, int] = {}
        self._target: Vector | None = None  # [m] place of the present leg or stay
        self._yaw = 0.0
        self._radius_sq = 0.0  # [m²] in which the place counts as reached
        self._alt_radius = 0.0  # [m]
        self._until_us = 0
        context.state.mission_state = MissionState.NO_MISSION

    # ---- what clients ask for ----

    def load(self, items: Sequence[MissionItem]) -> ItemRefusal | None:
        """Replaces the mission, or keeps the old one and says why."""
        refusal = refuse_items(items)
        if refusal is not None:
            return refusal
        state = self._context.state
        self.items = tuple(items)
        warning = warning_of(items)
        if warning:
            self._context.announcer.statustext(Severity.WARNING, f"Mission: {warning}")
        self._index = 0
        self._stage = _Stage.IDLE
        self._jumps_left.clear()
        state.mission_count = len(self.items)
        is_flying_it = state.mission_state == MissionState.ACTIVE and state.is_armed and state.mode is Mode.MISSION
        state.mission_state = MissionState.NOT_STARTED if self.items else MissionState.NO_MISSION
        self._announce_current(0)
        if is_flying_it:
            if self.items:
                self.start()
            else:
                self._context.announcer.statustext(Severity.WARNING, "Mission cleared in flight: holding")
                self._context.wish = Mode.HOLD
        return None

    def set_current(self, seq: int) -> Reply:
        """Makes an item the current one; flies to it at once in mode Mission."""
        if not 0 <= seq < len(self.items):
            return Reply(Verdict.DENIED, f"there is no item {seq}")
        state = self._context.state
        if seq == 0:
            self._jumps_left.clear()
        self._index = seq
        if state.mission_state == MissionState.COMPLETE:
            state.mission_state = MissionState.NOT_STARTED
        self._announce_current(seq)
        if state.mission_state == MissionState.ACTIVE and state.is_armed:
            self._begin(seq)
        return Reply(Verdict.ACCEPTED)

    def refusal(self) -> str:
        """Why the mission cannot be flown now; empty if it can."""
        if not self.items:
            return "no mission is loaded"
        longest_m = self._context.number("MIS_DIST_1WP")
        first = next((item for item in self.items if item.command == Command.WAYPOINT), None)
        if first is not None and longest_m >= 0.0:
            here = self._context.state.estimate.pos_ned
            place = self._place_of(first)
            way_m = hypot(place[0] - here[0], place[1] - here[1])
            if way_m > longest_m:
                return f"first waypoint is {way_m / 1000.0:.1f} km away, {longest_m / 1000.0:.1f} km allowed"
        return ""

    # ---- flying ----

    def start(self) -> None:
        """Begins, or goes on at the current item from the present place."""
        state = self._context.state
        if state.mission_state == MissionState.COMPLETE:
            self._index = 0
            self._jumps_left.clear()
        state.mission_state = MissionState.ACTIVE
        self._begin(self._index)

    def leave(self) -> None:
        """Another mode took over."""
        if self._context.state.mission_state == MissionState.ACTIVE:
            self._context.state.mission_state = MissionState.PAUSED
        self._stage = _Stage.IDLE

    def frame(self) -> None:
        stage = self._stage
        context = self._context
        if stage is _Stage.TRAVEL:
            target = self._target
            if target is not None:
                north, east, down = context.state.estimate.pos_ned
                north -= target[0]
                east -= target[1]
                if north * north + east * east < self._radius_sq and abs(down - target[2]) < self._alt_radius:
                    self._arrive()
        elif stage is _Stage.WAIT:
            if context.state.time_us >= self._until_us:
                self._advance()
        elif stage is _Stage.CLIMB:
            if self._climb.frame():
                self._climbed()
        elif stage is _Stage.LAND:
            self._landing.frame()
            if context.is_on_ground:
                self._target = None
                self._advance()

    def _begin(self, index: int, start: Vector | None = None) -> None:
        """Makes `index` current and starts it; `start` is where its leg begins, None: where the vehicle is."""
        for _ in range(len(self.items) + 1):  # a chain longer than that repeats itself
            if index >= len(self.items):
                self._complete()
                return
            self._index = index
            item = self.items[index]
            if item.command in NAV_COMMANDS:
                self._announce_current(index)
                self._begin_nav(item, start)
                return
            following = self._do(item)
            self._context.announcer.mission_item_reached(index)
            if following >= len(self.items):
                self._announce_current(index)
            index = following
        self._context.announcer.statustext(Severity.ERROR, f"Mission item {self._index} jumps in a circle")
        self._context.state.mission_state = MissionState.PAUSED  # not complete: not every item was done
        self._hold()

    def _begin_nav(self, item: MissionItem, start: Vector | None) -> None:
        context = self._context
        command = item.command
        if start is None:
            self._target = None
        if command == Command.RETURN:
            self._finish()
            context.wish = Mode.HOLD if context.is_on_ground else Mode.RETURN
        elif command == Command.DELAY:
            self._wait(hold_time_s(item))
        elif command == Command.LAND and context.is_on_ground:
            self._wait(0.0)
        elif command == Command.TAKEOFF:
            self._stage = _Stage.CLIMB
            self._climb.start(self._down_of(item), radians(item.params[3]))
        elif context.is_on_ground:
            lowest = context.state.home_ned[2] - context.number("MIS_TAKEOFF_ALT")
            self._stage = _Stage.CLIMB
            self._climb.start(min(self._down_of(item), lowest), nan)
        else:
            self._travel(item, start or context.stop_point())

    def _climbed(self) -> None:
        item = self.items[self._index]
        self._target = self._climb.target_ned
        self._yaw = self._climb.yaw
        if item.command != Command.TAKEOFF or self._is_elsewhere(item):
            self._travel(item, self._target)
        else:
            self._advance()

    def _is_elsewhere(self, item: MissionItem) -> bool:
        if is_here(item) or self._target is None:
            return False
        place = self._place_of(item)
        return hypot(place[0] - self._target[0], place[1] - self._target[1]) > self._context.number("NAV_ACC_RAD")

    def _travel(self, item: MissionItem, start: Vector) -> None:
        """Starts the straight leg from `start` [m] to the item's place."""
        context = self._context
        if item.command == Command.LAND:
            place = start if is_here(item) else self._place_of(item)
            target = (place[0], place[1], start[2])  # a landing goes there at the height it comes from
        else:
            target = self._place_of(item)
        asked = nan if item.command == Command.LOITER_TIME else radians(item.params[3])
        self._target = target
        self._yaw = context.heading_to(start, target, asked)
        acceptance = max(item.params[1], abs(item.params[2])) if item.command == Command.WAYPOINT else 0.0
        radius = acceptance if acceptance > 0.0 else context.number("NAV_ACC_RAD")
        if item.command == Command.LAND:
            radius = min(radius, 1.0)  # the descent begins near the place
        self._radius_sq = radius * radius
        self._alt_radius = context.number("NAV_MC_ALT_RAD")
        self._stage = _Stage.TRAVEL
        context.fly_to(target, self._yaw, start, self._exit_speed(item, start, target, radius))

    def _arrive(self) -> None:
        item = self.items[self._index]
        target = self._target
        if item.command == Command.LAND and target is not None:
            self._stage = _Stage.LAND
            self._landing.start(target[0], target[1], self._yaw)
            self._landing.frame()
        elif item.command == Command.LOITER_UNLIMITED:
            self._stage = _Stage.STAY
        elif item.command in (Command.WAYPOINT, Command.LOITER_TIME) and hold_time_s(item) > 0.0:
            self._wait(hold_time_s(item))
        else:
            self._advance()

    def _wait(self, time_s: float) -> None:
        context = self._context
        self._stage = _Stage.WAIT
        self._until_us = context.state.time_us + int(time_s * 1e6)
        if self._target is None and not context.is_on_ground:
            self._target, self._yaw = context.stop_point(), context.state.yaw_rad
            context.fly_to(self._target, self._yaw)

    def _advance(self) -> None:
        """The current item is done."""
        index = self._index
        context = self._context
        context.announcer.mission_item_reached(index)
        if self.items[index].autocontinue or index + 1 >= len(self.items):
            self._begin(index + 1, self._target)
            return
        self._index = index + 1
        self._announce_current(self._index)
        context.announcer.statustext(Severity.INFO, f"Mission waits after item {index}")
        self._hold()

    def _complete(self) -> None:
        self._finish()
        self._hold()

    def _finish(self) -> None:
        self._context.announcer.statustext(Severity.INFO, "Mission complete")
        self._stage = _Stage.IDLE
        self._context.state.mission_state = MissionState.COMPLETE

    def _hold(self) -> None:
        self._stage = _Stage.IDLE
        if self._target is None or self._context.is_on_ground:
            self._context.wish = Mode.HOLD
        else:
            self._context.hold_next(self._target, self._yaw)

    # ---- items that take no time ----

    def _do(self, item: MissionItem) -> int:
        """Does the item and returns the index of the next."""
        if item.command == Command.JUMP:
            return self._jump(item, self._jumps_left)
        if item.command == Command.CHANGE_SPEED:
            self._change_speed(item)
        elif item.params[0] == 1.0:
            self._set_home(nan, nan, nan)
        else:
            self._set_home(item.x, item.y, item.z)
        return item.seq + 1

    @staticmethod
    def _jump(item: MissionItem, jumps_left: dict[int, int]) -> int:
        repeats = int(item.params[1])
        left = jumps_left.get(item.seq, repeats)
        if left == 0:
            return item.seq + 1
        jumps_left[item.seq] = left - 1 if left > 0 else -1
        return int(item.params[0])

    def _change_speed(self, item: MissionItem) -> None:
        kind, speed = item.params[:2]
        context = self._context
        if speed == -1.0:
            return
        wanted = speed if speed > 0.0 else nan  # -2: back to the default
        if kind == 2.0:
            context.climb_speed = wanted
        elif kind == 3.0:
            context.descend_speed = wanted
        else:
            context.cruise_speed = wanted

    # ---- geometry ----

    def _down_of(self, item: MissionItem) -> float:
        return self._place_of(item)[2]

    def _place_of(self, item: MissionItem) -> Vector:
        """The item's place in the ned frame [m]; the present one where it names none."""
        state = self._context.state
        alt_m = item.z
        if item.frame in RELATIVE_FRAMES:
            alt_m += (state.home or state.origin).alt_m
        if is_here(item):
            north, east, _ = state.estimate.pos_ned
            return north, east, self._context.down_of(alt_m)
        return self._context.pos_ned_of(item.x, item.y, alt_m)

    def _exit_speed(self, item: MissionItem, start: Vector, target: Vector, radius: float) -> float:
        """Speed [m/s] with which a waypoint may be passed so that the turn fits into its acceptance radius.

        A turn by θ that begins at the distance r from the corner has the radius r / tan(θ/2), hence the speed
        sqrt(a r / tan(θ/2)). It is also bounded by what can be braked on the next leg.
        """
        if item.command != Command.WAYPOINT or hold_time_s(item) > 0.0 or not item.autocontinue:
            return 0.0
        following = self._next_place(item.seq + 1, target)
        if following is None:
            return 0.0
        in_north, in_east = target[0] - start[0], target[1] - start[1]
        out_north, out_east = following[0] - target[0], following[1] - target[1]
        in_length = hypot(in_north, in_east)
        out_length = hypot(out_north, out_east)
        if in_length < max(0.5, abs(target[2] - start[2])) or out_length < max(0.5, abs(following[2] - target[2])):
            return 0.0  # a steep or very short leg
        context = self._context
        accel = CORNER_ACCEL_SHARE * context.number("MPC_ACC_HOR")
        cosine = (in_north * out_north + in_east * out_east) / (in_length * out_length)
        tan_half_sq = (1.0 - cosine) / max(1.0 + cosine, 1e-6)
        corner = sqrt(accel * radius / sqrt(tan_half_sq)) if tan_half_sq > 1e-12 else inf
        cruise = context.cruise_speed if isfinite(context.cruise_speed) else context.number("MPC_XY_CRUISE")
        speed = min(corner, sqrt(accel * out_length), cruise)
        return speed if speed > _SLOWEST_CORNER_M_S else 0.0

    def _next_place(self, index: int, target: Vector) -> Vector | None:
        """Where the flight goes on after the present leg, None if it stops there."""
        jumps_left = dict(self._jumps_left)
        for _ in range(len(self.items)):  # bounds a chain of jumps
            if index >= len(self.items):
                return None
            item = self.items[index]
            if item.command in (Command.WAYPOINT, Command.LOITER_TIME, Command.LOITER_UNLIMITED):
                return self._place_of(item)
            if item.command == Command.LAND and not is_here(item):
                place = self._place_of(item)
                return place[0], place[1], target[2]
            if item.command in NAV_COMMANDS:
                return None
            index = self._jump(item, jumps_left) if item.command == Command.JUMP else index + 1
        return None

    def _announce_current(self, index: int) -> None:
        state = self._context.state
        state.mission_current = index
        self._context.announcer.mission_current_changed(index)
