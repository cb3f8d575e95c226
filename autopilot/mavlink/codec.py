"""MAVLink frames to and from bytes.

In: field values, or bytes of any quality from a link. Out: MAVLink 2 frames, or decoded messages. pymavlink supplies
the message definitions only; packing and framing are our own, because telemetry has 10 microseconds per message.
Called by every link of the vehicle at 50 Hz, and by clients.
"""

import re
import struct
from collections import namedtuple
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

from fastcrc.crc16 import mcrf4xx

from autopilot.mavlink.definitions import DEFINITIONS

MAGIC_V1 = 0xFE
MAGIC_V2 = 0xFD
SIGNED_FLAG = 0x01
SIGNATURE_LENGTH = 13

_HEADER_V2 = struct.Struct(
    "<BBBBBBHB"
)  # length, incompatible flags, compatible flags, seq, sysid, compid, id, id >> 16
_MAGIC = re.compile(rb"[\xfd\xfe]")

# These fields carry the bit pattern of the value, because an integer's bytes may be a signalling NaN, which
# a conversion to a Python float would alter.
_BIT_PATTERN_FIELDS = {("PARAM_VALUE", "param_value"), ("PARAM_SET", "param_value")}

_IDS_BY_NAME: dict[str, int] = {item.msgname: item.id for item in DEFINITIONS.values()}


@dataclass(frozen=True, slots=True, eq=False)
class MessageType:
    """How one message is laid out."""

    msg_id: int
    name: str
    crc_extra: bytes
    size: int  # bytes, extension fields included
    pack: Callable[..., bytes]  # field values in the order of the specification (0 if left out) -> payload
    unpack: Callable[[bytes], Any]  # payload, truncated or not -> named tuple of the fields


class Frame(NamedTuple):
    """One frame whose checksum is right."""

    kind: MessageType
    sysid: int
    compid: int
    seq: int
    payload: bytes
    raw: bytes


class Message(NamedTuple):
    """A decoded frame; `fields` is a named tuple in the order of the specification."""

    msg_id: int
    name: str
    sysid: int
    compid: int
    seq: int
    fields: Any


def message_id(name: str) -> int:
    """The id of a message.

    Raises:
        KeyError: no such message.
    """
    return _IDS_BY_NAME[name]


@cache
def message_type(key: int | str) -> MessageType | None:
    """The layout of a message by id or name, None if it is unknown."""
    msg_id = _IDS_BY_NAME.get(key) if isinstance(key, str) else key
    definition = None if msg_id is None else DEFINITIONS.get(msg_id)
    if definition is None:
        return None
    if isinstance(key, str):
        return message_type(definition.id)
    packer, unpacker, size = _compile(definition)
    return MessageType(
        definition.id, definition.msgname, bytes([definition.crc_extra]), size, pack=packer, unpack=unpacker
    )


def known_type(name: str) -> MessageType:
    """The layout of a message that must exist.

    Raises:
        KeyError: no such message.
    """
    kind = message_type(name)
    if kind is None:
        raise KeyError(name)
    return kind


def frame_bytes(kind: MessageType, payload: bytes, seq: int, sysid: int, compid: int) -> bytes:
    """A MAVLink 2 frame; trailing zeros of the payload are left out as the protocol asks."""
    payload = payload.rstrip(b"\0") or b"\0"
    msg_id = kind.msg_id
    checked = _HEADER_V2.pack(len(payload), 0, 0, seq, sysid, compid, msg_id & 0xFFFF, msg_id >> 16) + payload
    return b"\xfd" + checked + mcrf4xx(checked + kind.crc_extra).to_bytes(2, "little")


def encode(key: int | str, sysid: int, compid: int, seq: int, /, *values: Any, **fields: Any) -> bytes:
    """A frame from field values, in the order of the specification or by name; fields left out are 0.

    Raises:
        KeyError: no such message.
        ValueError: a value does not fit its field.
    """
    kind = message_type(key)
    if kind is None:
        raise KeyError(key)
    try:
        payload = kind.pack(*values, **fields)
    except struct.error as error:
        raise ValueError(f"{kind.name}: {error}") from error
    return frame_bytes(kind, payload, seq & 0xFF, sysid, compid)


def decode(frame: Frame) -> Message:
    """The message inside a frame."""
    kind = frame.kind
    return Message(kind.msg_id, kind.name, frame.sysid, frame.compid, frame.seq, kind.unpack(frame.payload))


class FrameReader:
    """Finds frames in a stream of bytes and survives anything else in it.

    After a bad byte it looks for the next frame start one byte further on, so that rubbish never hides the good frame
    behind it. It keeps at most one unfinished frame (280 bytes).
    """

    def __init__(self) -> None:
        self._rest = b""
        self.bad_byte_count = 0

    def feed(self, data: bytes, *, is_whole: bool = False) -> list[Frame]:
        """The frames completed by `data`.

        Args:
            data: the bytes that came in.
            is_whole: `data` is a datagram: what is unfinished at its end will never be finished.
        """
        buffer = self._rest + data if self._rest else bytes(data)
        frames: list[Frame] = []
        size = len(buffer)
        at = 0
        while at < size:
            if buffer[at] != MAGIC_V2 and buffer[at] != MAGIC_V1:
                found = _MAGIC.search(buffer, at)
                next_at = found.start() if found else size
                self.bad_byte_count += next_at - at
                at = next_at
                continue
            end = _frame_end(buffer, at, size)
            if end > size and not is_whole:
                break
            frame = _checked_frame(buffer, at, end) if end <= size else None
            if frame is None:
                self.bad_byte_count += 1
                at += 1
                continue
            frames.append(frame)
            at = end
        self._rest = buffer[at:]
        return frames


def _frame_end(buffer: bytes, at: int, size: int) -> int:
    """Where the frame that starts at `at` would end; beyond `size` while its header is unfinished."""
    if buffer[at] == MAGIC_V1:
        return at + 8 + buffer[at + 1] if at + 1 < size else size + 1
    if at + 2 >= size:
        return size + 1
    signature = SIGNATURE_LENGTH if buffer[at + 2] & SIGNED_FLAG else 0
    return at + 12 + buffer[at + 1] + signature


def _checked_frame(buffer: bytes, at: int, end: int) -> Frame | None:
    """The frame in `buffer[at:end]`, None if it is of no known kind or its checksum is wrong."""
    length = buffer[at + 1]
    if buffer[at] == MAGIC_V1:
        start, seq, sysid, compid, msg_id = at + 6, buffer[at + 2], buffer[at + 3], buffer[at + 4], buffer[at + 5]
    else:
        if buffer[at + 2] & ~SIGNED_FLAG:  # flags we do not know change how the frame is to be read
            return None
        start, seq, sysid, compid = at + 10, buffer[at + 4], buffer[at + 5], buffer[at + 6]
        msg_id = int.from_bytes(buffer[at + 7 : at + 10], "little")
    kind = message_type(msg_id) if msg_id in DEFINITIONS else None
    if kind is None:
        return None
    stop = start + length
    if mcrf4xx(buffer[at + 1 : stop] + kind.crc_extra) != buffer[stop] | buffer[stop + 1] << 8:
        return None
    return Frame(kind, sysid, compid, seq, buffer[start:stop], buffer[at:end])


def _compile(definition: Any) -> tuple[Callable[..., bytes], Callable[[bytes], Any], int]:
    """The pack and unpack functions of a message, and its payload size."""
    codes = _wire_codes(definition)
    layout = struct.Struct("<" + "".join(codes.values()))
    record = namedtuple(f"{definition.msgname.lower()}_fields", definition.fieldnames)  # type: ignore[misc]  # noqa: PYI024
    scope: dict[str, Any] = {"_pack": layout.pack, "_Record": record, "_text": _text, "_chars": _chars}

    positions: dict[str, str] = {}
    values: list[str] = []
    arguments: dict[str, str] = {}
    i_value = 0
    for name, code in codes.items():
        count = 1 if code.endswith("s") else int(code[:-1] or 1)
        is_array = count > 1 and not code.endswith("s")
        span = f"v[{i_value}:{i_value + count}]" if is_array else f"v[{i_value}]"
        positions[name] = f"_text({span})" if code.endswith("s") else span
        values.append(f"*{name}" if is_array else f"_chars({name})" if code.endswith("s") else name)
        arguments[name] = (
            f"{name}={(0,) * count!r}" if is_array else f"{name}=b''" if code.endswith("s") else f"{name}=0"
        )
        i_value += count
    parameters = ", ".join(arguments[name] for name in definition.fieldnames)
    packer = eval(f"lambda {parameters}: _pack({', '.join(values)})", scope)  # noqa: S307  (text made of field names)
    maker = eval(f"lambda v: _Record({', '.join(positions[n] for n in definition.fieldnames)})", scope)  # noqa: S307
    size = layout.size
    unpack_from = layout.unpack_from
    return packer, lambda payload: maker(unpack_from(payload.ljust(size, b"\0"))), size


def _wire_codes(definition: Any) -> dict[str, str]:
    """`struct` codes of the fields in wire order."""
    codes = ["1s" if code == "c" else code for code in re.findall(r"\d*[a-zA-Z]", definition.unpacker.format[1:])]
    named = dict(zip(definition.ordered_fieldnames, codes, strict=True))
    for message_name, field in _BIT_PATTERN_FIELDS:
        if message_name == definition.msgname:
            named[field] = "I"
    return named


def _chars(value: bytes | str) -> bytes:
    return value.encode("ascii", "replace") if isinstance(value, str) else value


def _text(value: bytes) -> str:
    return value.partition(b"\0")[0].decode("ascii", "replace")
