"""The lists that clients upload, read back and clear: mission, fence and rally points, each as a whole.

In: lists from MAVLink or from a file. Out: the same to whoever wants to read or keep them. Everything that changes a
list from outside comes through here, so that listeners hear of every change.
"""

from collections.abc import Callable, Mapping, Sequence

from autopilot.vehicle import ItemList, ItemRefusal, ListKind, MissionItem

ListListener = Callable[[ListKind], None]


class ItemLists:
    """One vehicle's lists.

    Args:
        lists: who checks and keeps each kind.
    """

    __slots__ = ("_listeners", "_lists")

    def __init__(self, lists: Mapping[ListKind, ItemList]) -> None:
        self._lists = dict(lists)
        self._listeners: list[ListListener] = []

    def items(self, kind: ListKind) -> Sequence[MissionItem]:
        """The list as it is; later changes replace it and leave this one."""
        return self._lists[kind].items

    def capacity(self, kind: ListKind) -> int:
        """How many items the list may have."""
        return self._lists[kind].capacity

    def load(self, kind: ListKind, items: Sequence[MissionItem]) -> ItemRefusal | None:
        """Replaces a list as a whole and tells the listeners, or refuses it as a whole and keeps the old one."""
        refusal = self._lists[kind].load(items)
        if refusal is None:
            for listener in self._listeners:
                listener(kind)
        return refusal

    def on_change(self, listener: ListListener) -> None:
        """Calls `listener(kind)` after each change."""
        self._listeners.append(listener)
