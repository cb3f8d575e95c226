"""Mission: flies the stored items one after the other.

In: items, checked when they were loaded. Out: the current item, each item reached once; how an item is flown is
`mission_legs`, what is done on the way `mission_actions`, which item follows which `mission_route`.
"""

from collections.abc import Callable, Iterator, Sequence
from enum import IntEnum
from math import hypot

from autopilot.interface.item_lists import ItemRefusal, ListKind, MissionItem, item_name
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Mode, Reply, Severity, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.fence.fence import Fence
from autopilot.navigator.mission.item_checks import refuse_items, warning_of
from autopilot.navigator.mission.item_commands import (
    MAX_ITEMS,
    NAV_COMMANDS,
    PLACED,
    PLACED_OR_HERE,
    Command,
    is_here,
    is_same,
)
from autopilot.navigator.mission.mission_actions import Actions
from autopilot.navigator.mission.mission_legs import Leg
from autopilot.navigator.mission.mission_route import Route
from autopilot.navigator.modes.precision_landing import PrecisionLand
from autopilot.navigator.setpoint import Vector
from autopilot.payload.payloads import Payloads
from common.params import Parameter


class MissionState(IntEnum):
    """Numbered as MISSION_STATE."""

    UNKNOWN = 0
    NO_MISSION = 1
    NOT_STARTED = 2
    ACTIVE = 3
    PAUSED = 4
    COMPLETE = 5


class Mission(FlightMode):
    """Mode Mission and the stored mission.

    Args:
        context: what the navigator's modes share.
        payload: carries out the items that are not the vehicle's own.
        set_home: sets home to latitude [deg], longitude [deg], altitude above sea level [m]; all NaN: here.
    """

    capacity = MAX_ITEMS
    finishes_takeoff = takes_heading = True

    def __init__(
        self, context: NavContext, payload: Payloads, set_home: Callable[[float, float, float], Reply]
    ) -> None:
        self._context = context
        self._payload = payload
        self._route = Route(context)
        self.precision = PrecisionLand(context)
        self._leg: Leg = (context.craft.leg or Leg)(context, self._route, self.precision)
        self._actions = Actions(context, self._route, self._leg, payload, set_home)
        self._index = 0
        self._is_flying = False
        self._is_chosen = False  # the current item was asked for: a restart does not go back behind it
        self._fence: Fence
        self._fence_checked: object = None
        self._fence_problem = ""
        context.state.mission_state = MissionState.NO_MISSION
        context.params.on_change(self._on_parameter)

    @property
    def items(self) -> tuple[MissionItem, ...]:
        return self._route.items

    def connect(self, fence: Fence) -> None:
        """Names the fence that the items keep inside, and switch on and off."""
        self._fence = self._actions.fence = fence

    # ---- what clients ask for ----

    def load(self, items: Sequence[MissionItem]) -> ItemRefusal | None:
        """Replaces the mission, or keeps the old one and says why.

        A mission being flown goes on where it is if the current item is the same in the new one, else from the
        beginning.
        """
        refusal = refuse_items(items, self._payload.takes, leaves_ground=self._context.craft.ground is not None)
        if refusal is not None:
            return refusal
        state = self._context.state
        index, old = self._index, self.items
        was_begun = state.mission_state in (MissionState.ACTIVE, MissionState.PAUSED) and state.is_armed
        is_same_item = was_begun and index < min(len(old), len(items)) and is_same(old[index], items[index])
        is_flying_it = state.mission_state == MissionState.ACTIVE and state.is_armed and state.mode is Mode.MISSION
        self._route.load(items, keep_jumps=is_same_item)
        warning = warning_of(items)
        if warning:
            self._context.announcer.statustext(Severity.WARNING, f"Mission: {warning}")
        state.mission_count = len(items)
        if is_same_item:
            self._announce_current(index)
            self._leg.renew_speeds()
            return None
        self._index = 0
        self._is_flying = False
        self._actions.clear()
        self._leg.forget()
        state.mission_state = MissionState.NOT_STARTED if items else MissionState.NO_MISSION
        self._announce_current(0)
        if is_flying_it:
            self._fly_new_mission()
        return None

    def _fly_new_mission(self) -> None:
        if self.items:
            self.start()
        else:
            self._context.announcer.statustext(Severity.WARNING, "Mission cleared in flight: holding")
            self._context.wish = Mode.HOLD

    def set_current(self, seq: int, *, is_reset: bool = False) -> Reply:
        """Makes an item the current one; flies to it at once in mode Mission.

        Args:
            seq: the item's number.
            is_reset: every jump counts from the beginning again, and a complete mission may be flown again.
        """
        if not 0 <= seq < len(self.items):
            return Reply(Verdict.DENIED, f"there is no {item_name(seq)}")
        state = self._context.state
        if seq == 0 or is_reset:
            self._route.restart()
        self._index = seq
        self._is_chosen = True
        self._leg.forget()
        if state.mission_state == MissionState.COMPLETE:
            state.mission_state = MissionState.NOT_STARTED
        self._announce_current(seq)
        if state.mission_state == MissionState.ACTIVE and state.is_armed:
            self._begin(seq, is_joined=False)
        return ACCEPTED

    def end_after(self, last: int) -> Reply:
        """The mission ends after an item, until it is restarted."""
        if not self._index <= last < len(self.items):
            return Reply(Verdict.DENIED, f"the mission cannot end at {item_name(last)}")
        self._route.end = last + 1
        return ACCEPTED

    def resume(self) -> None:
        """The next start goes on at the current item, whatever MIS_RESTART says."""
        self._is_chosen = True

    @property
    def is_begun(self) -> bool:
        """Whether it has been flown, at least in part."""
        state = self._context.state.mission_state
        return state in (MissionState.ACTIVE, MissionState.PAUSED, MissionState.COMPLETE)

    def position_after(self, first: int) -> Vector:
        """The position [m] of the first item from `first` on that has one; the present one if none has."""
        north, east, down = self._context.state.estimate.pos_ned
        return next((position for seq, position in self.positions() if seq >= first), (north, east, down))

    def landing_sequence(self) -> int | None:
        """Number of the nearest DO_LAND_START."""
        return self._route.nearest_after_marker(Command.LAND_START)

    def return_path(self) -> int | None:
        """Number of the item at the end of the nearest leg after DO_RETURN_PATH_START."""
        return self._route.nearest_leg_after(Command.RETURN_PATH_START)

    def renew_speeds(self) -> None:
        """A speed has been changed: the leg being flown is asked for anew."""
        if self._is_flying:
            self._leg.renew_speeds()

    def refusal(self) -> str:
        """Why the mission cannot be flown now; empty if it can."""
        if not self.items:
            return "no mission is loaded"
        return self._lacks() or self._too_far() or self._outside_fence()

    def _lacks(self) -> str:
        """What MIS_TKO_LAND_REQ asks for and the mission has not."""
        asked = int(self._context.number("MIS_TKO_LAND_REQ"))
        has_takeoff = any(item.command == Command.TAKEOFF for item in self.items)
        has_landing = any(item.command in (Command.LAND, Command.RETURN) for item in self.items)
        if not has_takeoff and (asked in (1, 3) or (asked == 4 and has_landing)):
            return "the mission has no take-off (MIS_TKO_LAND_REQ)"
        if not has_landing and (asked in (2, 3) or (asked == 4 and has_takeoff)):
            return "the mission has no landing (MIS_TKO_LAND_REQ)"
        return ""

    def _too_far(self) -> str:
        longest_m = self._context.number("MIS_DIST_1WP")
        first = next((item for item in self.items if item.command == Command.WAYPOINT), None)
        if first is not None and longest_m >= 0.0:
            here = self._context.state.estimate.pos_ned
            position = self._route.position_of(first)
            way_m = hypot(position[0] - here[0], position[1] - here[1])
            if way_m > longest_m:
                return f"first waypoint is {way_m / 1000.0:.1f} km away, {longest_m / 1000.0:.1f} km allowed"
        return ""

    def _outside_fence(self) -> str:
        """The first item that lies outside the fence; looked for again when either has changed."""
        fence = self._fence
        if not fence.is_active:
            return ""
        checked = (self.items, fence.version, self._context.state.home_ned)
        if checked != self._fence_checked:
            self._fence_checked = checked
            self._fence_problem = ""
            for seq, position in self.positions():
                reason = fence.refusal(position)
                if reason:
                    self._fence_problem = f"{item_name(seq)} is {reason}"
                    break
        return self._fence_problem

    def warn_of_fence(self, _: ListKind) -> None:
        """Says at once that a mission just loaded leaves the fence, or a fence just loaded excludes the mission."""
        problem = self._outside_fence()
        if problem:
            self._context.announcer.statustext(Severity.WARNING, f"Mission: {problem}")

    def positions(self) -> Iterator[tuple[int, Vector]]:
        """Number and place [m] of every item that the vehicle flies to."""
        for item in self.items:
            if item.command in PLACED | PLACED_OR_HERE and not is_here(item):
                position = self._route.position_of(item)
                home = self._context.state.home_ned
                yield item.seq, (position[0], position[1], home[2]) if item.command == Command.LAND else position

    # ---- flying ----

    @property
    def is_flying(self) -> bool:
        """Whether an item is being flown."""
        return self._is_flying

    def start(self) -> None:
        """Begins, or goes on at the current item from the present position."""
        state = self._context.state
        is_over = state.mission_state == MissionState.COMPLETE
        if is_over or (int(self._context.number("MIS_RESTART")) and not self._is_chosen):
            self._index = 0
            self._leg.forget()
            self._route.restart()
        self._is_chosen = False
        state.mission_state = MissionState.ACTIVE
        self._begin(self._index, is_joined=False)

    def goes_away(self) -> bool:
        return not self._context.is_on_ground  # from there it takes off by itself

    def leave(self, following: Mode) -> None:
        if following is Mode.MISSION:
            return
        if self._context.state.mission_state == MissionState.ACTIVE:
            self._context.state.mission_state = MissionState.PAUSED
        self._is_flying = False
        self._actions.clear()
        self._leg.stop()

    def go_around(self, height_m: float) -> Reply:
        return self._leg.go_around(height_m) if self._is_flying else super().go_around(height_m)

    def frame(self) -> None:
        if not self._is_flying:
            return
        if self._leg.frame():
            self._advance()
        elif self._actions.is_waiting:
            self._actions.frame()

    def _begin(self, index: int, *, is_joined: bool) -> None:
        """Makes `index` current and starts it; joined: from the position of the item before."""
        context = self._context
        context.heading.end_turn()
        self._is_flying = False
        if not is_joined:
            self._face_as_planned(index)
        for _ in range(len(self.items) + 1):  # a chain longer than that repeats itself
            if index >= self._route.end:
                self._complete()
                return
            self._index = index
            item = self.items[index]
            if item.command in NAV_COMMANDS:
                self._announce_current(index)
                self._begin_nav(item, is_joined=is_joined)
                return
            following = self._route.after(item)
            self._actions.add(item)
            if following >= self._route.end:
                self._announce_current(index)
            index = following
        context.announcer.statustext(Severity.ERROR, f"Mission {item_name(self._index)} jumps in a circle")
        context.state.mission_state = MissionState.PAUSED  # not complete: not every item was done
        self._hold()

    def _face_as_planned(self, index: int) -> None:
        """Whoever joins a plan drives as the last DO_SET_REVERSE before says: backwards, or not."""
        said = [item.params[0] for item in self.items[:index] if item.command == Command.SET_REVERSE]
        if said:
            self._context.setpoint.set_reversed(is_reversed=said[-1] == 1.0)

    def _begin_nav(self, item: MissionItem, *, is_joined: bool) -> None:
        context = self._context
        if item.command == Command.RETURN:
            self._finish()
            context.wish = Mode.HOLD if context.is_on_ground else Mode.RETURN
            return
        self._is_flying = True
        self._leg.begin(item, is_joined=is_joined)

    def _advance(self) -> None:
        """The current item is done."""
        index = self._index
        context = self._context
        context.announcer.mission_item_reached(index)
        self._actions.drop()
        if self.items[index].autocontinue or index + 1 >= self._route.end:
            self._begin(index + 1, is_joined=True)
            return
        self._index = index + 1
        self._announce_current(self._index)
        context.announcer.statustext(Severity.INFO, f"Mission waits after {item_name(index)}")
        self._hold()

    def _complete(self) -> None:
        self._finish()
        self._hold()

    def _finish(self) -> None:
        self._actions.drop()
        self._context.announcer.statustext(Severity.INFO, "Mission complete")
        self._is_flying = False
        self._context.state.mission_state = MissionState.COMPLETE

    def _hold(self) -> None:
        self._is_flying = False
        target = self._leg.target
        if target is None or self._context.is_on_ground:
            self._context.wish = Mode.HOLD
        else:
            self._context.hold_next(target, self._leg.yaw)

    def _announce_current(self, index: int) -> None:
        state = self._context.state
        state.mission_current = index
        self._context.announcer.mission_current_changed(index)

    def _on_parameter(self, parameter: Parameter) -> None:
        limits = self._context.craft.limits
        vertical = limits.vertical
        climbing = () if vertical is None else (vertical.climb_speed, vertical.descend_speed)
        if parameter.name in (limits.cruise_speed, limits.speed_max, *climbing):
            self.renew_speeds()
