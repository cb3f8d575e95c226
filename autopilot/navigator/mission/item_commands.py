"""What a mission item says: numbers of commands and frames, and how parameters are read.

Numbers of commands, frames and results are MAVLink's; they are written here so that the navigator needs no MAVLink.
"""

from enum import IntEnum
from math import isfinite

from autopilot.interface.item_lists import MissionItem

MAX_ITEMS = 2_000  # bounds memory and the time of a download


class Command(IntEnum):
    """Numbered as MAV_CMD; what a payload carries out is not listed."""

    WAYPOINT = 16
    LOITER_UNLIMITED = 17
    LOITER_TURNS = 18
    LOITER_TIME = 19
    RETURN = 20
    LAND = 21
    TAKEOFF = 22
    CONTINUE_AND_CHANGE_ALT = 30
    LOITER_TO_ALT = 31
    NAV_ROI = 80  # the oldest form of ROI; nothing is flown for it
    SPLINE_WAYPOINT = 82
    DELAY = 93
    CONDITION_DELAY = 112
    CONDITION_DISTANCE = 114
    CONDITION_YAW = 115
    JUMP = 177
    CHANGE_SPEED = 178
    SET_HOME = 179
    RETURN_PATH_START = 188
    LAND_START = 189
    SET_REVERSE = 194
    ROI_LOCATION = 195
    ROI_NEXT_OFFSET = 196
    ROI_NONE = 197
    ROI = 201
    FENCE_ENABLE = 207
    JUMP_TAG = 600
    JUMP_TO_TAG = 601
    CONDITION_GATE = 4501


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


MISSION_FRAME = 2  # MAV_FRAME_MISSION: no position
ABSOLUTE_FRAMES = (0, 5)  # altitude above sea level
RELATIVE_FRAMES = (3, 6)  # altitude above home
# Flown one after the other; the others are done on the way to the next of these.
NAV_COMMANDS = frozenset(
    (
        Command.WAYPOINT,
        Command.LOITER_UNLIMITED,
        Command.LOITER_TURNS,
        Command.LOITER_TIME,
        Command.RETURN,
        Command.LAND,
        Command.TAKEOFF,
        Command.CONTINUE_AND_CHANGE_ALT,
        Command.LOITER_TO_ALT,
        Command.SPLINE_WAYPOINT,
        Command.DELAY,
    )
)
CONDITIONS = frozenset(
    (Command.CONDITION_DELAY, Command.CONDITION_DISTANCE, Command.CONDITION_YAW, Command.CONDITION_GATE)
)
WAYPOINTS = frozenset((Command.WAYPOINT, Command.SPLINE_WAYPOINT))
PLACED = WAYPOINTS | {Command.LOITER_UNLIMITED, Command.LOITER_TURNS, Command.LOITER_TIME, Command.LOITER_TO_ALT}
PLACED_OR_HERE = frozenset((Command.LAND, Command.TAKEOFF))
ROI_AS_ASKED = frozenset((Command.ROI, Command.NAV_ROI))  # MAV_ROI in parameter 1
ROI_BY_INDEX, ROI_OF_TARGET = 2.0, 4.0  # MAV_ROI of DO_SET_ROI that have no meaning here


def is_here(item: MissionItem) -> bool:
    """Whether a take-off or landing names no position of its own (NaN, or 0, 0 as ground stations send)."""
    return not (isfinite(item.x) and isfinite(item.y)) or (item.x == 0.0 and item.y == 0.0)


def hold_time_s(item: MissionItem) -> float:
    """Time [s] to stay at the item's place, or to wait."""
    time_s = item.params[0]
    return time_s if isfinite(time_s) else 0.0


def passes_through(item: MissionItem) -> bool:
    """Whether a waypoint is flown through rather than stopped at, if the flight goes on after it."""
    return item.command in WAYPOINTS and hold_time_s(item) == 0.0 and item.autocontinue


def is_same(a: MissionItem, b: MissionItem) -> bool:
    """Whether two items ask for the same; NaN equals NaN here."""
    return repr(a) == repr(b)
