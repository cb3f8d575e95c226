"""A client's links, by their addresses: both directions, and an end that comes late or goes away."""

import os
import time
import tty
from select import select

import pytest

from autopilot.mavlink.transport.client_links import open_client_link
from autopilot.mavlink.transport.links import LinkError, LinkRole
from autopilot.mavlink.transport.tcp_port import TcpPort
from autopilot.mavlink.transport.udp_port import UdpPort
from autopilot.mavlink.wire.codec import encode
from tests.system.vehicle import free_ports

FRAME = encode("HEARTBEAT", 255, 190, 0, type=6, autopilot=8)  # the vehicle's ports look for a right one


@pytest.fixture
def opened():
    """Opens what is asked for, and closes it at the end."""
    ends = []

    def take(end):
        ends.append(end)
        return end

    yield take
    for end in ends:
        end.close()


def until(found, seconds=5.0):
    end_s = time.monotonic() + seconds
    while not (result := found()):
        assert time.monotonic() < end_s, "not in time"
        time.sleep(0.005)
    return result


def heard(port):
    """What has come to one of the vehicle's ports, and the link that it came by."""
    port.poll(0)
    return next(((link, data) for link in port.links if (data := list(link.receive()))), None)


def test_udpin_hears_who_sends_to_it_and_answers_them(opened):
    api_port, own_port = free_ports()
    link = opened(open_client_link(f"udpin://127.0.0.1:{api_port}"))
    link.send(b"nobody has been heard yet")
    vehicle = opened(UdpPort(api_port, LinkRole.ONBOARD, local_port=own_port))
    vehicle.links[0].send(b"telemetry")
    assert until(lambda: list(link.receive())) == [b"telemetry"]
    link.send(FRAME)
    assert until(lambda: heard(vehicle))[1] == [FRAME]


def test_udpout_speaks_first(opened):
    api_port, own_port = free_ports()
    vehicle = opened(UdpPort(api_port, LinkRole.ONBOARD, local_port=own_port))
    link = opened(open_client_link(f"udpout://127.0.0.1:{own_port}"))
    link.send(FRAME)
    until(lambda: heard(vehicle))[0].send(b"answer")
    assert until(lambda: list(link.receive())) == [b"answer"]


def test_tcp_connects_when_the_other_end_has_come_and_again_when_it_is_back(opened):
    port = free_ports()[0]
    link = opened(open_client_link(f"tcp://127.0.0.1:{port}"))

    def tell(vehicle):
        link.send(FRAME)
        link.receive()
        return heard(vehicle)

    link.send(FRAME)
    link.receive()  # nobody there yet
    for _ in range(2):
        vehicle = TcpPort(port)
        until(lambda vehicle=vehicle: tell(vehicle))[0].send(b"answer")
        assert until(lambda: list(link.receive())) == [b"answer"]
        vehicle.close()


@pytest.fixture
def plugged(tmp_path):
    """Plugs a cable into `/…/ttyACM0`: the vehicle's end; the other is pulled out when the function is called again."""
    port, ends = tmp_path / "ttyACM0", []

    def plug():
        unplug()
        ends[:] = os.openpty()
        tty.setraw(ends[0])
        port.symlink_to(os.ttyname(ends[1]))
        return port, ends[0]

    def unplug():
        port.unlink(missing_ok=True)
        while ends:
            os.close(ends.pop())

    yield plug
    unplug()


def test_serial_speaks_over_a_cable_both_ways_and_again_when_it_is_back(opened, plugged):
    port, vehicle = plugged()
    link = opened(open_client_link(f"serial://{port}:57600"))
    link.send(b"request")
    assert os.read(vehicle, 100) == b"request"
    os.write(vehicle, FRAME)
    assert until(lambda: list(link.receive())) == [FRAME]
    _, vehicle = plugged()
    assert list(link.receive()) == []  # that cable was pulled out
    link.send(b"request")
    assert os.read(vehicle, 100) == b"request"


def test_a_serial_port_that_another_program_has_is_one_sentence(opened):
    vehicle, cable = os.openpty()
    opened(open_client_link(f"serial://{os.ttyname(cable)}:57600"))
    with pytest.raises(LinkError, match="cannot be opened at 57600 baud"):
        open_client_link(f"serial://{os.ttyname(cable)}:57600")
    os.close(cable)
    os.close(vehicle)


@pytest.mark.parametrize("scheme", ["udpout", "udpin", "tcp"])
def test_an_unknown_host_is_one_sentence(scheme):
    with pytest.raises(LinkError, match="the host nobody"):
        open_client_link(f"{scheme}://nobody.invalid:14540")


def test_serial_goes_on_while_the_other_end_does_not_read(opened, plugged):
    port, vehicle = plugged()
    link = opened(open_client_link(f"serial://{port}:57600"))
    for _ in range(2_000):  # far more than the cable takes
        link.send(FRAME)
        assert list(link.receive()) == []
    while select([vehicle], [], [], 0.2)[0]:
        os.read(vehicle, 1 << 16)
    link.send(FRAME)
