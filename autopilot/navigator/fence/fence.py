"""The geofence: shapes that clients upload and limits around home, watched in every frame.

In: the fence as uploaded, its parameters, where the vehicle is. Out: which limits are breached (`VehicleState.fence`),
and whether a position may be flown to. What a breach leads to is the commander's to say (GF_ACTION).
"""

from collections.abc import Sequence
from math import hypot, inf

from autopilot.interface.item_lists import ItemRefusal, MissionItem
from autopilot.interface.vehicle_state import ACCEPTED, FenceLimit, LandedState, Reply, Severity
from autopilot.navigator.context import NavContext
from autopilot.navigator.fence.fence_items import MAX_FENCE_ITEMS, FenceCommand, fence_shapes
from autopilot.navigator.fence.fence_region import Region, region_of
from autopilot.navigator.paths.fence_detour import Bounds, detour
from autopilot.navigator.setpoint import Vector
from autopilot.ports import HEIGHT_VALID, POSITION_VALID
from common.params import Parameter

ALL_LIMITS = int(FenceLimit.CEILING | FenceLimit.RADIUS | FenceLimit.SHAPES | FenceLimit.FLOOR)
_CEILING, _RADIUS, _SHAPES, _FLOOR = map(int, FenceLimit)  # plain numbers: this runs in every frame
_ANYWHERE = Region((), ())
_HYSTERESIS_M = 0.5  # further inside than this a breach is over; guess
_FIX_3D = 3
_SOURCE_GNSS = 1  # GF_SOURCE


class Fence:
    """The stored fence and the watch over it.

    Args:
        context: what the navigator's modes share.
    """

    __slots__ = (
        "_at", "_clearance", "_context", "_has_risen", "_limits", "_safe_sq", "_switched_on", "items", "region",
        "version",
    )  # fmt: skip

    capacity = MAX_FENCE_ITEMS

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self.items: tuple[MissionItem, ...] = ()
        self.region = Region((), ())
        self.version = 0  # counts whatever changes where the vehicle may be
        self._switched_on = 0  # limits, by parameter and by command
        self._limits = 0  # that are watched
        self._has_risen = False  # above the floor, since the last take-off
        self._at = (0.0, 0.0)  # where the clearance was last computed
        self._clearance = 0.0
        self._safe_sq = -1.0  # [m²] moves shorter than this change nothing
        context.params.on_change(self._on_parameter)
        context.find_path = self.path
        context.fence_refusal = self.refusal
        context.position_refusal = lambda position: self.refusal(position, is_to_stay=True)
        self._switch_by_parameter()

    # ---- what clients ask for ----

    def load(self, items: Sequence[MissionItem]) -> ItemRefusal | None:
        """Replaces the fence, or keeps the old one and says why."""
        shapes = fence_shapes(items)
        if isinstance(shapes, ItemRefusal):
            return shapes
        self.items = tuple(items)
        self.region = region_of(shapes, self._context.state.origin)
        if any(item.command == FenceCommand.RETURN_POINT for item in items):
            text = "Fence: the return point is kept, but a return goes home or to a rally point"
            self._context.announcer.statustext(Severity.NOTICE, text)
        self._choose_limits()
        return None

    def enable(self, limits: int) -> Reply:
        """Switches limits (FenceLimit) on, until GF_ENABLE is set or the vehicle boots."""
        self._switch(self._switched_on | limits)
        return ACCEPTED

    def disable(self, limits: int) -> Reply:
        """Switches limits off, until GF_ENABLE is set or the vehicle boots."""
        self._switch(self._switched_on & ~limits)
        return ACCEPTED

    # ---- may it be there? ----

    @property
    def is_active(self) -> bool:
        return self._limits != 0

    def refusal(self, position: Vector, *, is_to_stay: bool = False) -> str:
        """Why the vehicle may not go to a position [m]; empty if it may. The floor counts only if it is to stay."""
        limits = self._limits
        if not limits:
            return ""
        breached = limits & self._beyond(position, 0.0)
        if limits & _SHAPES and self.region.clearance(position[0], position[1]) < 0.0:
            breached |= _SHAPES
        height = self._context.state.home_ned[2] - position[2]
        if is_to_stay and limits & _FLOOR and height < self._context.number("GF_MIN_ALT"):
            breached |= _FLOOR
        return f"outside fence: {_names(breached)}" if breached else ""

    def bounds(self) -> Bounds:
        """Where ways may lead that keep inside."""
        limits, number = self._limits, self._context.number
        north, east, _ = self._context.state.home_ned
        return Bounds(
            self.region if limits & _SHAPES else _ANYWHERE,
            number("GF_MARGIN"),
            (north, east),
            number("GF_MAX_HOR_DIST") if limits & _RADIUS else inf,
        )

    def path(self, start: Vector, goal: Vector) -> list[Vector] | None:
        """The points [m] of a way to the goal, at its height, that keeps inside; None if there is none."""
        if not self._limits & _SHAPES:
            return [goal]
        points = detour(self.bounds(), start[:2], goal[:2])
        return None if points is None else [(north, east, goal[2]) for north, east in points]

    def ceiling_d(self) -> float:
        """Down coordinate [m] above which ways do not lead."""
        if not self._limits & _CEILING:
            return -inf
        number = self._context.number
        return self._context.state.home_ned[2] - max(number("GF_MAX_VER_DIST") - number("GF_MARGIN"), 0.0)

    def arming_reason(self) -> str:
        """Why the vehicle may not take off here; empty if it may."""
        context = self._context
        if not self._limits & (_RADIUS | _SHAPES):
            return ""
        if not context.has_position:
            return "fence needs a position"
        north, east, _ = context.state.estimate.pos_ned
        home = context.state.home_ned
        return self.refusal((north, east, home[2]))

    # ---- each frame ----

    def frame(self) -> None:
        """Renews which limits are breached."""
        if not self._limits:
            return
        context = self._context
        state = context.state
        position = self._position()
        needed = context.number("GF_MARGIN") if context.number("GF_PREDICT") else 0.0
        had = state.fence.breached
        estimate = state.estimate
        breached = 0
        if estimate.flags & HEIGHT_VALID and state.home is not None:
            breached = self._beyond(position, needed, had)
            if self._limits & _FLOOR:
                breached |= self._below_floor(position[2], had)
        if not estimate.flags & POSITION_VALID:
            breached = breached & ~(_RADIUS | _SHAPES) | had & (_RADIUS | _SHAPES)
        elif self._limits & _SHAPES and self._is_outside(position, needed, had):
            breached |= _SHAPES
        if breached != had:
            self._tell(breached, had)

    def _position(self) -> Vector:
        """Where to look: where the vehicle is, or with GF_PREDICT where it can stop."""
        context = self._context
        state = context.state
        if context.number("GF_SOURCE") == _SOURCE_GNSS and state.samples.gnss.fix_type >= _FIX_3D:
            north, east, down = state.samples.gnss.pos_ned
            return float(north), float(east), float(down)
        if context.number("GF_PREDICT"):
            return context.stop_point()
        north, east, down = state.estimate.pos_ned
        return north, east, down

    def _is_outside(self, position: Vector, needed: float, had: int) -> bool:
        """Whether a position is outside the shapes, computed anew only if the vehicle may have crossed a border."""
        moved_north, moved_east = position[0] - self._at[0], position[1] - self._at[1]
        if moved_north * moved_north + moved_east * moved_east >= self._safe_sq:
            if had & _SHAPES:
                needed += _HYSTERESIS_M
            self._at = position[:2]
            self._clearance = self.region.clearance(position[0], position[1]) - needed
            self._safe_sq = self._clearance * self._clearance
        return self._clearance < 0.0

    def _beyond(self, position: Vector, needed: float, had: int = 0) -> int:
        """Which of radius and ceiling a position is beyond."""
        limits = self._limits
        if not limits & (_RADIUS | _CEILING):
            return 0
        context = self._context
        north, east, down = context.state.home_ned
        breached = 0
        if limits & _RADIUS:
            longest = context.number("GF_MAX_HOR_DIST") - needed - (_HYSTERESIS_M if had & _RADIUS else 0.0)
            if hypot(position[0] - north, position[1] - east) > longest:
                breached = _RADIUS
        if limits & _CEILING:
            highest = context.number("GF_MAX_VER_DIST") - needed - (_HYSTERESIS_M if had & _CEILING else 0.0)
            if down - position[2] > highest:
                breached |= _CEILING
        return breached

    def _below_floor(self, down: float, had: int) -> int:
        """The floor counts once the vehicle has risen above it, and not on the way down to a landing."""
        context = self._context
        state = context.state
        if state.landed_state is LandedState.ON_GROUND:
            self._has_risen = False
            return 0
        height = state.home_ned[2] - down
        floor = context.number("GF_MIN_ALT")
        if height > floor + _HYSTERESIS_M:
            self._has_risen = True
            return 0
        if not self._has_risen or context.is_landing or context.flown.is_below_floor:
            return 0
        return _FLOOR if height < floor or had & _FLOOR else 0

    def _tell(self, breached: int, had: int) -> None:
        context = self._context
        fence = context.state.fence
        fence.breached = breached
        self._safe_sq = -1.0  # the border counts from the other side now
        new = breached & ~had
        if new:
            fence.last_breach = new
            fence.breach_count += 1
            fence.breach_time_us = context.state.time_us
            word = "close to" if context.number("GF_PREDICT") else "outside"
            context.announcer.statustext(Severity.WARNING, f"Fence: {word} {_names(new)}")
        elif not breached:
            context.announcer.statustext(Severity.INFO, "Fence: no longer breached")

    # ---- what is watched ----

    def _switch_by_parameter(self) -> None:
        self._switch(ALL_LIMITS if self._context.number("GF_ENABLE") else 0)

    def _switch(self, limits: int) -> None:
        self._switched_on = limits
        self._choose_limits()

    def _choose_limits(self) -> None:
        """What is switched on, chosen by the parameters, and there to be breached."""
        number = self._context.number
        limits = self._switched_on & int(number("GF_TYPES"))
        if not number("GF_MAX_HOR_DIST") > 0.0:
            limits &= ~_RADIUS
        if not number("GF_MAX_VER_DIST") > 0.0:
            limits &= ~_CEILING
        if number("GF_MIN_ALT") == 0.0:
            limits &= ~_FLOOR
        if not self.region:
            limits &= ~_SHAPES
        if number("GF_ACTION") == 0.0:
            limits = 0
        self._limits = limits
        self._safe_sq = -1.0
        self.version += 1
        fence = self._context.state.fence
        fence.is_active = limits != 0
        fence.breached &= limits

    def _on_parameter(self, parameter: Parameter) -> None:
        if parameter.name == "GF_ENABLE":
            self._switch_by_parameter()
        elif parameter.name.startswith("GF_"):
            self._choose_limits()


def _names(limits: int) -> str:
    return ", ".join(limit.name.lower() for limit in FenceLimit if limit & limits and limit.name)
