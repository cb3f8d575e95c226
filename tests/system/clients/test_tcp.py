"""A client that connects over TCP, as Mission Planner does with ArduPilot."""

import socket
from contextlib import suppress

import pytest
from pymavlink import mavutil

from autopilot.mavlink.transport.links import LinkRole
from autopilot.mavlink.transport.tcp_port import UNSENT_MAX, TcpPeer
from tests.system.vehicle import IdleVehicle


def free_tcp_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.mark.slow  # a process, on the wall clock
def test_client_connects_asks_and_is_answered(tmp_path):
    port = free_tcp_port()
    with IdleVehicle(tmp_path, "--trees", 0, "--tcp-port", port):
        client = mavutil.mavlink_connection(f"tcp:127.0.0.1:{port}", retries=60, source_system=255)
        heartbeat = client.wait_heartbeat(timeout=30.0)
        assert heartbeat is not None
        client.mav.command_long_send(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0)
        ack = client.recv_match(type="COMMAND_ACK", blocking=True, timeout=10.0)
        assert (ack.command, ack.result, ack.target_system) == (512, 0, 255)
        assert client.recv_match(type="AUTOPILOT_VERSION", blocking=True, timeout=10.0) is not None
        client.close()


def test_what_a_client_does_not_read_is_kept_up_to_a_bound_and_in_whole_frames():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        theirs = socket.create_connection(listener.getsockname())
        ours, _ = listener.accept()
    peer = TcpPeer(ours, "127.0.0.1", LinkRole.GROUND, 0)
    sent = 0
    for i in range(100_000):  # 10 MB: more than the sockets and the queue hold
        peer.send(i.to_bytes(4, "little") * 25)
        sent += 100
        assert len(peer._unsent) <= UNSENT_MAX
    assert not peer.is_over
    assert len(peer._unsent) > UNSENT_MAX - 100
    peer.flush()
    theirs.settimeout(0.2)
    received = b""
    with suppress(TimeoutError):
        while piece := theirs.recv(1 << 20):
            received += piece
            peer.flush()
    assert 0 < len(received) < sent
    frames = [received[at : at + 100] for at in range(0, len(received), 100)]
    assert all(frame == frame[:4] * 25 for frame in frames)
    peer.close()
    theirs.close()
