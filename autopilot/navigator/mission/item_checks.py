"""Which mission items are flown, checked one by one when a mission is loaded."""

from collections.abc import Callable, Sequence
from math import isfinite

from autopilot.interface.item_lists import ItemRefusal, MissionItem, item_name
from autopilot.interface.vehicle_state import FenceLimit
from autopilot.navigator.mission.item_commands import (
    ABSOLUTE_FRAMES,
    MAX_ITEMS,
    MISSION_FRAME,
    NAV_COMMANDS,
    PLACED,
    PLACED_OR_HERE,
    RELATIVE_FRAMES,
    ROI_AS_ASKED,
    ROI_BY_INDEX,
    ROI_OF_TARGET,
    Command,
    Result,
    is_here,
)

_DEEP_M = 5.0  # below home, from which an item is worth a warning: the terrain there is not known; guess
# Carried out by a payload only, as the refusal says: camera, gimbal, servos, relays, gripper, winch, parachute
_PAYLOAD_COMMANDS = frozenset(
    (181, 182, 183, 184, 187, 203, 204, 205, 206, 208, 211, 214, 530, 531, 532, 1000, 1001, 2000, 2001, 2500, 2501)
) | {42_600}

_OFF_GROUND = frozenset((Command.TAKEOFF, Command.LAND))
_ON_GROUND = frozenset((Command.SET_REVERSE,))

_Problem = tuple[Result, str]
_Check = Callable[[MissionItem, Sequence[MissionItem]], _Problem | None]


def refuse_items(
    items: Sequence[MissionItem], takes: Callable[[int], bool], *, leaves_ground: bool = True
) -> ItemRefusal | None:
    """The first reason not to take a mission, naming the item; None if all of it can be flown.

    Args:
        items: the mission.
        takes: whether the payload takes a command (autopilot.payload.payloads).
        leaves_ground: whether the vehicle can take off and land.
    """
    if len(items) > MAX_ITEMS:
        reason = f"a mission has at most {MAX_ITEMS} items"
        return ItemRefusal(MAX_ITEMS, Result.NO_SPACE, reason)
    for i_item, item in enumerate(items):
        problem = _sequence_problem(i_item, item) or _item_problem(item, items, takes)
        if problem is None and not leaves_ground and item.command in _OFF_GROUND:
            problem = Result.UNSUPPORTED, f"command {item.command} is for vehicles that leave the ground"
        if problem is None and leaves_ground and item.command in _ON_GROUND:
            problem = Result.UNSUPPORTED, f"command {item.command} is for vehicles that drive"
        if problem is not None:
            return ItemRefusal(i_item, int(problem[0]), problem[1])
    return None


def warning_of(items: Sequence[MissionItem]) -> str:
    """What is odd about a mission that can be flown, naming the first such item; empty if nothing is."""
    for item in items:
        has_height = item.command in PLACED or item.command == Command.TAKEOFF
        if has_height and item.frame in RELATIVE_FRAMES and item.z < -_DEEP_M:
            return f"{item_name(item.seq)} is {-item.z:.0f} m below home"
    return ""


def _sequence_problem(i_item: int, item: MissionItem) -> _Problem | None:
    if item.seq != i_item:
        return Result.INVALID_SEQUENCE, f"has the number {item.seq}"
    return None


def _item_problem(item: MissionItem, items: Sequence[MissionItem], takes: Callable[[int], bool]) -> _Problem | None:
    check = _CHECKS.get(item.command)
    if check is not None:
        return _frame_problem(item) or _position_problem(item) or check(item, items)
    if takes(item.command):
        return None
    if item.command in _PAYLOAD_COMMANDS:
        return Result.UNSUPPORTED, f"no payload takes command {item.command}"
    return Result.UNSUPPORTED, f"command {item.command} is not supported"


def _frame_problem(item: MissionItem) -> _Problem | None:
    if item.frame in ABSOLUTE_FRAMES or item.frame in RELATIVE_FRAMES:
        return None
    if item.frame == MISSION_FRAME and not (item.command in PLACED or item.command in PLACED_OR_HERE):
        return None
    return Result.UNSUPPORTED_FRAME, f"frame {item.frame} is not supported for command {item.command}"


def _position_problem(item: MissionItem) -> _Problem | None:
    may_be_here = item.command in PLACED_OR_HERE
    if not (may_be_here or item.command in PLACED):
        return None
    problem = None if may_be_here and is_here(item) else _lat_lon_problem(item)
    if problem is None and item.command != Command.LAND:
        problem = _altitude_problem(item)
    return problem


def _lat_lon_problem(item: MissionItem) -> _Problem | None:
    if not (isfinite(item.x) and abs(item.x) <= 90.0):
        return Result.PARAM5_X, f"latitude {item.x} is not on earth"
    if not (isfinite(item.y) and abs(item.y) <= 180.0):
        return Result.PARAM6_Y, f"longitude {item.y} is not on earth"
    return None


def _altitude_problem(item: MissionItem) -> _Problem | None:
    if not (isfinite(item.z) and abs(item.z) <= 10_000.0):
        return Result.PARAM7, f"altitude {item.z} m is out of range"
    return None


def _time_problem(item: MissionItem, what: str) -> _Problem | None:
    time_s = item.params[0]
    if time_s == time_s and not 0.0 <= time_s <= 86_400.0:
        return Result.PARAM1, f"{what} {time_s} s is out of range"
    return None


def _yaw_problem(yaw_deg: float) -> _Problem | None:
    if abs(yaw_deg) > 360.0:
        return Result.PARAM4, f"heading {yaw_deg} deg is out of range"
    return None


def _nothing_to_check(_item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    return None


# ---- items that are flown ----


def _check_waypoint(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    acceptance_m, pass_m, yaw_deg = item.params[1:]
    if acceptance_m < 0.0 or acceptance_m > 1_000.0:
        return Result.PARAM2, f"acceptance radius {acceptance_m} m is out of range"
    if abs(pass_m) > 1_000.0:
        return Result.PARAM3, f"pass radius {pass_m} m is out of range"
    return _time_problem(item, "hold time") or _yaw_problem(yaw_deg)


def _check_loiter_time(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    return _time_problem(item, "loiter time")


def _check_turns(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    turns, _heading_required, radius_m, _tangent = item.params
    if not 0.0 <= turns <= 1_000.0:
        return Result.PARAM1, f"{turns} turns are out of range"
    if abs(radius_m) > 1_000.0:
        return Result.PARAM3, f"radius {radius_m} m is out of range"
    return None


def _check_change_alt(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    if item.params[0] not in (0.0, 1.0, 2.0):
        return Result.PARAM1, f"parameter 1 is {item.params[0]}, not neutral (0), climb (1) or descend (2)"
    return _altitude_problem(item)


def _check_land(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    if item.params[1] == item.params[1] and item.params[1] not in (0.0, 1.0, 2.0):
        return Result.PARAM2, f"precision landing {item.params[1]} is not 0 (off), 1 (if seen) or 2 (with a search)"
    return _yaw_problem(item.params[3])


def _check_takeoff(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    return _yaw_problem(item.params[3])


def _check_delay(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    if not item.params[0] >= 0.0:
        return Result.PARAM1, "a delay needs a time in seconds: the time of day is not known"
    return _time_problem(item, "delay")


# ---- conditions ----


def _check_condition_delay(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    if not item.params[0] >= 0.0:
        return Result.PARAM1, "a delay needs a time in seconds"
    return _time_problem(item, "delay")


def _check_condition_distance(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    if not 0.0 <= item.params[0] <= 1.0e6:
        return Result.PARAM1, f"distance {item.params[0]} m is out of range"
    return None


def _check_condition_yaw(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    angle_deg, rate_deg_s, direction, is_relative = item.params
    if not abs(angle_deg) <= 360.0:
        return Result.PARAM1, f"heading {angle_deg} deg is out of range"
    if rate_deg_s < 0.0 or rate_deg_s > 360.0:
        return Result.PARAM2, f"yaw rate {rate_deg_s} deg/s is out of range"
    if direction == direction and direction not in (-1.0, 0.0, 1.0):
        return Result.PARAM3, f"direction {direction} is not -1, 0 or 1"
    if is_relative == is_relative and is_relative not in (0.0, 1.0):
        return Result.PARAM4, "parameter 4 must be 0 (absolute) or 1 (relative)"
    return None


def _check_gate(item: MissionItem, items: Sequence[MissionItem]) -> _Problem | None:
    if item.params[0] != 0.0 and item.params[0] == item.params[0]:
        return Result.PARAM1, "only gates across the way (0) are supported"
    if item.frame == MISSION_FRAME:
        return Result.UNSUPPORTED_FRAME, "a gate needs a place"
    if not any(other.command in PLACED for other in items[item.seq + 1 :]):
        return Result.UNSUPPORTED, "a gate needs a waypoint after it"
    return _lat_lon_problem(item)


# ---- items that take no time ----


def _check_jump(item: MissionItem, items: Sequence[MissionItem]) -> _Problem | None:
    target = item.params[0]
    if not (target == target and target == int(target) and 0 <= target < len(items)) or int(target) == item.seq:
        return Result.PARAM1, f"jump to {_target_name(target)} is not possible"
    return _repeats_problem(item) or _loop_problem(item, int(target), items)


def _target_name(target: float) -> str:
    return item_name(int(target)) if isfinite(target) and target == int(target) else f"item {target:g}"


def _check_jump_to_tag(item: MissionItem, items: Sequence[MissionItem]) -> _Problem | None:
    target = tagged_item(items, item.params[0])
    if target is None:
        return Result.PARAM1, f"no item has the tag {item.params[0]}"
    return _repeats_problem(item) or _loop_problem(item, target, items)


def _check_tag(item: MissionItem, items: Sequence[MissionItem]) -> _Problem | None:
    tag = item.params[0]
    if not (0.0 <= tag <= 65_535.0 and tag == int(tag)):
        return Result.PARAM1, f"tag {tag} is out of range"
    if tagged_item(items, tag) != item.seq:
        return Result.PARAM1, f"tag {int(tag)} is used twice"
    return None


def tagged_item(items: Sequence[MissionItem], tag: float) -> int | None:
    """The number of the item with a tag."""
    return next((item.seq for item in items if item.command == Command.JUMP_TAG and item.params[0] == tag), None)


def _repeats_problem(item: MissionItem) -> _Problem | None:
    repeats = item.params[1]
    if not (repeats == repeats and -1 <= repeats <= 65_535 and repeats == int(repeats)):
        return Result.PARAM2, f"jump count {repeats} is out of range"
    return None


def _loop_problem(item: MissionItem, target: int, items: Sequence[MissionItem]) -> _Problem | None:
    if target < item.seq and not any(other.command in NAV_COMMANDS for other in items[target : item.seq]):
        return Result.PARAM1, f"jump to {item_name(target)} repeats no item that takes time"
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
    problem = _lat_lon_problem(item)
    if problem is None and not isfinite(item.z):
        problem = Result.PARAM7, "home needs an altitude"
    return problem


def _check_fence(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    switch, limits = item.params[:2]
    if switch not in (0.0, 1.0, 2.0):
        return Result.PARAM1, f"parameter 1 is {switch}, not 0 (off), 1 (on) or 2 (floor off)"
    if limits == limits and not (0.0 <= limits <= sum(FenceLimit) and limits == int(limits)):
        return Result.PARAM2, f"fence limits {limits} are no sum of 1, 2, 4 and 8"
    return None


def _check_reverse(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    if item.params[0] in (0.0, 1.0):
        return None
    return Result.PARAM1, f"parameter 1 is {item.params[0]}, not 0 (forwards) or 1 (backwards)"


def _check_roi(item: MissionItem, _: Sequence[MissionItem]) -> _Problem | None:
    if item.command in ROI_AS_ASKED and item.params[0] in (ROI_BY_INDEX, ROI_OF_TARGET):
        return (
            Result.PARAM1,
            f"region of interest {item.params[0]:.0f} is not supported: a place or the next waypoint is",
        )
    if is_here(item) and item.command in ROI_AS_ASKED:
        return None  # none from now on
    if item.frame == MISSION_FRAME:
        return Result.UNSUPPORTED_FRAME, "a region of interest needs a place"
    return _lat_lon_problem(item)


_CHECKS: dict[int, _Check] = {
    Command.WAYPOINT: _check_waypoint,
    Command.SPLINE_WAYPOINT: _check_waypoint,
    Command.LOITER_UNLIMITED: _nothing_to_check,
    Command.LOITER_TURNS: _check_turns,
    Command.LOITER_TIME: _check_loiter_time,
    Command.LOITER_TO_ALT: _nothing_to_check,
    Command.CONTINUE_AND_CHANGE_ALT: _check_change_alt,
    Command.RETURN: _nothing_to_check,
    Command.LAND: _check_land,
    Command.TAKEOFF: _check_takeoff,
    Command.DELAY: _check_delay,
    Command.CONDITION_DELAY: _check_condition_delay,
    Command.CONDITION_DISTANCE: _check_condition_distance,
    Command.CONDITION_YAW: _check_condition_yaw,
    Command.CONDITION_GATE: _check_gate,
    Command.JUMP: _check_jump,
    Command.JUMP_TAG: _check_tag,
    Command.JUMP_TO_TAG: _check_jump_to_tag,
    Command.CHANGE_SPEED: _check_speed,
    Command.SET_HOME: _check_home,
    Command.LAND_START: _nothing_to_check,
    Command.RETURN_PATH_START: _nothing_to_check,
    Command.ROI_LOCATION: _check_roi,
    Command.ROI_NEXT_OFFSET: _nothing_to_check,
    Command.ROI_NONE: _nothing_to_check,
    Command.ROI: _check_roi,
    Command.NAV_ROI: _check_roi,
    Command.FENCE_ENABLE: _check_fence,
    Command.SET_REVERSE: _check_reverse,
}
SUPPORTED_COMMANDS = frozenset(_CHECKS)
