"""The order of a mission's items, jumps included, and the places they name.

In: the stored items. Out: which item follows which, where the flight goes on, how fast a waypoint may be passed.
"""

from collections.abc import Sequence
from math import hypot, inf, isfinite, sqrt

from autopilot.interface.item_lists import MissionItem
from autopilot.navigator.context import NavContext
from autopilot.navigator.mission.item_checks import tagged_item
from autopilot.navigator.mission.item_commands import (
    NAV_COMMANDS,
    PLACED,
    RELATIVE_FRAMES,
    Command,
    is_here,
    passes_through,
)
from autopilot.navigator.paths.spline import Pace, between
from autopilot.navigator.setpoint import Vector
from autopilot.vehicles.planned_limits import planned_accel, planned_jerk

CORNER_ACCEL_FRACTION = (
    0.5  # of `limits.accel_hor`, used to turn from one leg to the next; the rest keeps to the line: guess
)
_SLOWEST_CORNER_M_S = 0.5  # slower than this it is simpler to stop


class Route:
    """The stored mission as a way."""

    def __init__(self, context: NavContext) -> None:
        self.items: tuple[MissionItem, ...] = ()
        self.end = 0  # number of the item after which nothing is flown
        self._context = context
        self._jumps_left: dict[int, int] = {}

    def load(self, items: Sequence[MissionItem], *, keep_jumps: bool) -> None:
        self.items = tuple(items)
        self.end = len(self.items)
        if not keep_jumps:
            self._jumps_left.clear()

    def restart(self) -> None:
        """Every jump counts from the beginning again."""
        self._jumps_left.clear()
        self.end = len(self.items)

    def after(self, item: MissionItem) -> int:
        """Number of the item that follows; a jump is counted."""
        return self._after(item, self._jumps_left)

    def next_nav(self, index: int) -> MissionItem | None:
        """The next item that is flown, from `index` on, as the jumps stand now; None: the mission ends before."""
        jumps_left = dict(self._jumps_left)
        for _ in range(len(self.items)):  # bounds a chain of jumps
            if index >= self.end:
                return None
            item = self.items[index]
            if item.command in NAV_COMMANDS:
                return item
            index = self._after(item, jumps_left)
        return None

    def _after(self, item: MissionItem, jumps_left: dict[int, int]) -> int:
        if item.command not in (Command.JUMP, Command.JUMP_TO_TAG):
            return item.seq + 1
        left = jumps_left.get(item.seq, int(item.params[1]))
        if left == 0:
            return item.seq + 1
        jumps_left[item.seq] = left - 1 if left > 0 else -1
        target = item.params[0] if item.command == Command.JUMP else tagged_item(self.items, item.params[0])
        return item.seq + 1 if target is None else int(target)

    def nearest_after_marker(self, marker: Command) -> int | None:
        """Number of the item after the nearest marker (DO_LAND_START), or the marker's if it names no position."""
        here = self._context.state.estimate.pos_ned
        best, best_m = None, inf
        for item in self.items:
            if item.command != marker:
                continue
            first = item if not is_here(item) else self._first_placed(item.seq)
            position = here if first is None else self.position_of(first)
            way_m = hypot(position[0] - here[0], position[1] - here[1])
            if way_m < best_m:
                best, best_m = item.seq, way_m
        return best

    def nearest_leg_after(self, marker: Command) -> int | None:
        """Number of the item at the end of the nearest leg behind a marker (DO_RETURN_PATH_START)."""
        begin = next((item.seq for item in self.items if item.command == marker), None)
        if begin is None:
            return None
        here = self._context.state.estimate.pos_ned
        best, best_m, before = None, inf, None
        for item in self.items[begin:]:
            if item.command not in PLACED and not (item.command == Command.LAND and not is_here(item)):
                continue
            position = self.position_of(item)
            way_m = distance_to_line(here, before or position, position)
            if way_m < best_m:
                best, best_m = item.seq, way_m
            before = position
        return best

    def _first_placed(self, index: int) -> MissionItem | None:
        return next((item for item in self.items[index:] if item.command in PLACED), None)

    # ---- places ----

    def position_of(self, item: MissionItem) -> Vector:
        """The item's place in the ned frame [m]; the present one where it names none."""
        state = self._context.state
        alt_m = item.z
        if item.frame in RELATIVE_FRAMES:
            alt_m += (state.home or state.origin).alt_m
        if is_here(item):
            north, east, _ = state.estimate.pos_ned
            return north, east, self._context.down_of(alt_m)
        return self._context.pos_ned_of(item.x, item.y, alt_m)

    def next_position(self, index: int, position: Vector) -> Vector | None:
        """Where the flight goes on from `position` [m], None if it stops there."""
        item = self.next_nav(index)
        if item is None:
            return None
        if item.command in PLACED and item.command != Command.LOITER_TURNS:  # a circle is entered sideways
            target = self.position_of(item)
            return (target[0], target[1], position[2]) if item.command == Command.LOITER_TO_ALT else target
        if item.command == Command.LAND and not is_here(item):
            target = self.position_of(item)
            return target[0], target[1], position[2]
        return None

    # ---- speeds ----

    def pace(self) -> Pace:
        """How fast curves may be flown now."""
        context = self._context
        number = context.number
        limits = context.craft.limits
        cruise = context.cruise_speed if isfinite(context.cruise_speed) else number(limits.cruise_speed)
        climb = descend = cruise
        vertical = limits.vertical
        if vertical is not None:
            climb = context.climb_speed if isfinite(context.climb_speed) else number(vertical.climb_speed)
            descend = context.descend_speed if isfinite(context.descend_speed) else number(vertical.descend_speed)
            climb = min(climb, number(vertical.climb_max))
            descend = min(descend, number(vertical.descend_max))
        return Pace(
            min(cruise, number(limits.speed_max)),
            climb,
            descend,
            corner_accel(context),
            planned_jerk(number(limits.jerk_auto)),
            number(limits.path_error),
        )

    def passage(self, item: MissionItem, start: Vector, target: Vector, radius: float) -> tuple[float, float]:
        """Speed [m/s] with which a waypoint may be passed, and how far before it [m] the turn begins.

        It fits into the waypoint's acceptance radius, but for a vehicle whose smallest circle does not: that begins
        earlier, as far as its parameters allow.

        A turn by θ that begins at the distance r from the corner has the radius r / tan(θ/2), hence the speed
        sqrt(a r / tan(θ/2)). It is also bounded by what can be braked on the next leg. A spline leaves a waypoint in
        the direction in which it was reached: there is no corner.
        """
        following = self.next_position(item.seq + 1, target) if passes_through(item) else None
        if following is None:
            return 0.0, radius
        into, out = between(start, target), between(target, following)
        in_length, out_length = hypot(into[0], into[1]), hypot(out[0], out[1])
        if in_length < max(0.5, abs(into[2])) or out_length < max(0.5, abs(out[2])):
            return 0.0, radius  # a steep or very short leg
        pace = self.pace()
        corner = inf
        after = self.next_nav(item.seq + 1)
        if after is None or after.command != Command.SPLINE_WAYPOINT:
            cosine = (into[0] * out[0] + into[1] * out[1]) / (in_length * out_length)
            tan_half_sq = (1.0 - cosine) / max(1.0 + cosine, 1e-6)
            if tan_half_sq > 1e-12:
                radius = turn_begin(self._context, sqrt(tan_half_sq), radius)
                corner = sqrt(pace.accel * radius / sqrt(tan_half_sq))
        speed = min(corner, sqrt(pace.accel * out_length), pace.cruise)
        return speed if speed > _SLOWEST_CORNER_M_S else 0.0, radius


def corner_accel(context: NavContext) -> float:
    """Acceleration [m/s²] used to turn from one leg to the next."""
    limits = context.craft.limits
    if limits.accel_across:
        return context.number(limits.accel_across)
    return CORNER_ACCEL_FRACTION * planned_accel(context.number(limits.accel_hor))


def turn_begin(context: NavContext, tan_half: float, radius: float) -> float:
    """How far before a corner [m] a turn begins that shall begin `radius` before it, if the vehicle can turn so."""
    turning = context.craft.limits.turning
    if turning is None or context.number(turning.largest) < 0.0:
        return radius
    needed = context.number(turning.gain) * turning.radius(context.number) * tan_half
    return max(radius, min(needed, context.number(turning.largest)))


def distance_to_line(here: Vector, start: Vector, end: Vector) -> float:
    """Horizontal distance [m] to the straight way between two places."""
    north, east = end[0] - start[0], end[1] - start[1]
    length_sq = north * north + east * east
    fraction = 0.0
    if length_sq > 0.0:
        fraction = ((here[0] - start[0]) * north + (here[1] - start[1]) * east) / length_sq
        fraction = min(max(fraction, 0.0), 1.0)
    return hypot(here[0] - start[0] - fraction * north, here[1] - start[1] - fraction * east)
