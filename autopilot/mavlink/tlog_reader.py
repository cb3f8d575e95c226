"""Telemetry logs read: the messages of some names, as columns.

In: a .tlog, of this project or of a ground station (8 bytes of time, then a frame, again and again). Out: per message
name its fields, and when each came [us].
"""

from pathlib import Path
from struct import Struct
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import all as mavlink

_TIME = Struct(">Q")
_V1, _V2 = 0xFE, 0xFD
_HEADER_V1, _HEADER_V2, _CRC, _SIGNATURE = 6, 10, 2, 13
_SIGNED = 1  # of the flags


class TlogDamage(ValueError):
    """A telemetry log that cannot be followed; the message is one sentence."""


def read_messages(path: Path, names: tuple[str, ...], system_id: int | None = None) -> dict[str, dict[str, Any]]:
    """Columns of the messages of these names, of one system: the first that sends any of them.

    Args:
        path: of the log.
        names: of the messages.
        system_id: whose; None: the first's.

    Raises:
        OSError: it cannot be read.
        TlogDamage: it is none.
    """
    content = path.read_bytes()
    parser: Any = mavlink.MAVLink(None)
    rows: dict[str, list[Any]] = {name: [] for name in names}
    times: dict[str, list[int]] = {name: [] for name in names}
    at = count = 0
    while at + _TIME.size + _HEADER_V1 <= len(content):
        size = _frame_size(content, at + _TIME.size)
        if size == 0:
            at += 1  # damaged: the next frame may be whole
            continue
        frame = content[at + _TIME.size : at + _TIME.size + size]
        (time_us,) = _TIME.unpack_from(content, at)
        at += _TIME.size + size
        try:
            message = parser.decode(bytearray(frame))
        except mavlink.MAVError:
            continue
        count += 1
        name = message.get_type()
        if name not in rows or (system_id is not None and message.get_srcSystem() != system_id):
            continue
        system_id = message.get_srcSystem()
        rows[name].append(message)
        times[name].append(time_us)
    if not count:
        raise TlogDamage(f"{path}: holds no MAVLink message")
    return {name: _columns(found, times[name]) for name, found in rows.items() if found}


def _frame_size(content: bytes, at: int) -> int:
    """Of the frame that begins there [byte]; 0: none does."""
    if content[at] == _V2 and at + 2 < len(content):
        return _HEADER_V2 + content[at + 1] + _CRC + (_SIGNATURE if content[at + 2] & _SIGNED else 0)
    return _HEADER_V1 + content[at + 1] + _CRC if content[at] == _V1 else 0


def _columns(messages: list[Any], times: list[int]) -> dict[str, NDArray[Any]]:
    columns: dict[str, NDArray[Any]] = {"timestamp": np.array(times, np.int64)}
    for field in messages[0].get_fieldnames():
        columns[field] = np.array([getattr(message, field) for message in messages])
    return columns
