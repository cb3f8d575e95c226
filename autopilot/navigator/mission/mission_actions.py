"""Items that take no time, and the conditions that delay them.

They are done when the item before them is done, on the way to the next flown item. A condition delays what follows it,
not the flight; what is still delayed when that item is done is left out, with a text (ArduPilot's rule).
"""

from collections import deque
from collections.abc import Callable
from math import isfinite, nan, radians

from autopilot.interface.item_lists import MissionItem, item_name
from autopilot.interface.vehicle_interface import FenceSwitch
from autopilot.interface.vehicle_state import FenceLimit, Reply, Severity, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.mission.item_commands import CONDITIONS, RELATIVE_FRAMES, ROI_AS_ASKED, Command, is_here
from autopilot.navigator.mission.mission_legs import Leg
from autopilot.navigator.mission.mission_route import Route
from autopilot.navigator.setpoint import Vector
from autopilot.payload.payloads import Payloads

_ROI_NEXT = 1.0  # MAV_ROI_WPNEXT
_ROI_COMMANDS = ROI_AS_ASKED | {Command.ROI_LOCATION, Command.ROI_NEXT_OFFSET, Command.ROI_NONE}


class Actions:
    """What is done on the way to the item being flown.

    Args:
        context: what the navigator's modes share.
        route: the order of the items.
        leg: what is being flown.
        payload: carries out what is not the vehicle's own.
        set_home: sets home to latitude [deg], longitude [deg], altitude above sea level [m]; all NaN: here.
    """

    def __init__(
        self,
        context: NavContext,
        route: Route,
        leg: Leg,
        payload: Payloads,
        set_home: Callable[[float, float, float], Reply],
    ) -> None:
        self._context = context
        self._route = route
        self._leg = leg
        self._payload = payload
        self._set_home = set_home
        self._delayed: deque[MissionItem] = deque()  # a condition first; at most one mission long
        self._until_us = 0
        self.fence: FenceSwitch | None = None

    @property
    def is_waiting(self) -> bool:
        """Whether something is still delayed."""
        return bool(self._delayed)

    def add(self, item: MissionItem) -> None:
        """Does the item, or keeps it for later if a condition comes first."""
        if self._delayed:
            self._delayed.append(item)
        elif item.command in CONDITIONS:
            self._delayed.append(item)
            self._begin_condition(item)
        else:
            self._do(item)
            self._context.announcer.mission_item_reached(item.seq)

    def drop(self) -> None:
        """The item they belonged to is done: what is still delayed is left out."""
        if self._delayed:
            condition = self._delayed[0].seq
            count = len(self._delayed) - 1
            if count:
                text = f"Mission {item_name(condition)} did not come true: {count} more left out"
                self._context.announcer.statustext(Severity.NOTICE, text)
            self._delayed.clear()

    def clear(self) -> None:
        """Forgets what is delayed."""
        self._delayed.clear()

    def frame(self) -> None:
        """Goes on with what was delayed, once its condition is true."""
        while self._delayed:
            item = self._delayed[0]
            if item.command in CONDITIONS:
                if not self._is_true(item):
                    return
            else:
                self._do(item)
            self._context.announcer.mission_item_reached(item.seq)
            self._delayed.popleft()
            if self._delayed and self._delayed[0].command in CONDITIONS:
                self._begin_condition(self._delayed[0])

    # ---- conditions ----

    def _begin_condition(self, item: MissionItem) -> None:
        context = self._context
        if item.command == Command.CONDITION_DELAY:
            self._until_us = context.state.time_us + int(item.params[0] * 1e6)
        elif item.command == Command.CONDITION_YAW:
            angle, rate, direction, is_relative = item.params
            context.heading.turn(angle, rate, direction, is_relative=is_relative == 1.0)

    def _is_true(self, item: MissionItem) -> bool:
        context = self._context
        if item.command == Command.CONDITION_DELAY:
            return context.state.time_us >= self._until_us
        if item.command == Command.CONDITION_DISTANCE:
            return self._leg.target is not None and self._leg.distance_left() < item.params[0]
        if item.command == Command.CONDITION_YAW:
            return not context.heading.is_turning
        return self._is_through(item)

    def _is_through(self, item: MissionItem) -> bool:
        """Whether the vehicle is beyond the plane through the gate, across the way from it to the next position."""
        target = self._leg.target
        if target is None:
            return False
        gate = self._route.position_of(item)
        here = self._context.state.estimate.pos_ned
        north, east = target[0] - gate[0], target[1] - gate[1]
        return bool((here[0] - gate[0]) * north + (here[1] - gate[1]) * east >= 0.0)

    # ---- what is done ----

    def _do(self, item: MissionItem) -> None:
        command = item.command
        if command == Command.CHANGE_SPEED:
            self._change_speed(item)
        elif command == Command.SET_HOME:
            if item.params[0] == 1.0:
                self._set_home(nan, nan, nan)
            else:
                self._set_home(item.x, item.y, item.z)
        elif command == Command.SET_REVERSE:
            self._context.setpoint.set_reversed(is_reversed=item.params[0] == 1.0)
        elif command == Command.FENCE_ENABLE and self.fence is not None:
            self._switch_fence(item, self.fence)
        elif command in _ROI_COMMANDS:
            self._look(item)
        elif self._payload.takes(command):
            self._pay(item)

    def _switch_fence(self, item: MissionItem, fence: FenceSwitch) -> None:
        switch, limits = item.params[:2]
        asked = int(limits) if limits > 0.0 else int(sum(FenceLimit))
        if switch == 1.0:
            reply = fence.enable(asked)
        else:
            reply = fence.disable(asked if switch == 0.0 else FenceLimit.FLOOR)
        self._tell(item, reply)

    def _pay(self, item: MissionItem) -> None:
        """Hands the item to the payload; a mission goes on if that cannot do it."""
        # parameter 7 is an altitude where there is a position; plans give other items a frame all the same
        z = self._alt_amsl_m(item) if item.command in _ROI_COMMANDS else item.z
        reply = self._payload.run(item.command, item.params, item.x, item.y, z)
        self._tell(item, reply)

    def _tell(self, item: MissionItem, reply: Reply) -> None:
        """Says why an item could not be carried out."""
        if reply.verdict not in (Verdict.ACCEPTED, Verdict.IN_PROGRESS):
            text = f"Mission {item_name(item.seq)}: {reply.reason or reply.verdict.name.lower()}"
            self._context.announcer.statustext(Severity.WARNING, text)

    def _alt_amsl_m(self, item: MissionItem) -> float:
        if item.frame in RELATIVE_FRAMES:
            state = self._context.state
            return item.z + (state.home or state.origin).alt_m
        return item.z

    def _change_speed(self, item: MissionItem) -> None:
        kind, speed = item.params[:2]
        context = self._context
        if speed == -1.0:
            return
        context.set_speed(int(kind), speed if speed > 0.0 else nan)  # -2: back to the default
        self._leg.renew_speeds()

    def _look(self, item: MissionItem) -> None:
        heading = self._context.heading
        has_position = item.command in ROI_AS_ASKED | {Command.ROI_LOCATION} and not is_here(item)
        if item.command in ROI_AS_ASKED and item.params[0] == _ROI_NEXT:
            heading.look_ahead()
        elif has_position:
            position: Vector = self._route.position_of(item)
            heading.look_at(position)
        else:
            offset_deg = item.z if item.command == Command.ROI_NEXT_OFFSET else 0.0
            heading.look_ahead(radians(offset_deg) if isfinite(offset_deg) else 0.0)
        if self._payload.takes(item.command):
            self._pay(item)
