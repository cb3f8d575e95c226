import struct

import pytest
from pymavlink.dialects.v20 import all as pymavlink_all

from autopilot.mavlink.wire.codec import (
    FrameReader,
    _layouts,
    begins_with_frame,
    decode,
    encode,
    known_type,
    message_type,
)
from autopilot.mavlink.wire.message_definitions import DEFINITIONS

HEARTBEAT_FIELDS = {"type": 2, "autopilot": 12, "base_mode": 157, "custom_mode": 0x03040000, "system_status": 4}


def frames_in(data: bytes, **how: bool) -> list[str]:
    return [frame.kind.name for frame in FrameReader().feed(data, **how)]


def test_encode_gives_the_bytes_of_pymavlink():
    mav = pymavlink_all.MAVLink(None, srcSystem=7, srcComponent=1)
    mav.seq = 200
    expected = pymavlink_all.MAVLink_attitude_message(1000, 0.1, -0.2, 3.0, 0.0, 0.5, 0.0).pack(mav)
    assert encode("ATTITUDE", 7, 1, 200, 1000, 0.1, -0.2, 3.0, 0.0, 0.5, 0.0) == bytes(expected)


def test_decode_gives_what_was_encoded():
    (frame,) = FrameReader().feed(encode("HEARTBEAT", 3, 1, 9, **HEARTBEAT_FIELDS))
    message = decode(frame)
    assert (message.name, message.sysid, message.compid, message.seq) == ("HEARTBEAT", 3, 1, 9)
    assert message.fields._asdict() == HEARTBEAT_FIELDS | {"mavlink_version": 0}


def test_every_message_of_the_dialect_has_a_layout():
    for msg_id, definition in DEFINITIONS.items():
        kind = message_type(msg_id)
        assert kind is not None
        assert kind.size == definition.unpacker.size
        assert kind.unpack(kind.pack())._fields == tuple(definition.fieldnames)


def test_unknown_message_has_no_layout():
    assert message_type(65_000) is None
    assert message_type("NO_SUCH_MESSAGE") is None
    with pytest.raises(KeyError):
        known_type("NO_SUCH_MESSAGE")


def test_value_outside_its_field_is_refused():
    with pytest.raises(ValueError, match="MISSION_COUNT"):
        encode("MISSION_COUNT", 1, 1, 0, count=70_000)


def test_text_ends_at_the_first_zero():
    kind = known_type("STATUSTEXT")
    assert kind.unpack(kind.pack(6, "hold")).text == "hold"
    assert len(kind.unpack(kind.pack(6, "x" * 50)).text) == 50


def test_parameter_value_keeps_every_bit_pattern():
    kind = known_type("PARAM_VALUE")
    signalling_nan = 0x7F800001
    assert kind.unpack(kind.pack("X", signalling_nan, 6, 1, 0)).param_value == signalling_nan


def test_frame_behind_rubbish_is_found():
    good = encode("HEARTBEAT", 1, 1, 0, **HEARTBEAT_FIELDS)
    assert frames_in(b"\x00\xff rubbish" + good) == ["HEARTBEAT"]


def test_frame_behind_a_false_start_is_found():
    good = encode("HEARTBEAT", 1, 1, 0, **HEARTBEAT_FIELDS)
    false_start = b"\xfd\x09\x00"  # claims 21 bytes, which reach into the good frame
    assert frames_in(false_start + good) == ["HEARTBEAT"]


def test_frame_with_a_wrong_checksum_is_skipped_and_counted():
    good = encode("HEARTBEAT", 1, 1, 0, **HEARTBEAT_FIELDS)
    bad = good[:-1] + bytes([good[-1] ^ 1])
    reader = FrameReader()
    assert [frame.kind.name for frame in reader.feed(bad + good)] == ["HEARTBEAT"]
    assert reader.bad_byte_count == len(bad)


def test_truncated_datagram_does_not_hold_back_the_next():
    good = encode("HEARTBEAT", 1, 1, 0, **HEARTBEAT_FIELDS)
    reader = FrameReader()
    assert reader.feed(good[:-3], is_whole=True) == []
    assert len(reader.feed(good, is_whole=True)) == 1


def test_frame_in_pieces_is_put_together():
    good = encode("HEARTBEAT", 1, 1, 0, **HEARTBEAT_FIELDS)
    reader = FrameReader()
    found = [frame for byte in good * 2 for frame in reader.feed(bytes([byte]))]
    assert len(found) == 2


def test_mavlink_1_frame_is_read():
    mav = pymavlink_all.MAVLink(None, srcSystem=255, srcComponent=190)
    message = pymavlink_all.MAVLink_command_long_message(1, 1, 400, 0, 1.0, 0, 0, 0, 0, 0, 0)
    (frame,) = FrameReader().feed(bytes(message.pack(mav, force_mavlink1=True)))
    assert (frame.kind.name, frame.sysid, decode(frame).fields.param1) == ("COMMAND_LONG", 255, 1.0)


def test_signed_frame_is_read_as_one():
    good = bytearray(encode("HEARTBEAT", 1, 1, 0, **HEARTBEAT_FIELDS))
    good[2] = 1  # incompatible flags: signed
    checksum = pymavlink_all.x25crc(good[1:-2])
    checksum.accumulate(known_type("HEARTBEAT").crc_extra)
    signed = bytes(good[:-2]) + struct.pack("<H", checksum.crc) + b"S" * 13
    plain = encode("ATTITUDE", 1, 1, 0)
    assert frames_in(signed + plain) == ["HEARTBEAT", "ATTITUDE"]


def test_frame_with_unknown_flags_is_dropped():
    good = bytearray(encode("HEARTBEAT", 1, 1, 0, **HEARTBEAT_FIELDS))
    good[2] = 2
    checksum = pymavlink_all.x25crc(good[1:-2])
    checksum.accumulate(known_type("HEARTBEAT").crc_extra)
    assert frames_in(bytes(good[:-2]) + struct.pack("<H", checksum.crc), is_whole=True) == []


def test_reader_keeps_at_most_one_frame():
    reader = FrameReader()
    for _ in range(1000):
        reader.feed(b"\xfd\xff" * 100)
    assert len(reader._rest) <= 280


def test_numbers_that_clients_send_fill_no_cache():
    before = len(_layouts)
    for msg_id in range(1 << 24, (1 << 24) + 1_000):
        assert message_type(msg_id) is None
        assert message_type(-msg_id) is None
    assert len(_layouts) == before


def test_a_right_frame_is_seen_at_the_beginning_only():
    hello = encode("HEARTBEAT", 3, 1, 9, **HEARTBEAT_FIELDS)
    assert begins_with_frame(hello)
    assert begins_with_frame(hello + b"rubbish" * 100)
    for i in range(len(hello)):
        assert not begins_with_frame(hello[:i])
        assert not begins_with_frame(hello[:i] + bytes([hello[i] ^ 1]) + hello[i + 1 :])
    assert not begins_with_frame(b"x" + hello)


def test_text_of_a_peer_holds_no_control_characters():
    raw = b"\x1b[2Ja\rb\nc\x07\x7f"
    frame = encode("PARAM_SET", 255, 190, 0, param_id=raw)
    (decoded,) = FrameReader().feed(frame)
    assert decode(decoded).fields.param_id == "?[2Ja?b?c??"
