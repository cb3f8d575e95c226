"""UDP on loopback, where a datagram is there as soon as it is sent."""

import socket

import pytest

from autopilot.mavlink.links import PEERS_MAX, LinkError, UdpLink


@pytest.fixture
def listener():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.bind(("127.0.0.1", 0))
        client.settimeout(5.0)
        yield client


@pytest.fixture
def link(listener):
    link = UdpLink(listener.getsockname()[1])
    yield link
    link.close()


def test_vehicle_speaks_first(listener, link):
    link.send(b"hello")
    assert listener.recv(100) == b"hello"


def test_datagrams_come_in_order(listener, link):
    for data in (b"1", b"2"):
        listener.sendto(data, ("127.0.0.1", link.local_port))
    assert list(link.receive()) == [b"1", b"2"]
    assert list(link.receive()) == []


def test_everyone_who_answers_is_sent_to(listener, link):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.settimeout(5.0)
        other.sendto(b"me too", ("127.0.0.1", link.local_port))
        link.receive()
        link.receive()
        link.send(b"all")
        assert other.recv(100) == b"all"
        assert listener.recv(100) == b"all"


def test_peers_are_bounded_and_the_first_stays(listener, link):
    others = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(PEERS_MAX + 4)]
    for other in others:
        other.settimeout(5.0)
        other.sendto(b"x", ("127.0.0.1", link.local_port))
    assert len(link.receive()) == len(others)
    link.send(b"last")
    assert listener.recv(100) == b"last"
    assert others[-1].recv(100) == b"last"
    others[0].setblocking(False)
    with pytest.raises(BlockingIOError):
        others[0].recv(100)
    for other in others:
        other.close()


def test_port_in_use_is_one_clear_sentence(listener):
    port = listener.getsockname()[1]
    with pytest.raises(LinkError, match=rf"^MAVLink: UDP port {port} is in use \(.*\)\.$"):
        UdpLink(14550, local_port=port)


def test_port_number_out_of_range_is_one_clear_sentence():
    with pytest.raises(LinkError, match=r"70000 is not between"):
        UdpLink(14550, local_port=70_000)


def test_unknown_host_is_one_clear_sentence():
    with pytest.raises(LinkError, match=r"the host no-such-host\.invalid is unknown"):
        UdpLink(14550, host="no-such-host.invalid")


def test_sending_to_nobody_is_no_error():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    link = UdpLink(port)
    link.send(b"x")
    link.send(b"y")
    assert list(link.receive()) == []
    link.close()
