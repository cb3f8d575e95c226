"""Which mission items the navigator flies, checked one by one when a mission is loaded.

Numbers of commands, frames and results are MAVLink's; they are written here so that the navigator needs no MAVLink.
"""

from collections.abc import Callable, Sequence
from enum import IntEnum
from math import isfinite

from autopilot.vehicle import ItemRefusal, MissionItem

MAX_ITEMS = 2_000  # bounds memory and the time of a download


class Command(IntEnum):
    """Numbered as MAV_CMD."""

    WAYPOINT = 16
    LOITER_UNLIMITED = 17
    LOITER_TIME = 19
    RETURN = 20
    LAND = 21
    TAKEOFF = 22
    DELAY = 93
    JUMP = 177
    CHANGE_SPEED = 178
    SET_HOME = 179


class Result(IntEnum):
    """Numbered as MAV_MISSION_RESULT."""

    UNSUPPORTED_FRAME = 2
    UNSUPPORTED = 3
    NO_SPACE = 4
    INVALID = 5
    PARAM1 = 6
    PARAM2 = 7
    PARAM3 = 8
    PARAM4 = 9
    PARAM5_X = 10
    PARAM6_Y = 11
    PARAM7 = 12
    INVALID_SEQUENCE = 13


_DEEP_M = 5.0  # below home, from which an item is worth a warning: the terrain there is not known; guess
MISSION_FRAME = 2  # MAV_FRAME_MISSION: no position
ABSOLUTE_FRAMES = (0, 5)  # altitude above sea level
RELATIVE_FRAMES = (3, 6)  # altitude above home
NAV_COMMANDS = frozenset(
    (
        Command.WAYPOINT,
        Command.LOITER_UNLIMITED,
        Command.LOITER_TIME,
        Command.RETURN,
        Command.LAND,
        Command.TAKEOFF,
        Command.DELAY,
    )
)
_PLACED = frozenset((Command.WAYPOINT, Command.LOITER_UNLIMITED, Command.LOITER_TIME))
_PLACED_OR_HERE = frozenset((Command.LAND, Command.TAKEOFF))

_Problem = tuple[Result, str]
_Check = Callable[[MissionItem, Sequence[MissionItem]], _Problem | None]


def is_here(item: MissionItem) -> bool:
    """Whether a take-off or landing names no place of its own (NaN, or 0, 0 as ground stations send)."""
    return not (isfinite(item.x) and isfinite(item.y)) or (item.x == 0.0 and item.y == 0.0)


def hold_time_s(item: MissionItem) -> float:
    """Time [s] to stay at the item's place, or to wait."""
    time_s = item.params[0]
    return time_s if isfinite(time_s) else 0.0


def refuse_items(items: Sequence[MissionItem]) -> ItemRefusal | None:
    """The first reason not to take a mission, naming the item; None if all of it can be flown."""
    if len(items) > MAX_ITEMS:
        reason = f"a mission has at most {MAX_ITEMS} items"
        return ItemRefusal(MAX_ITEMS, Result.NO_SPACE, reason)
    for i_item, item in enumerate(items):
        problem = _sequence_problem(i_item, item) or _item_problem(item, items)
        if problem is not None:
            return ItemRefusal(i_item, int(problem[0]), problem[1])
    return None


def warning_of(items: Sequence[MissionItem]) -> str:
    """What is odd about a mission that can be flown, naming the first such item; empty if nothing is."""
    for item in items:
        has_height = item.command in _PLACED or item.command == Command.TAKEOFF
        if has_height and item.frame in RELATIVE_FRAMES and item.z < -_DEEP_M:
            return f"item {item.seq} is {-item.z:.0f} m below home"
    return ""


def _sequence_problem(i_item: int, item: MissionItem) -> _Problem | None:
    if item.seq != i_item:
        return Result.INVALID_SEQUENCE, f"has the number {item.seq}"
    return None


def _item_problem(item: MissionItem, items: Sequence[MissionItem]) -> _Problem | None:
    check = _CHECKS.get(item.command)
    if check is None:
        return Result.UNSUPPORTED, f"command {item.command} is not supported"
    return _frame_problem(item) or _place_problem(item) or check(item, items)


def _frame_problem(item: MissionItem) -> _Problem | None:
    if item.frame in ABSOLUTE_FRAMES or item.frame in RELATIVE_FRAMES:
        return None
    if item.frame == MISSION_FRAME and not (item.command in _PLACED or item.command in _PLACED_OR_HERE):
        return None
    return Result.UNSUPPORTED_FRAME, f"frame {item.frame} is not supported for command {item.command}"


def _place_problem(item: MissionItem) -> _Problem | None:
    may_be_here = item.command in _PLACED_OR_HERE
    if not (may_be_here or item.command in _PLACED):
        return None
    if not (may_be_here and is_here(item)):
        if not (isfinite(item.x) and abs(item.x) <= 90.0):
            return Result.PARAM5_X, f"latitude {item.x} is not on earth"
        if not (isfinite(item.y) and abs(item.y) <= 180.0):
            return Result.PARAM6_Y, f"longitude {item.y} is not on earth"
    if item.command != Command.LAND and not (isfinite(item.z) and abs(item.z) <= 10_000.0):
        return Result.PARAM7, f"altitude {item.z} m is out of range"
    return None


def _time_problem(item: MissionItem, what: str) -> _Problem | None:
    time_s = item.params[0]
    if time_s == time_s and not 0.0 <= time_s <= 86_400.0:
        return Result.PARAM1, f"{what} {time_s} s is out of range"
    return None


def _check_waypoint(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    acceptance_m, pass_m, yaw_deg = item.params[1:]
    if acceptance_m < 0.0 or acceptance_m > 1_000.0:
        return Result.PARAM2, f"acceptance radius {acceptance_m} m is out of range"
    if abs(pass_m) > 1_000.0:
        return Result.PARAM3, f"pass radius {pass_m} m is out of range"
    return _time_problem(item, "hold time") or _yaw_problem(yaw_deg)


def _yaw_problem(yaw_deg: float) -> _Problem | None:
    if abs(yaw_deg) > 360.0:
        return Result.PARAM4, f"heading {yaw_deg} deg is out of range"
    return None


def _check_loiter(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    return _time_problem(item, "loiter time") if item.command == Command.LOITER_TIME else None


def _check_return(_item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    return None


def _check_land(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    if item.params[1] > 0.0:
        return Result.PARAM2, "precision landing is not supported"
    return _yaw_problem(item.params[3])


def _check_takeoff(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    return _yaw_problem(item.params[3])


def _check_delay(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    if not item.params[0] >= 0.0:
        return Result.PARAM1, "a delay needs a time in seconds; the time of day is not supported"
    return _time_problem(item, "delay")


def _check_jump(item: MissionItem, items: Sequence[MissionItem]) -> _Problem | None:
    target, repeats = item.params[:2]
    if not (target == target and target == int(target) and 0 <= target < len(items)) or int(target) == item.seq:
        return Result.PARAM1, f"jump to item {target} is not possible"
    if not (repeats == repeats and -1 <= repeats <= 65_535 and repeats == int(repeats)):
        return Result.PARAM2, f"jump count {repeats} is out of range"
    if int(target) < item.seq and not any(other.command in NAV_COMMANDS for other in items[int(target) : item.seq]):
        return Result.PARAM1, f"jump to item {int(target)} repeats no item that takes time"
    return None


def _check_speed(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    kind, speed, throttle, is_relative = item.params
    if kind not in (0.0, 1.0, 2.0, 3.0):
        return Result.PARAM1, f"speed type {kind} is not supported"
    if speed not in (-1.0, -2.0) and not 0.0 < speed <= 100.0:
        return Result.PARAM2, f"speed {speed} m/s is out of range"
    if throttle > 0.0:
        return Result.PARAM3, "setting the throttle is not supported"
    if is_relative > 0.0:
        return Result.PARAM4, "a relative speed is not supported"
    return None


def _check_home(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    if item.params[0] == 1.0:
        return None
    if item.frame not in ABSOLUTE_FRAMES:
        return Result.UNSUPPORTED_FRAME, "home must be given above sea level"
    if not (isfinite(item.x) and abs(item.x) <= 90.0):
        return Result.PARAM5_X, f"latitude {item.x} is not on earth"
    if not (isfinite(item.y) and abs(item.y) <= 180.0):
        return Result.PARAM6_Y, f"longitude {item.y} is not on earth"
    if not isfinite(item.z):
        return Result.PARAM7, "home needs an altitude"
    return None


_CHECKS: dict[int, _Check] = {
    Command.WAYPOINT: _check_waypoint,
    Command.LOITER_UNLIMITED: _check_loiter,
    Command.LOITER_TIME: _check_loiter,
    Command.RETURN: _check_return,
    Command.LAND: _check_land,
    Command.TAKEOFF: _check_takeoff,
    Command.DELAY: _check_delay,
    Command.JUMP: _check_jump,
    Command.CHANGE_SPEED: _check_speed,
    Command.SET_HOME: _check_home,
}
SUPPORTED_COMMANDS = frozenset(_CHECKS)
