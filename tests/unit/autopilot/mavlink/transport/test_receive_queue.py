"""No client gets more of a frame than its share."""

from autopilot.mavlink.transport.links import memory_pair
from autopilot.mavlink.transport.receive_queue import BYTES_MAX, WORK_MAX, WORK_MIN, Intake, fraction
from autopilot.mavlink.wire.codec import encode
from tests.unit.autopilot.mavlink.rig import Rig

PING = encode("PING", 255, 190, 0, time_usec=1)


def taken(intake, work_max=WORK_MAX):
    """How many frames one frame of the vehicle takes."""
    count = 0
    if intake.fill():
        while intake.next(work_max) is not None:
            count += 1
    return count


def test_excess_waits_for_the_next_frames_and_keeps_its_order():
    vehicle, client = memory_pair()
    intake = Intake(vehicle)
    for i in range(250):
        client.send(encode("PING", 255, 190, i, time_usec=i))
    assert [taken(intake) for _ in range(4)] == [100, 100, 50, 0]
    assert not intake.fill()


def test_one_large_piece_is_shared_out_too():
    vehicle, client = memory_pair()
    intake = Intake(vehicle)
    client.send(PING * 130)
    assert [taken(intake) for _ in range(3)] == [100, 30, 0]


def test_rubbish_costs_work():
    vehicle, client = memory_pair()
    intake = Intake(vehicle)
    for _ in range(1_000):
        client.send(b"\xfe" * 64)
    client.send(bytes(300))  # completes what the last false start has announced
    client.send(PING)
    assert taken(intake) == 0
    assert 0 < intake.work <= WORK_MAX + 16
    counts = [taken(intake) for _ in range(400)]
    assert sum(counts) == 1
    assert counts.index(1) > 30


def test_bytes_of_one_frame_are_bounded():
    vehicle, client = memory_pair()
    intake = Intake(vehicle)
    for _ in range(40):
        client.send(b"\x00" * 1024)
    client.send(PING)
    assert [taken(intake) for _ in range(3)] == [0, 0, 1]
    assert BYTES_MAX == 16 * 1024


def test_shares_are_fair_and_never_nothing():
    assert fraction(1) == WORK_MAX
    assert fraction(8) == 32
    assert fraction(1000) == WORK_MIN


def test_flood_of_one_client_does_not_delay_the_answer_to_another():
    rig = Rig()
    for _ in range(20_000):
        rig.client.command(9999)
    rig.second_client.command(9998)
    rig.frame()
    acks = [message.fields.command for message in rig.second_client.received() if message.name == "COMMAND_ACK"]
    assert acks == [9998]
    rig.second_client.command(9997)
    acked = rig.frame()
    assert 10 <= sum(message.name == "COMMAND_ACK" for message in acked) <= WORK_MAX


def test_texts_that_a_flood_causes_go_to_the_flooding_client():
    rig = Rig()
    for i in range(2_000):
        rig.client.command(40_000 + i)
    own, others = 0, 0
    for _ in range(100):
        own += sum(message.name == "STATUSTEXT" for message in rig.frame())
        others += sum(message.name == "STATUSTEXT" for message in rig.second_client.received())
    assert own > 500
    assert others < 40
