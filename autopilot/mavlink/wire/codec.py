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
from typing import Any, NamedTuple

from fastcrc.crc16 import mcrf4xx

from autopilot.mavlink.wire.message_definitions import DEFINITIONS

MAGIC_V1 = 0xFE
MAGIC_V2 = 0xFD
SIGNED_FLAG = 0x01
SIGNATURE_LENGTH = 13
FRAME_MAX = 280  # [byte]
SHORTEST_V2 = 12  # header and checksum

_HEADER_V2 = struct.Struct(
    "<BBBBBBHB"
)  # length, incompatible flags, compatible flags, seq, sysid, compid, id, id >> 16
_MAGIC = re.compile(rb"[\xfd\xfe]")
UNLIMITED = 1 << 62

# These fields carry the bit pattern of the value, because an integer's bytes may be a signalling NaN, which
# a conversion to a Python float would alter.
_BIT_PATTERN_FIELDS = {("PARAM_VALUE", "param_value"), ("PARAM_SET", "param_value")}

# Declared as text, but it holds the bytes of a number.
_BYTES_FIELDS = {(name, "param_value") for name in ("PARAM_EXT_VALUE", "PARAM_EXT_SET", "PARAM_EXT_ACK")}

_PRINTABLE = dict.fromkeys([*range(32), 127], "?") | {ord("\t"): " "}

_layouts: dict[int, "MessageType"] = {}  # of the messages that have been asked for
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
    target_system_at: int = -1  # where in the payload the addressee is; -1: it addresses all
    target_component_at: int = -1


Payload = tuple[MessageType, bytes]
"""A message, its fields packed."""


class Frame(NamedTuple):
    """One frame whose checksum is right, or one of a kind we do not know, whose checksum nobody here can tell."""

    kind: MessageType
    sysid: int
    compid: int
    seq: int
    payload: bytes
    raw: bytes

    @property
    def is_signed(self) -> bool:
        return self.raw[0] == MAGIC_V2 and bool(self.raw[2] & SIGNED_FLAG)

    def target(self) -> tuple[int, int]:
        """System and component it is addressed to; 0: all."""
        payload, kind = self.payload, self.kind
        size = len(payload)  # trailing zeros are not sent
        system_at, component_at = kind.target_system_at, kind.target_component_at
        system = payload[system_at] if 0 <= system_at < size else 0
        return system, payload[component_at] if 0 <= component_at < size else 0


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


def message_type(key: int | str) -> MessageType | None:
    """The layout of a message by id or name, None if it is unknown."""
    msg_id = _IDS_BY_NAME.get(key) if isinstance(key, str) else key
    if (
        msg_id is None or msg_id not in DEFINITIONS
    ):  # clients send numbers of any; only layouts of messages there are, are kept
        return None
    if msg_id not in _layouts:
        _layouts[msg_id] = _layout(msg_id)
    return _layouts[msg_id]


def _layout(msg_id: int) -> MessageType:
    definition = DEFINITIONS[msg_id]
    packer, unpacker, size = _compile(definition)
    system_at, component_at = _target_positions(definition)
    crc_extra = bytes([definition.crc_extra])
    return MessageType(definition.id, definition.msgname, crc_extra, size, packer, unpacker, system_at, component_at)


def known_type(name: str) -> MessageType:
    """The layout of a message that must exist.

    Raises:
        KeyError: no such message.
    """
    kind = message_type(name)
    if kind is None:
        raise KeyError(name)
    return kind


def unknown_type(msg_id: int) -> MessageType:
    """Stands for a message we have no definition of: it can be passed on, but not read."""

    def unpack(_: bytes) -> Any:
        return ()

    def pack(*_: Any, **__: Any) -> bytes:
        raise KeyError(msg_id)

    return MessageType(msg_id, f"UNKNOWN_{msg_id}", b"", 0, pack, unpack)


def frame_bytes(kind: MessageType, payload: bytes, seq: int, sysid: int, compid: int, flags: int = 0) -> bytes:
    """A MAVLink 2 frame; trailing zeros of the payload are left out as the protocol asks.

    Args:
        kind: the message.
        payload: its fields, packed.
        seq: counts the sender's frames.
        sysid: the sender's system.
        compid: the sender's component.
        flags: incompatible flags: SIGNED_FLAG announces a signature, which the caller appends.
    """
    payload = payload.rstrip(b"\0") or b"\0"
    msg_id = kind.msg_id
    checked = _HEADER_V2.pack(len(payload), flags, 0, seq, sysid, compid, msg_id & 0xFFFF, msg_id >> 16) + payload
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

    Args:
        keeps_unknown: frames of unknown kinds are returned too. Their checksum cannot be told, so one counts only if
            another frame, or the end of its datagram, follows right behind it.
        false_starts_max: of one `feed`; the rest of the data is dropped after so many, because each costs as much as
            a frame.
    """

    def __init__(self, *, keeps_unknown: bool = False, false_starts_max: int = UNLIMITED) -> None:
        self._rest = b""
        self._keeps_unknown = keeps_unknown
        self._false_starts_max = false_starts_max
        self.bad_byte_count = 0
        self.false_start_count = 0

    def feed(self, data: bytes, *, is_whole: bool = False) -> list[Frame]:
        """The frames completed by `data`.

        Args:
            data: the bytes that came in.
            is_whole: `data` is a datagram: what is unfinished at its end will never be finished.
        """
        if not self._rest:
            only = whole_frame(data)
            if only is not None:
                return [only]
        buffer = self._rest + data if self._rest else bytes(data)
        frames: list[Frame] = []
        size = len(buffer)
        at = 0
        false_starts_left = self._false_starts_max
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
            if frame is None and self._keeps_unknown and _may_be_unknown(buffer, at, end):
                if end == size and not is_whole:
                    break  # the byte behind it will tell
                if end == size or buffer[end] in (MAGIC_V1, MAGIC_V2):
                    frame = _unknown_frame(buffer, at, end)
            if frame is None:
                self.bad_byte_count += 1
                self.false_start_count += 1
                at += 1
                false_starts_left -= 1
                if false_starts_left <= 0:
                    self.bad_byte_count += size - at
                    at = size
                continue
            frames.append(frame)
            at = end
        self._rest = buffer[at:]
        return frames


def begins_with_frame(data: bytes) -> bool:
    """Whether a message that we know stands at the beginning, with a right checksum: what only MAVLink clients send."""
    head = data[:FRAME_MAX]
    if head[:1] not in (bytes([MAGIC_V1]), bytes([MAGIC_V2])):
        return False
    end = _frame_end(head, 0, len(head))
    return end <= len(head) and _checked_frame(head, 0, end) is not None


def whole_frame(data: bytes) -> Frame | None:
    """The frame that `data` is, if it is one whole unsigned MAVLink 2 frame: what nearly every piece is."""
    if len(data) < SHORTEST_V2 or data[0] != MAGIC_V2 or len(data) != SHORTEST_V2 + data[1] or data[2]:
        return None
    msg_id = data[7] | data[8] << 8 | data[9] << 16
    kind = _layouts.get(msg_id) or message_type(msg_id)
    if kind is None or mcrf4xx(data[1:-2] + kind.crc_extra) != data[-2] | data[-1] << 8:
        return None
    return Frame(kind, data[5], data[6], data[4], data[10:-2], data)


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
    start, seq, sysid, compid, msg_id = _header(buffer, at)
    if start == at + 10 and buffer[at + 2] & ~SIGNED_FLAG:  # flags we do not know change how it is to be read
        return None
    kind = message_type(msg_id)
    if kind is None:
        return None
    stop = start + buffer[at + 1]
    if mcrf4xx(buffer[at + 1 : stop] + kind.crc_extra) != buffer[stop] | buffer[stop + 1] << 8:
        return None
    return Frame(kind, sysid, compid, seq, buffer[start:stop], buffer[at:end])


def _header(buffer: bytes, at: int) -> tuple[int, int, int, int, int]:
    """Where the payload starts; sequence number, system, component and message id."""
    if buffer[at] == MAGIC_V1:
        return at + 6, buffer[at + 2], buffer[at + 3], buffer[at + 4], buffer[at + 5]
    msg_id = int.from_bytes(buffer[at + 7 : at + 10], "little")
    return at + 10, buffer[at + 4], buffer[at + 5], buffer[at + 6], msg_id


def _may_be_unknown(buffer: bytes, at: int, end: int) -> bool:
    """Whether `buffer[at:end]` can be a frame of a kind without a definition."""
    if end > len(buffer):
        return False
    start, _, sysid, _, msg_id = _header(buffer, at)
    has_unknown_flags = start == at + 10 and (buffer[at + 2] & ~SIGNED_FLAG or buffer[at + 3])
    return msg_id not in DEFINITIONS and sysid != 0 and not has_unknown_flags


def _unknown_frame(buffer: bytes, at: int, end: int) -> Frame:
    start, seq, sysid, compid, msg_id = _header(buffer, at)
    return Frame(unknown_type(msg_id), sysid, compid, seq, buffer[start : start + buffer[at + 1]], buffer[at:end])


def _compile(definition: Any) -> tuple[Callable[..., bytes], Callable[[bytes], Any], int]:
    """The pack and unpack functions of a message, and its payload size."""
    codes = _wire_codes(definition)
    layout = struct.Struct("<" + "".join(codes.values()))
    record = namedtuple(f"{definition.msgname.lower()}_fields", definition.fieldnames)  # type: ignore[misc]  # noqa: PYI024
    scope: dict[str, Any] = {
        "_pack": layout.pack,
        "_new": tuple.__new__,
        "_Record": record,
        "_text": _text,
        "_chars": _chars,
    }

    positions: dict[str, str] = {}
    values: list[str] = []
    arguments: dict[str, str] = {}
    i_value = 0
    for name, code in codes.items():
        count = 1 if code.endswith("s") else int(code[:-1] or 1)
        is_array = count > 1 and not code.endswith("s")
        span = f"v[{i_value}:{i_value + count}]" if is_array else f"v[{i_value}]"
        is_text = code.endswith("s") and (definition.msgname, name) not in _BYTES_FIELDS
        positions[name] = f"_text({span})" if is_text else span
        values.append(f"*{name}" if is_array else f"_chars({name})" if code.endswith("s") else name)
        arguments[name] = (
            f"{name}={(0,) * count!r}" if is_array else f"{name}=b''" if code.endswith("s") else f"{name}=0"
        )
        i_value += count
    parameters = ", ".join(arguments[name] for name in definition.fieldnames)
    packer = eval(f"lambda {parameters}: _pack({', '.join(values)})", scope)  # noqa: S307  (text made of field names)
    maker = eval(f"lambda v: _new(_Record, ({', '.join(positions[n] for n in definition.fieldnames)},))", scope)  # noqa: S307
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


def field_positions(name: str) -> dict[str, tuple[int, str]]:
    """Where each field of a message is in its payload, and its `struct` code."""
    positions: dict[str, tuple[int, str]] = {}
    at = 0
    for field, code in _wire_codes(DEFINITIONS[_IDS_BY_NAME[name]]).items():
        positions[field] = (at, code)
        at += struct.calcsize("<" + code)
    return positions


def _target_positions(definition: Any) -> tuple[int, int]:
    """Where target_system and target_component are in the payload; -1: the message has no such field."""
    positions = {"target_system": -1, "target_component": -1}
    at = 0
    for name, code in _wire_codes(definition).items():
        # MANUAL_CONTROL calls the system it is for `target`
        wanted = "target_system" if (definition.msgname, name) == ("MANUAL_CONTROL", "target") else name
        if wanted in positions:
            positions[wanted] = at
        at += struct.calcsize("<" + code)
    return positions["target_system"], positions["target_component"]


def _chars(value: bytes | str) -> bytes:
    return value.encode("ascii", "replace") if isinstance(value, str) else value


def _text(value: bytes) -> str:
    """What a peer wrote, without control characters: it may come to stand in texts, and those on terminals."""
    text = value.partition(b"\0")[0].decode("ascii", "replace")
    return text if text.isprintable() else text.translate(_PRINTABLE)
