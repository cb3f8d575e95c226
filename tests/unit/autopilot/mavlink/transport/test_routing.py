"""The vehicle joins its links into one network, by MAVLink's rules."""

import pytest

from autopilot.mavlink.server import MavlinkServer
from autopilot.mavlink.transport.links import memory_pair
from autopilot.mavlink.wire.codec import FrameReader, encode, frame_bytes, known_type, unknown_type
from tests.unit.autopilot.mavlink.rig import FRAME_US, AskedVehicle

OURS, STATION, SCRIPT, CAMERA = (1, 1), (255, 190), (245, 191), (1, 155)


class Network:
    """A vehicle with a station, a script and a foreign device of its own system on three links."""

    def __init__(self):
        pairs = [memory_pair() for _ in range(3)]
        self.vehicle = AskedVehicle()
        self.server = MavlinkServer(self.vehicle, [vehicle_end for vehicle_end, _ in pairs])
        self.ends = [client_end for _, client_end in pairs]
        self.time_us = 5_000_000
        for i, source in enumerate((STATION, SCRIPT, CAMERA)):
            self.send(i, encode("HEARTBEAT", *source, 0, type=30, autopilot=8))

    def send(self, i, frame):
        """Sends a frame on a link and returns what of others than the vehicle comes out of each."""
        self.ends[i].send(frame)
        for _ in range(2):
            self.time_us += FRAME_US
            self.server.frame(self.time_us)
        return self.others()

    def others(self):
        out = []
        for end in self.ends:
            reader = FrameReader(keeps_unknown=True)
            frames = [frame for data in end.receive() for frame in reader.feed(data, is_whole=True)]
            self.acks = [frame for frame in frames if frame.kind.name == "COMMAND_ACK"]
            out.append([frame.raw for frame in frames if (frame.sysid, frame.compid) != OURS])
        return out


@pytest.fixture
def network():
    return Network()


def command(source, target, seq=1):
    return encode(
        "COMMAND_LONG", *source, seq, target_system=target[0], target_component=target[1], command=400, param1=1.0
    )


def test_broadcast_goes_to_all_but_where_it_came_from(network):
    frame = encode("HEARTBEAT", *STATION, 1, type=6)
    assert network.send(0, frame) == [[], [frame], [frame]]


def test_what_is_for_us_alone_goes_nowhere(network):
    assert network.send(0, command(STATION, OURS)) == [[], [], []]
    assert network.vehicle.calls == [("arm", False)]


def test_target_goes_where_it_has_been_heard_and_nowhere_else(network):
    frame = command(STATION, SCRIPT)
    assert network.send(0, frame) == [[], [frame], []]
    assert network.vehicle.calls == []
    assert network.send(0, command(STATION, (77, 1), 2)) == [[], [], []]


def test_system_is_found_whatever_its_component(network):
    frame = command(STATION, (SCRIPT[0], 0))
    assert network.send(0, frame) == [[], [frame], []]


def test_message_to_our_whole_system_is_ours_and_our_other_devices(network):
    frame = command(STATION, (1, 0))
    assert network.send(0, frame) == [[], [], [frame]]
    assert network.vehicle.calls == [("arm", False)]


def test_message_to_a_device_of_our_system_on_another_link_is_not_answered_by_us(network):
    frame = command(STATION, CAMERA)
    assert network.send(0, frame) == [[], [], [frame]]
    assert network.vehicle.calls == []
    network.send(0, command(STATION, (1, 99), 2))
    assert network.acks == []
    assert network.vehicle.calls == []


def test_unknown_kinds_go_on_unchanged_with_their_signature(network):
    frame = frame_bytes(unknown_type(54_321), b"abcdef", 9, *STATION, flags=1) + bytes(range(13))
    # On a stream of bytes the frame behind it tells that it was one.
    after = encode("HEARTBEAT", *STATION, 10, type=6)
    assert network.send(0, frame + after) == [[], [frame, after], [frame, after]]


def test_mavlink_1_goes_on_unchanged_and_is_understood(network):
    from pymavlink.dialects.v20 import all as mavlink

    mav = mavlink.MAVLink(None, *STATION)
    ping = mav.ping_encode(7, 1, 0, 0).pack(mav, force_mavlink1=True)
    assert ping[0] == 0xFE
    assert network.send(0, bytes(ping)) == [[], [bytes(ping)], [bytes(ping)]]
    arm = mav.command_long_encode(1, 1, 400, 0, 1.0, 0, 0, 0, 0, 0, 0).pack(mav, force_mavlink1=True)
    network.send(0, bytes(arm))
    assert network.vehicle.calls == [("arm", False)]


@pytest.mark.parametrize("name", ["SETUP_SIGNING", "RADIO_STATUS"])
def test_what_concerns_one_link_is_not_passed_on(network, name):
    assert network.send(0, encode(name, *STATION, 1)) == [[], [], []]


def test_our_own_frames_that_come_back_are_not_passed_on(network):
    assert network.send(0, encode("HEARTBEAT", *OURS, 1, type=2)) == [[], [], []]


def test_loop_outside_stops_here(network):
    frame = encode("HEARTBEAT", *STATION, 1, type=6)
    assert network.send(0, frame) == [[], [frame], [frame]]
    assert network.send(1, frame) == [[], [], []]  # a router of the client's brought it back
    assert network.send(0, frame) == [[], [frame], [frame]]  # some clients never count
    network.send(1, command(SCRIPT, STATION, 2))
    assert network.send(2, command(CAMERA, STATION, 3))[1] == []  # and was not taken for the station's link


def test_devices_and_other_vehicles_are_not_greeted(network):
    for source, kind in ((CAMERA, 30), ((1, 154), 26), ((9, 1), 2)):
        network.ends[0].send(encode("HEARTBEAT", *source, 1, type=kind, autopilot=8))
        network.time_us += FRAME_US
        network.server.frame(network.time_us)
        names = [frame.kind.name for data in network.ends[0].receive() for frame in FrameReader().feed(data)]
        assert "STATUSTEXT" not in names


def test_senders_of_many_ids_are_remembered_only_so_far(network):
    for sysid in range(2, 250):
        network.ends[0].send(encode("HEARTBEAT", sysid, 1, 0, type=2))
    for _ in range(20):
        network.time_us += FRAME_US
        network.server.frame(network.time_us)
    network.others()
    frame = command(SCRIPT, (249, 1))
    assert network.send(1, frame) == [[frame], [], []]
    assert network.send(1, command(SCRIPT, (2, 1), 2)) == [[], [], []]


def test_one_component_more_is_ours_once_it_is_made(network):
    network.server._endpoint.compids.add(100)
    assert network.send(0, command(STATION, (1, 100))) == [[], [], []]


def test_known_type_knows_where_its_target_is():
    assert known_type("COMMAND_LONG").target_system_at == 30
    assert known_type("HEARTBEAT").target_system_at == -1
    assert FrameReader().feed(encode("MANUAL_CONTROL", *STATION, 0, target=7))[0].target() == (7, 0)
