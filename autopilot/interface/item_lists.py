"""The lists that clients upload, read back and clear: mission, fence and rally points, each as a whole.

In: lists from MAVLink or from a file. Out: the same to whoever wants to read or keep them. Everything that changes a
list from outside comes through here, so that listeners hear of every change.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol


@dataclass(frozen=True, slots=True)
class MissionItem:
    """One mission item as the protocol carries it; x and y are degrees (or metres in a local frame)."""

    seq: int
    frame: int  # MAV_FRAME
    command: int  # MAV_CMD
    params: tuple[float, float, float, float]
    x: float  # [deg] latitude
    y: float  # [deg] longitude
    z: float  # [m] in the item's frame
    autocontinue: bool = True


def item_name(seq: int) -> str:
    """How texts call an item: people count from 1, whatever the dialect's numbers begin with."""
    return f"item {seq + 1}"


@dataclass(frozen=True, slots=True)
class ItemRefusal:
    """Why a mission was not taken: the item and the MAV_MISSION_RESULT to answer with."""

    seq: int
    result: int
    reason: str


class ListKind(IntEnum):
    """The lists of items that clients upload, numbered as MAV_MISSION_TYPE."""

    MISSION = 0
    FENCE = 1
    RALLY = 2


class ItemList(Protocol):
    """One such list: checked and kept as a whole."""

    @property
    def items(self) -> Sequence[MissionItem]: ...

    @property
    def capacity(self) -> int:
        """How many items it may have."""
        ...

    def load(self, items: Sequence[MissionItem]) -> ItemRefusal | None:
        """Replaces the list as a whole, or refuses it as a whole and keeps the old one."""
        ...


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
