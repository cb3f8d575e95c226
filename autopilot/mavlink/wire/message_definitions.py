"""Message definitions: pymavlink's, and those of MAVLink's common.xml that pymavlink does not have yet.

What is written here is the list of fields, in the order of common.xml; order on the wire and checksum byte follow by
MAVLink's rules.
"""

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import all as pymavlink_all

_CODES = {
    "char": "c", "uint8_t": "B", "int8_t": "b", "uint16_t": "H", "int16_t": "h", "uint32_t": "I", "int32_t": "i",
    "uint64_t": "Q", "int64_t": "q", "float": "f", "double": "d",
}  # fmt: skip

# Message: its id and its fields as "type name", an array as "type[length] name".
_MISSING: dict[str, tuple[int, tuple[str, ...]]] = {
    "COMMAND_CANCEL": (80, ("uint8_t target_system", "uint8_t target_component", "uint16_t command")),
    "ESC_INFO": (
        290,
        (
            "uint8_t index", "uint64_t time_usec", "uint16_t counter", "uint8_t count", "uint8_t connection_type",
            "uint8_t info", "uint16_t[4] failure_flags", "uint32_t[4] error_count", "int16_t[4] temperature",
        ),
    ),
    "ESC_STATUS": (
        291,
        ("uint8_t index", "uint64_t time_usec", "int32_t[4] rpm", "float[4] voltage", "float[4] current"),
    ),
    "PROTOCOL_VERSION": (
        300,
        (
            "uint16_t version", "uint16_t min_version", "uint16_t max_version", "uint8_t[8] spec_version_hash",
            "uint8_t[8] library_version_hash",
        ),
    ),
    "COMPONENT_INFORMATION": (
        395,
        (
            "uint32_t time_boot_ms", "uint32_t general_metadata_file_crc", "char[100] general_metadata_uri",
            "uint32_t peripherals_metadata_file_crc", "char[100] peripherals_metadata_uri",
        ),
    ),
    "COMPONENT_INFORMATION_BASIC": (
        396,
        (
            "uint32_t time_boot_ms", "uint64_t capabilities", "uint32_t time_manufacture_s", "char[32] vendor_name",
            "char[32] model_name", "char[24] software_version", "char[24] hardware_version", "char[32] serial_number",
        ),
    ),
    "COMPONENT_METADATA": (397, ("uint32_t time_boot_ms", "uint32_t file_crc", "char[100] uri")),
    "PLAY_TUNE_V2": (
        400,
        ("uint8_t target_system", "uint8_t target_component", "uint32_t format", "char[248] tune"),
    ),
    "SUPPORTED_TUNES": (401, ("uint8_t target_system", "uint8_t target_component", "uint32_t format")),
    "EVENT": (
        410,
        (
            "uint8_t destination_component", "uint8_t destination_system", "uint32_t id",
            "uint32_t event_time_boot_ms", "uint16_t sequence", "uint8_t log_levels", "uint8_t[40] arguments",
        ),
    ),
    "CURRENT_EVENT_SEQUENCE": (411, ("uint16_t sequence", "uint8_t flags")),
    "REQUEST_EVENT": (
        412,
        (
            "uint8_t target_system", "uint8_t target_component", "uint16_t first_sequence", "uint16_t last_sequence",
        ),
    ),
    "RESPONSE_EVENT_ERROR": (
        413,
        (
            "uint8_t target_system", "uint8_t target_component", "uint16_t sequence",
            "uint16_t sequence_oldest_available", "uint8_t reason",
        ),
    ),
}  # fmt: skip

# Extension fields of common.xml that pymavlink does not have: they stand at the end, and the checksum leaves them out.
_EXTENSIONS: dict[str, tuple[str, ...]] = {
    "SERIAL_CONTROL": ("uint8_t target_system", "uint8_t target_component"),
}


@dataclass(frozen=True, slots=True)
class Definition:
    """One message, with the attributes that pymavlink's message classes have."""

    id: int
    msgname: str
    fieldnames: tuple[str, ...]  # in the order of the specification
    ordered_fieldnames: tuple[str, ...]  # in the order of the wire
    unpacker: struct.Struct
    crc_extra: int


def _split(field: str) -> tuple[str, int, str]:
    """Type, length (0: no array) and name of a field as it is written above."""
    kind, name = field.split(" ")
    kind, _, length = kind.removesuffix("]").partition("[")
    return kind, int(length or 0), name


def _code(kind: str, length: int) -> str:
    if kind == "char":
        return f"{max(length, 1)}s"
    return f"{length or ''}{_CODES[kind]}"


def wire_order(fields: tuple[str, ...]) -> list[str]:
    """Larger types first, otherwise as written."""
    return sorted(fields, key=lambda field: -struct.calcsize(_CODES[_split(field)[0]]))


def crc_extra(name: str, ordered: list[str]) -> int:
    """MAVLink's checksum byte of a layout, over the names and types of all fields but extensions."""
    text = f"{name} ".encode("ascii")
    for field in ordered:
        kind, length, field_name = _split(field)
        text += f"{kind} {field_name} ".encode("ascii") + (bytes([length]) if length else b"")
    checksum = mcrf4xx(text)
    return checksum & 0xFF ^ checksum >> 8


def _missing(name: str, msg_id: int, fields: tuple[str, ...]) -> Definition:
    ordered = wire_order(fields)
    layout = "<" + "".join(_code(*_split(field)[:2]) for field in ordered)
    return Definition(
        msg_id,
        name,
        tuple(_split(field)[2] for field in fields),
        tuple(_split(field)[2] for field in ordered),
        struct.Struct(layout),
        crc_extra(name, ordered),
    )


def _extended(known: Any, fields: tuple[str, ...]) -> Definition:
    names = tuple(_split(field)[2] for field in fields)
    return Definition(
        known.id,
        known.msgname,
        (*known.fieldnames, *names),
        (*known.ordered_fieldnames, *names),
        struct.Struct(known.unpacker.format + "".join(_code(*_split(field)[:2]) for field in fields)),
        known.crc_extra,
    )


def _all_definitions() -> dict[int, Any]:
    """Every message by its id; a newer pymavlink that has one of ours is believed."""
    known: dict[int, Any] = dict(pymavlink_all.mavlink_map)
    for name, (msg_id, fields) in _MISSING.items():
        known.setdefault(msg_id, _missing(name, msg_id, fields))
    for definition in list(known.values()):
        fields = _EXTENSIONS.get(definition.msgname, ())
        if fields and _split(fields[0])[2] not in definition.fieldnames:
            known[definition.id] = _extended(definition, fields)
    return known


DEFINITIONS: Mapping[int, Any] = _all_definitions()
