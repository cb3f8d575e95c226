"""UDP and TCP on loopback, where a datagram is there as soon as it is sent."""

import socket
from contextlib import ExitStack

import pytest

from autopilot.mavlink.server import MavlinkServer
from autopilot.mavlink.transport.links import GIVE_WAY_US, LinkError, LinkRole, UdpLink
from autopilot.mavlink.transport.tcp_port import PEERS_MAX as TCP_PEERS_MAX
from autopilot.mavlink.transport.tcp_port import PROOF_MAX, UNSENT_MAX, TcpPort
from autopilot.mavlink.transport.udp_port import PEERS_MAX, UdpPort
from autopilot.mavlink.wire.codec import FrameReader, decode, encode
from tests.unit.autopilot.mavlink.rig import FRAME_US, AskedVehicle

LOOPBACK = "127.0.0.1"
HELLO = encode("HEARTBEAT", 255, 190, 0, type=6, autopilot=8)


def udp_socket():
    client = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    client.bind((LOOPBACK, 0))
    client.settimeout(5.0)
    return client


@pytest.fixture
def listener():
    with udp_socket() as client:
        yield client


@pytest.fixture
def port(listener):
    port = UdpPort(listener.getsockname()[1])
    yield port
    port.close()


def received(port, time_us=0):
    """What each link brings."""
    port.poll(time_us)
    return [list(link.receive()) for link in port.links]


def speak(client, port, data=HELLO):
    client.sendto(data, (LOOPBACK, port.local_port))


def test_vehicle_speaks_first(listener, port):
    (link,) = port.links
    link.send(b"hello")
    assert listener.recv(100) == b"hello"


def test_datagrams_come_in_order(listener, port):
    speak(listener, port, b"1")
    speak(listener, port, b"2")
    assert received(port) == [[b"1", b"2"]]
    assert received(port) == [[]]


def test_everyone_who_speaks_has_a_link_of_their_own(listener, port):
    with udp_socket() as other:
        speak(other, port)
        speak(listener, port, b"first")
        assert received(port) == [[b"first"], [HELLO]]
        first, second = port.links
        assert first.is_trusted
        assert second.is_trusted
        second.send(b"only you")
        first.send(b"you")
        assert other.recv(100) == b"only you"
        assert listener.recv(100) == b"you"
        speak(other, port, b"again")
        assert received(port) == [[], [b"again"]]


@pytest.mark.parametrize(
    "rubbish", [b"GET / HTTP/1.1", b"", b"\xfd", b"\xfe", HELLO[:-1], HELLO[:-1] + b"x", b"x" + HELLO, bytes(5000)]
)
def test_what_is_no_right_frame_makes_no_link_and_is_sent_nothing(listener, port, rubbish):
    server = MavlinkServer(AskedVehicle(), [port])
    with udp_socket() as other:
        speak(other, port, rubbish)
        for i in range(100):
            server.frame(5_000_000 + i * FRAME_US)
        assert len(port.links) == 1
        other.setblocking(False)
        with pytest.raises(BlockingIOError):
            other.recv(100)


def test_newcomers_do_not_evict_a_client_with_heartbeats(listener, port):
    with ExitStack() as stack:
        pilot = stack.enter_context(udp_socket())
        for second in range(20):
            speak(pilot, port)
            for data in (b"\xfd", HELLO):
                for _ in range(PEERS_MAX + 8):
                    with udp_socket() as newcomer:
                        speak(newcomer, port, data)
            received(port, second * 1_000_000)
        assert len(port.links) == PEERS_MAX
        for link in port.links:
            link.send(b"still")
        assert pilot.recv(100) == b"still"


def test_client_silent_for_long_is_forgotten_and_the_first_stays(listener, port):
    with udp_socket() as other:
        speak(other, port)
        received(port, 1_000_000)
        assert len(port.links) == 2
        speak(other, port)
        received(port, 100_000_000)
        received(port, 219_000_000)
        assert len(port.links) == 2
        gone = port.links[1]
        received(port, 222_000_000)
        assert len(port.links) == 1
        gone.send(b"into the void")
        port.links[0].send(b"still")
        assert listener.recv(100) == b"still"


def test_clients_are_bounded_and_the_one_heard_longest_ago_gives_way(listener, port):
    with ExitStack() as stack:
        others = [stack.enter_context(udp_socket()) for _ in range(PEERS_MAX + 4)]
        for i, other in enumerate(others):
            speak(other, port)
            received(port, i * 1_000_000)
        assert len(port.links) == PEERS_MAX
        for link in port.links:
            link.send(b"last")
        assert listener.recv(100) == b"last"
        assert others[-1].recv(100) == b"last"
        others[4].setblocking(False)
        with pytest.raises(BlockingIOError):
            others[4].recv(100)
        assert others[5].recv(100) == b"last"


def test_flood_of_one_client_loses_nothing_of_another(listener, port):
    with udp_socket() as other:
        speak(other, port)
        received(port)
        for _ in range(5_000):
            speak(listener, port)
        speak(other, port, b"me")
        assert received(port)[1] == [b"me"]


def test_port_in_use_is_one_clear_sentence(listener, port):
    number = port.local_port
    for make in (UdpPort, UdpLink):
        with pytest.raises(LinkError, match=rf"^MAVLink: UDP port {number} is in use \(.*\)\.$"):
            make(14550, local_port=number)
    tcp = TcpPort(0)
    with pytest.raises(LinkError, match=rf"^MAVLink: TCP port {tcp.local_port} is in use \(.*\)\.$"):
        TcpPort(tcp.local_port)
    tcp.close()


def test_port_number_out_of_range_is_one_clear_sentence():
    for make in (UdpPort, UdpLink):
        with pytest.raises(LinkError, match=r"70000 is not between"):
            make(14550, local_port=70_000)


def test_unknown_host_is_one_clear_sentence():
    for make in (UdpPort, UdpLink):
        with pytest.raises(LinkError, match=r"the host no-such-host\.invalid is unknown"):
            make(14550, host="no-such-host.invalid")


def test_address_of_another_machine_is_one_clear_sentence():
    with pytest.raises(LinkError, match=r"192\.0\.2\.1 is no address of this machine"):
        UdpPort(14550, bind="192.0.2.1")


def test_sending_to_nobody_is_no_error():
    with udp_socket() as probe:
        number = probe.getsockname()[1]
    port = UdpPort(number)
    for _ in range(3):
        port.links[0].send(b"x")
        assert received(port) == [[]]
    port.close()
    link = UdpLink(number)
    link.send(b"x")
    link.send(b"y")
    assert list(link.receive()) == []
    link.close()


def test_tcp_client_comes_speaks_and_goes():
    port = TcpPort(0)
    with socket.create_connection((LOOPBACK, port.local_port), 5.0) as client:
        port.poll(0)
        (link,) = port.links
        client.sendall(HELLO[:9])
        assert received(port) == [[]]
        client.sendall(HELLO[9:] + b"ab")
        assert received(port) == [[HELLO + b"ab"]]
        link.send(b"cd")
        assert client.recv(100) == b"cd"
    received(port)
    received(port)
    assert list(port.links) == []
    link.send(b"void")
    port.close()


def test_tcp_client_that_does_not_read_costs_a_bounded_queue_and_then_whole_frames():
    port = TcpPort(0)
    with socket.create_connection((LOOPBACK, port.local_port), 5.0) as client:
        port.poll(0)
        client.sendall(HELLO)
        received(port)
        (link,) = port.links
        for i in range(200_000):
            link.send(encode("ATTITUDE", 1, 1, i & 0xFF, i, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6))
        assert len(link._unsent) <= UNSENT_MAX
        reader, times = FrameReader(), []
        client.settimeout(0.2)
        for _ in range(10_000):
            port.poll(0)
            try:
                data = client.recv(1 << 20)
            except TimeoutError:
                break
            times += [decode(frame).fields.time_boot_ms for frame in reader.feed(data)]
        assert len(times) > 1_000
        assert times == list(range(len(times)))
        assert reader.bad_byte_count == 0
    port.close()


def over_tcp(port, client, frames=100):
    """What a client hears of a vehicle behind the port."""
    server, reader, messages = MavlinkServer(AskedVehicle(), [port]), FrameReader(), []
    for i in range(frames):
        server.frame(5_000_000 + i * FRAME_US)
    client.settimeout(0.1)
    try:
        while data := client.recv(1 << 16):
            messages += [decode(frame) for frame in reader.feed(data)]
    except (TimeoutError, ConnectionError):
        return server, messages
    return server, messages


ARM = encode("COMMAND_LONG", 255, 190, 0, target_system=1, target_component=1, command=400, param1=1.0, param2=21196.0)


@pytest.mark.parametrize(
    "head",
    [
        b"POST / HTTP/1.1\r\nOrigin: https://evil.example\r\nContent-Length: 50\r\n\r\n", b"GET / HTTP/1.1\r\n\r\n",
        b"\x16\x03\x01", b"x", b"\xfd" + bytes(PROOF_MAX),
    ],
)  # fmt: skip
def test_tcp_client_that_does_not_begin_with_mavlink_is_closed_and_not_obeyed(head):
    port = TcpPort(0)
    with socket.create_connection((LOOPBACK, port.local_port), 5.0) as client:
        client.sendall(head + ARM)
        server, messages = over_tcp(port, client)
        assert {message.name for message in messages} <= {"HEARTBEAT"}
        assert list(port.links) == []
        server.close()


def test_tcp_client_that_says_nothing_hears_heartbeats_and_after_its_first_frame_everything():
    port = TcpPort(0)
    with socket.create_connection((LOOPBACK, port.local_port), 5.0) as client:
        server, messages = over_tcp(port, client)
        assert {message.name for message in messages} == {"HEARTBEAT"}
        client.sendall(ARM)
        for i in range(100, 200):
            server.frame(5_000_000 + i * FRAME_US)
        reader, names = FrameReader(), set()
        with pytest.raises(TimeoutError):
            while True:
                names |= {decode(frame).name for frame in reader.feed(client.recv(1 << 16))}
        assert {"HEARTBEAT", "ATTITUDE", "COMMAND_ACK"} <= names
        server.close()


def test_a_thousand_idle_tcp_connections_do_not_evict_a_client_that_speaks():
    port = TcpPort(0)
    with ExitStack() as stack, socket.create_connection((LOOPBACK, port.local_port), 5.0) as pilot:
        pilot.sendall(HELLO)
        received(port)
        (link,) = port.links
        for i in range(1_000):
            idle = stack.enter_context(socket.socket())
            idle.setblocking(False)
            idle.connect_ex((LOOPBACK, port.local_port))
            if i % 3 == 0:
                received(port, i * FRAME_US)
            if i % 50 == 0:
                pilot.sendall(HELLO)
        assert link in port.links
        assert len(port.links) <= TCP_PEERS_MAX
    port.close()


def test_a_tcp_newcomer_gets_the_place_of_one_that_has_said_nothing_else_of_one_long_silent():
    port = TcpPort(0)
    with ExitStack() as stack:

        def come(data, time_us):
            client = stack.enter_context(socket.create_connection((LOOPBACK, port.local_port), 5.0))
            client.sendall(data)
            received(port, time_us)
            received(port, time_us)
            return client

        come(b"\xfd", 0)
        for _ in range(TCP_PEERS_MAX - 1):
            come(HELLO, 1)
        come(HELLO, 2)  # instead of the first
        assert all(link.is_heard for link in port.links)
        before = set(port.links)
        come(HELLO, 3)
        assert set(port.links) == before
        come(HELLO, 2 + GIVE_WAY_US)
        assert len(set(port.links) - before) == 1
    port.close()


def test_each_udp_client_has_its_own_intervals_sequence_and_answers(listener):
    port = UdpPort(listener.getsockname()[1], LinkRole.ONBOARD)
    server = MavlinkServer(AskedVehicle(), [port])

    def heard(client):
        reader, messages = FrameReader(), []
        client.settimeout(0.05)
        while True:
            try:
                messages += [decode(frame) for frame in reader.feed(client.recv(2000))]
            except TimeoutError:
                return messages

    with udp_socket() as other:
        ask = {"target_system": 1, "target_component": 1, "command": 511, "param1": 30.0, "param2": -1.0}
        speak(other, port, encode("COMMAND_LONG", 200, 190, 0, **ask))
        for i in range(50):
            server.frame(5_000_000 + i * FRAME_US)
        first, second = heard(listener), heard(other)
        server.close()
    assert [message.name for message in second].count("COMMAND_ACK") == 1
    assert "COMMAND_ACK" not in {message.name for message in first}
    assert "ATTITUDE" in {message.name for message in first}
    assert "ATTITUDE" not in {message.name for message in second}
    for messages in (first, second):
        assert [message.seq for message in messages] == [i & 0xFF for i in range(len(messages))]
