"""The packed file of a mission, a fence or rally points: ArduPilot's layout of `@MISSION/*.dat`.

Little endian: magic, MAV_MISSION_TYPE, options, number of the first item, how many follow; then each item as the
payload of MISSION_ITEM_INT.
"""

import struct
from collections.abc import Sequence
from types import SimpleNamespace

from autopilot.interface.item_lists import ListKind, MissionItem
from autopilot.mavlink.wire.item_messages import item_from_fields, scaled_position

MAGIC = 0x763D
KEEPS_OTHERS = 1  # option: items before and after those of the file stay
HEADER = struct.Struct("<5H")
ITEM = struct.Struct("<4f2if2H6B")  # MISSION_ITEM_INT on the wire: p1 to p4, x, y, z, seq, command, six bytes


class MissionFileError(ValueError):
    """The bytes are no such file; the message says why."""


def packed_items(kind: ListKind, items: Sequence[MissionItem], current: int = -1) -> bytes:
    """The file that holds a list; `current` is the number of the item that is flown."""
    pieces = [HEADER.pack(MAGIC, kind, 0, 0, len(items))]
    for item in items:
        x, y = scaled_position(item)
        flags = (0, 0, item.frame, int(item.seq == current), int(item.autocontinue), kind)
        pieces.append(ITEM.pack(*item.params, x, y, item.z, item.seq, item.command, *flags))
    return b"".join(pieces)


def unpacked_items(kind: ListKind, data: bytes, old: Sequence[MissionItem]) -> list[MissionItem]:
    """The list that a file says, numbered as it stands there.

    Args:
        kind: which list the file is for.
        data: the file.
        old: the list as it is, for a file that changes a part of it.

    Raises:
        MissionFileError: it is no such file, not a whole one, or begins beyond the end of the old list.
    """
    if len(data) < HEADER.size:
        raise MissionFileError("shorter than its header")
    magic, its_kind, options, start, count = HEADER.unpack_from(data)
    if magic != MAGIC or its_kind != kind:
        raise MissionFileError("it does not begin as such a file does")
    if len(data) != HEADER.size + count * ITEM.size:
        raise MissionFileError(f"its header says {count} items, its length does not")
    keeps_others = bool(options & KEEPS_OTHERS)
    if start > len(old) or (start and not keeps_others):
        raise MissionFileError(f"it begins with item {start}, and there are none before")
    items = [_item(start + i, values) for i, values in enumerate(ITEM.iter_unpack(data[HEADER.size :]))]
    return [*old[:start], *items, *old[start + count :]] if keeps_others else items


def _item(seq: int, values: tuple[float, ...]) -> MissionItem:
    p1, p2, p3, p4, x, y, z, _, command, _, _, frame, _, autocontinue, _ = values
    if not any(values):  # a piece of the file never came
        raise MissionFileError(f"item {seq} is empty")
    fields = SimpleNamespace(
        seq=seq, frame=frame, command=command, param1=p1, param2=p2, param3=p3, param4=p4, x=x, y=y, z=z,
        autocontinue=autocontinue,
    )  # fmt: skip
    return item_from_fields(fields)
