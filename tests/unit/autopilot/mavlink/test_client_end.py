"""What every MAVLink client of a vehicle shares, against what the vehicle's end of the link hears and says."""

import pytest

from autopilot.mavlink.client_end import GROUND_STATION, ClientEnd, frame_of
from autopilot.mavlink.transport.links import memory_pair
from autopilot.mavlink.wire.codec import FrameReader, decode, encode, known_type

ARM = 400


class Pipe:
    """A link that hands on what the test puts in, in its pieces."""

    def __init__(self):
        self.pieces = []

    def send(self, _):
        raise AssertionError("nobody sends here")

    def receive(self):
        return self.pieces

    def close(self):
        """Has nothing to give back."""


@pytest.fixture
def ends():
    vehicle, link = memory_pair()
    return vehicle, ClientEnd(link, 245, 190, mav_type=GROUND_STATION, vehicle_id=7)


def heard(vehicle):
    reader = FrameReader()
    return [decode(frame) for data in vehicle.receive() for frame in reader.feed(data)]


def test_a_heartbeat_goes_out_at_once_and_then_once_a_second(ends):
    vehicle, client = ends
    for time_us in range(3_000_000, 6_000_001, 20_000):
        client.keep_alive(time_us)
    beats = heard(vehicle)
    assert [(each.name, each.sysid, each.compid, each.fields.type) for each in beats] == [
        ("HEARTBEAT", 245, 190, 6)
    ] * 4
    assert [each.seq for each in beats] == [1, 2, 3, 4]


def test_a_command_is_addressed_to_the_vehicle_s_autopilot(ends):
    vehicle, client = ends
    client.command(ARM, 1.0, attempt=2)
    (sent,) = heard(vehicle)
    fields = sent.fields
    assert (fields.target_system, fields.target_component, fields.command, fields.confirmation) == (7, 1, ARM, 2)
    assert (fields.param1, fields.param7) == (1.0, 0.0)


@pytest.mark.parametrize(
    ("command", "target", "is_ours"),
    [
        (ARM, (245, 190), True),
        (ARM, (0, 0), True),
        (ARM, (245, 191), False),
        (ARM, (255, 190), False),
        (22, (0, 0), False),
    ],
)
def test_an_acknowledgement_is_for_who_it_names_or_for_everybody(ends, command, target, is_ours):
    _, client = ends
    ack = known_type("COMMAND_ACK").unpack(known_type("COMMAND_ACK").pack(command, 0, 0, 0, *target))
    assert client.is_answer(ack, ARM) is is_ours


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_frames_arrive_whatever_pieces_they_come_in(size):
    pipe = Pipe()
    client = ClientEnd(pipe, 245, 190)
    stream = b"".join(encode("SYSTEM_TIME", 1, 1, seq, time_boot_ms=seq) for seq in range(3))
    reported = []
    for at in range(0, len(stream), size):
        pipe.pieces = [stream[at : at + size]]
        reported += [decode(frame_of(each.frame)).fields.time_boot_ms for each in client.arrived()]
    assert reported == [0, 1, 2]


def test_what_arrives_in_memory_is_what_was_sent_by_whom(ends):
    vehicle, client = ends
    vehicle.send(encode("SYSTEM_TIME", 7, 154, 0, time_boot_ms=5))
    (arrived,) = client.arrived()
    assert (arrived.msg_id, arrived.sysid, arrived.compid) == (2, 7, 154)
    assert decode(frame_of(arrived.frame)).fields.time_boot_ms == 5
    assert not list(client.arrived())
