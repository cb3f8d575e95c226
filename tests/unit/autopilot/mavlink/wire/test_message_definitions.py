import pytest
from pymavlink.dialects.v20 import all as pymavlink_all

from autopilot.mavlink.wire.codec import FrameReader, decode, encode, known_type
from autopilot.mavlink.wire.message_definitions import crc_extra, wire_order

# id and size of the payload in common.xml; the checksum bytes are those that MAVLink's generator gives
MISSING = {
    "COMMAND_CANCEL": (80, 4, 14),
    "ESC_INFO": (290, 46, 251),
    "ESC_STATUS": (291, 57, 10),
    "PROTOCOL_VERSION": (300, 22, 217),
    "COMPONENT_INFORMATION": (395, 212, 0),
    "COMPONENT_INFORMATION_BASIC": (396, 160, 50),
    "COMPONENT_METADATA": (397, 108, 182),
    "PLAY_TUNE_V2": (400, 254, 110),
    "SUPPORTED_TUNES": (401, 6, 183),
    "EVENT": (410, 53, 160),
    "CURRENT_EVENT_SEQUENCE": (411, 3, 106),
    "REQUEST_EVENT": (412, 6, 33),
    "RESPONSE_EVENT_ERROR": (413, 7, 77),
}


def written(definition) -> list[str]:
    """The fields of one of pymavlink's messages as ours are written, in wire order."""
    fields = []
    types = dict(zip(definition.fieldnames, definition.fieldtypes, strict=True))
    for name, length in zip(definition.ordered_fieldnames, definition.array_lengths, strict=True):
        kind = types[name]
        fields.append(f"{kind}[{length}] {name}" if length else f"{kind} {name}")
    return fields


def test_checksum_rule_gives_the_bytes_of_every_known_message():
    for definition in pymavlink_all.mavlink_map.values():
        fields = written(definition)
        prefixes = [fields[:count] for count in range(len(fields), 0, -1)]  # extensions do not count
        assert any(crc_extra(definition.msgname, prefix) == definition.crc_extra for prefix in prefixes)


@pytest.mark.parametrize("name", ["HEARTBEAT", "ATTITUDE", "PARAM_VALUE", "COMMAND_LONG", "GLOBAL_POSITION_INT"])
def test_checksum_and_order_of_messages_without_extensions(name):
    definition = pymavlink_all.mavlink_map[known_type(name).msg_id]
    ordered = written(definition)
    by_name = {field.split(" ")[1]: field for field in ordered}
    assert wire_order(tuple(by_name[field] for field in definition.fieldnames)) == ordered
    assert crc_extra(name, ordered) == definition.crc_extra


@pytest.mark.parametrize("name", MISSING)
def test_missing_message_has_the_published_layout(name):
    msg_id, size, checksum = MISSING[name]
    kind = known_type(name)
    assert (kind.msg_id, kind.size, kind.crc_extra[0]) == (msg_id, size, checksum)


def test_event_travels_whole():
    arguments = tuple(range(40))
    sent = encode(
        "EVENT", 1, 1, 0, id=0x01020304, event_time_boot_ms=5, sequence=7, log_levels=0x66, arguments=arguments
    )
    (frame,) = FrameReader().feed(sent)
    assert decode(frame).fields._asdict() == {
        "destination_component": 0,
        "destination_system": 0,
        "id": 0x01020304,
        "event_time_boot_ms": 5,
        "sequence": 7,
        "log_levels": 0x66,
        "arguments": arguments,
    }
