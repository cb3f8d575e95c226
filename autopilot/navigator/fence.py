"""The geofence, as clients have uploaded it."""

from collections.abc import Sequence

from autopilot.navigator.fence_items import MAX_FENCE_ITEMS, GeoShape, fence_shapes
from autopilot.vehicle import ItemRefusal, MissionItem


class Fence:
    """The stored fence."""

    __slots__ = ("_shapes", "items")

    capacity = MAX_FENCE_ITEMS

    def __init__(self) -> None:
        self.items: tuple[MissionItem, ...] = ()
        self._shapes: tuple[GeoShape, ...] = ()

    def load(self, items: Sequence[MissionItem]) -> ItemRefusal | None:
        """Replaces the fence, or keeps the old one and says why."""
        shapes = fence_shapes(items)
        if isinstance(shapes, ItemRefusal):
            return shapes
        self.items = tuple(items)
        self._shapes = shapes
        return None
