"""The packed parameter file `@PARAM/param.pck`: ArduPilot's layout, with the values of the PARAM_VALUE list.

Little endian: magic, number of parameters in the file and in all, as 16 bits each; then per parameter its type and
flags, how many letters of the name before it shares and how many follow, those letters, and the value. With defaults,
a value that differs from its default is followed by it. An upload carries its own length in place of the third number.
"""

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from pymavlink.dialects.v20 import all as mavlink

MAGIC = 0x671B
MAGIC_WITH_DEFAULTS = 0x671C
NAME_LENGTH_MAX = 16
SHARED_LENGTH_MAX = 15  # four bits
HAS_DEFAULT = 1  # flag
UPLOAD_BYTES_MAX = 0xFFFF

_HEADER = struct.Struct("<HHH")
# MAV_PARAM_TYPE to the file's own type
_TYPES = {
    mavlink.MAV_PARAM_TYPE_INT8: 1,
    mavlink.MAV_PARAM_TYPE_INT16: 2,
    mavlink.MAV_PARAM_TYPE_INT32: 3,
    mavlink.MAV_PARAM_TYPE_REAL32: 4,
}
_MAV_TYPES = {own: mav_type for mav_type, own in _TYPES.items()}
_LAYOUTS = {1: struct.Struct("<b"), 2: struct.Struct("<h"), 3: struct.Struct("<i"), 4: struct.Struct("<f")}


class ParamFileError(ValueError):
    """The bytes are no parameter file; the message says why."""


@dataclass(frozen=True, slots=True)
class ParamEntry:
    """One parameter as a client sees it."""

    name: str
    mav_type: int  # MAV_PARAM_TYPE
    value: float
    default: float


def packed_parameters(entries: Sequence[ParamEntry], total: int, *, with_defaults: bool = False) -> bytes:
    """The file that holds `entries`, out of `total` parameters."""
    magic = MAGIC_WITH_DEFAULTS if with_defaults else MAGIC
    pieces = [_HEADER.pack(magic, len(entries), total)]
    name_before = ""
    for entry in entries:
        own_type = _TYPES[entry.mav_type]
        layout = _LAYOUTS[own_type]
        shared = min(_shared_length(name_before, entry.name), SHARED_LENGTH_MAX, len(entry.name) - 1)
        rest = entry.name[shared:].encode("ascii")
        value, default = _packed(layout, entry.value), _packed(layout, entry.default)
        has_default = with_defaults and default != value
        flags = HAS_DEFAULT if has_default else 0
        pieces += [bytes((own_type | flags << 4, shared | len(rest) - 1 << 4)), rest, value]
        if has_default:
            pieces.append(default)
        name_before = entry.name
    return b"".join(pieces)


def _shared_length(name: str, other: str) -> int:
    """How many letters both begin with."""
    pairs = enumerate(zip(name, other, strict=False))
    return next((i for i, (letter, others) in pairs if letter != others), min(len(name), len(other)))


def _packed(layout: struct.Struct, value: float) -> bytes:
    return layout.pack(value) if layout.format == "<f" else layout.pack(round(value))


def unpacked_parameters(data: bytes) -> list[tuple[str, int, float]]:
    """Name, MAV_PARAM_TYPE and value of each parameter of a file.

    Raises:
        ParamFileError: it is not one, or not a whole one.
    """
    if len(data) < _HEADER.size:
        raise ParamFileError("shorter than its header")
    magic, count, total = _HEADER.unpack_from(data)
    if magic not in (MAGIC, MAGIC_WITH_DEFAULTS):
        raise ParamFileError("it does not begin as a parameter file does")
    if total != len(data) and total < count:
        raise ParamFileError("its length is not what its header says")
    entries = list(_entries(data))
    if len(entries) != count:
        raise ParamFileError(f"it holds {len(entries)} parameters, its header says {count}")
    return entries


def _entries(data: bytes) -> Iterable[tuple[str, int, float]]:
    at, name = _HEADER.size, b""
    while True:
        while at < len(data) and data[at] == 0:  # padding
            at += 1
        if at == len(data):
            return
        own_type, flags = data[at] & 0x0F, data[at] >> 4
        if own_type not in _LAYOUTS or at + 2 > len(data):
            raise ParamFileError("a parameter of no known type")
        shared, rest = data[at + 1] & 0x0F, (data[at + 1] >> 4) + 1
        layout = _LAYOUTS[own_type]
        value_at = at + 2 + rest
        end = value_at + layout.size * (2 if flags & HAS_DEFAULT else 1)
        if shared > len(name) or shared + rest > NAME_LENGTH_MAX or end > len(data):
            raise ParamFileError("a parameter is cut off")
        name = name[:shared] + data[at + 2 : value_at]
        yield name.decode("ascii", "replace"), int(_MAV_TYPES[own_type]), float(layout.unpack_from(data, value_at)[0])
        at = end
