"""Rally points: safe places to return to instead of home, as clients have uploaded them."""

from collections.abc import Sequence
from math import isfinite

from autopilot.interface.item_lists import ItemRefusal, MissionItem
from autopilot.navigator.fence.fence_items import position_refusal
from autopilot.navigator.mission.item_commands import Result

RALLY_POINT = 5100  # MAV_CMD
MAX_RALLY_POINTS = 100  # a choice for the pilot, not a map; guess


class RallyPoints:
    """The stored rally points."""

    __slots__ = ("items",)

    capacity = MAX_RALLY_POINTS

    def __init__(self) -> None:
        self.items: tuple[MissionItem, ...] = ()

    def load(self, items: Sequence[MissionItem]) -> ItemRefusal | None:
        """Replaces the points, or keeps the old ones and says why."""
        if len(items) > MAX_RALLY_POINTS:
            reason = f"there may be at most {MAX_RALLY_POINTS} rally points"
            return ItemRefusal(MAX_RALLY_POINTS, Result.NO_SPACE, reason)
        for i_item, item in enumerate(items):
            refusal = _refusal(i_item, item)
            if refusal is not None:
                return refusal
        self.items = tuple(items)
        return None


def _refusal(i_item: int, item: MissionItem) -> ItemRefusal | None:
    if item.command != RALLY_POINT:
        return ItemRefusal(i_item, Result.UNSUPPORTED, f"command {item.command} is no rally point")
    if not (isfinite(item.z) and abs(item.z) <= 10_000.0):
        return ItemRefusal(i_item, Result.PARAM7, f"altitude {item.z} m is out of range")
    return position_refusal(i_item, item)
