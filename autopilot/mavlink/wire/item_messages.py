"""Mission items as messages carry them, and as the vehicle keeps them."""

from collections.abc import Sequence
from math import nan
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.item_lists import ItemRefusal, MissionItem
from autopilot.mavlink.wire.convert import INT32_MAX, LATLON_FRAMES, MISSION_FRAME, bounded_int
from autopilot.mavlink.wire.number_bounds import PARAMETER_MAX, first_outside

LOCAL_SCALE = 1.0e4  # local positions travel as 0.1 mm


def element_out_of_range(items: Sequence[MissionItem]) -> ItemRefusal | None:
    """The first item with a number that no command can mean."""
    for item in items:
        i = first_outside(PARAMETER_MAX, (*item.params, item.x, item.y, item.z))
        if i is not None:
            result = mavlink.MAV_MISSION_INVALID_PARAM1 + i
            return ItemRefusal(item.seq, result, f"parameter {i + 1} is out of range")
    return None


def item_from_fields(fields: Any) -> MissionItem:
    """The item in a MISSION_ITEM or MISSION_ITEM_INT."""
    x, y = fields.x, fields.y
    if isinstance(x, int):  # MISSION_ITEM_INT
        x, y = _unscaled(x, fields.frame), _unscaled(y, fields.frame)
    return MissionItem(
        fields.seq,
        fields.frame,
        fields.command,
        (fields.param1, fields.param2, fields.param3, fields.param4),
        x,
        y,
        fields.z,
        fields.autocontinue != 0,
    )


def _scale(frame: int) -> float:
    """Steps per degree or metre of the integer positions of a frame."""
    if frame == MISSION_FRAME:
        return 1.0
    return 1.0e7 if frame in LATLON_FRAMES else LOCAL_SCALE


def _unscaled(value: int, frame: int) -> float:
    """Degrees, metres, or the plain number; NaN where it was left unset."""
    return nan if value == INT32_MAX else value / _scale(frame)


def scaled_position(item: MissionItem) -> tuple[int, int]:
    """The integers x and y of MISSION_ITEM_INT."""
    scale = _scale(item.frame)
    return (
        bounded_int(item.x * scale, -INT32_MAX - 1, INT32_MAX, INT32_MAX),
        bounded_int(item.y * scale, -INT32_MAX - 1, INT32_MAX, INT32_MAX),
    )
