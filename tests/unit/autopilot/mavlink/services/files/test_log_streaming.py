"""The flight log as a stream: definitions acknowledged one by one, then data, cut where its records begin."""

from io import BytesIO

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mavlink
from pyulog import ULog

from autopilot.mavlink.services.files.log_streaming import (
    CLIENTS_MAX,
    GIVE_UP_US,
    NO_START,
    PIECE_BYTES,
    PIECES_PER_FRAME,
    QUEUE_BYTES_MAX,
    RESEND_US,
    PieceCutter,
)
from common.logs.ulog import UlogWriter
from tests.unit.autopilot.mavlink.rig import FRAME_US, Rig, texts

START, STOP = mavlink.MAV_CMD_LOGGING_START, mavlink.MAV_CMD_LOGGING_STOP


class Log:
    """A flight log in memory with one topic."""

    def __init__(self):
        self.file = BytesIO()
        parameters = {f"PARAMETER_{i}": float(i) for i in range(40)}
        self.writer = UlogWriter(self.file, 0, {"sys_name": "Honeyguide"}, parameters)
        self.topic = self.writer.add_topic("altitude", {"height": "float", "name": "char[200]"})
        self.rows = 0

    def grow(self, rows=1):
        for _ in range(rows):
            self.rows += 1
            self.topic.write({"timestamp": [self.rows], "height": [float(self.rows)], "name": [b"x" * 200]})

    def listen(self, listener):
        self.writer.listeners.append(listener)
        return self.writer.header(0)

    def stop_listening(self, listener):
        self.writer.listeners.remove(listener)


@pytest.fixture
def rig():
    rig = Rig()
    rig.vehicle.host.log_stream = Log()
    return rig


def pieces(messages):
    return [message.fields for message in messages if message.name.startswith("LOGGING_DATA")]


def stream_definitions(rig):
    """Starts, and acknowledges everything; returns the bytes."""
    assert rig.ack(START, 0.0).result == mavlink.MAV_RESULT_ACCEPTED
    content = b""
    messages = rig.frame(int(RESEND_US / FRAME_US) + 1)
    while True:
        acked = [message.fields for message in messages if message.name == "LOGGING_DATA_ACKED"]
        if not acked:
            return content
        content += bytes(acked[0].data[: acked[0].length])
        rig.client.send("LOGGING_ACK", sequence=acked[0].sequence)
        messages = rig.frame()


def test_definitions_and_data_make_a_log(rig):
    log = rig.vehicle.host.log_stream
    content = stream_definitions(rig)
    assert len(content) > 4 * PIECE_BYTES
    log.grow(30)
    messages = rig.frame(5)
    assert {message.name for message in messages if "LOGGING" in message.name} == {"LOGGING_DATA"}
    content += b"".join(bytes(piece.data[: piece.length]) for piece in pieces(messages))
    ulog = ULog(BytesIO(content))
    assert ulog.get_dataset("altitude").data["height"].tolist() == [float(i) for i in range(1, 31)]
    assert ulog.initial_parameters["PARAMETER_7"] == 7.0


def test_sequence_counts_through_definitions_and_data(rig):
    rig.ack(START, 0.0)
    seqs = []
    messages = rig.frame(12)
    while acked := [message.fields for message in messages if message.name == "LOGGING_DATA_ACKED"]:
        seqs.append(acked[0].sequence)
        rig.client.send("LOGGING_ACK", sequence=acked[0].sequence)
        messages = rig.frame()
    rig.vehicle.host.log_stream.grow(10)
    seqs += [piece.sequence for piece in pieces(rig.frame(2))]
    assert seqs == list(range(len(seqs)))


def test_definition_without_acknowledgement_is_sent_again_and_then_given_up(rig):
    rig.client.command(START, 0.0)
    sent = pieces(rig.frame(1 + RESEND_US // FRAME_US))
    assert [piece.sequence for piece in sent] == [0, 0]
    assert sent[0] == sent[1]
    rig.client.send("LOGGING_ACK", sequence=7)  # not this one
    assert {piece.sequence for piece in pieces(rig.frame(20))} == {0}
    said = texts(rig.frame(GIVE_UP_US // FRAME_US))
    assert said == ["Log streaming ended: the client does not acknowledge"]
    assert rig.vehicle.host.log_stream.writer.listeners == []


def test_data_is_paced(rig):
    stream_definitions(rig)
    rig.vehicle.host.log_stream.grow(500)
    assert len(pieces(rig.frame())) == PIECES_PER_FRAME
    assert len(pieces(rig.frame())) == PIECES_PER_FRAME


def test_client_that_falls_behind_loses_whole_records(rig):
    stream_definitions(rig)
    log = rig.vehicle.host.log_stream
    header = log.writer.header(0)
    log.grow(QUEUE_BYTES_MAX // 220 + 100)
    sent = pieces(rig.frame(5000))
    log.grow(1)
    sent += pieces(rig.frame(5))
    ulog = ULog(BytesIO(header + b"".join(bytes(piece.data[: piece.length]) for piece in sent)))
    heights = ulog.get_dataset("altitude").data["height"]
    assert heights[-1] == log.rows
    assert len(heights) < log.rows
    assert len(ulog.dropouts) == 1


def test_stop_ends_the_stream_of_its_sender(rig):
    stream_definitions(rig)
    assert rig.ack(STOP).result == mavlink.MAV_RESULT_ACCEPTED
    rig.vehicle.host.log_stream.grow(100)
    assert pieces(rig.frame(5)) == []
    assert rig.ack(STOP).result == mavlink.MAV_RESULT_ACCEPTED


def test_start_again_starts_from_the_definitions(rig):
    first = stream_definitions(rig)
    assert stream_definitions(rig) == first
    assert len(rig.vehicle.host.log_stream.writer.listeners) == 1


def test_refusals_say_why(rig):
    assert rig.ack(START, 1.0).result == mavlink.MAV_RESULT_DENIED
    rig.vehicle.host.log_stream = None
    assert rig.ack(START, 0.0).result == mavlink.MAV_RESULT_UNSUPPORTED


def test_fifth_client_is_refused_for_now(rig):
    for compid in range(100, 100 + CLIENTS_MAX):
        rig.client.compid = compid
        assert rig.ack(START, 0.0).result == mavlink.MAV_RESULT_ACCEPTED
    rig.client.compid = 190
    assert rig.ack(START, 0.0).result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED


@given(sizes=st.lists(st.integers(0, 700), min_size=1, max_size=30), is_whole=st.booleans())
def test_pieces_say_where_the_first_record_in_them_begins(sizes, is_whole):
    records = [size.to_bytes(2, "little") + b"D" + bytes(size) for size in sizes]
    starts = [sum(map(len, records[:i])) for i in range(len(records))]
    cutter = PieceCutter()
    for data in [b"".join(records)] if is_whole else records:
        cutter.add(data)
    at, content = 0, b""
    while (piece := cutter.take(is_last=True)) is not None:
        first, data = piece
        within = [start - at for start in starts if at <= start < at + len(data)]
        assert first == (within[0] if within else NO_START)
        at += len(data)
        content += data
    assert content == b"".join(records)
