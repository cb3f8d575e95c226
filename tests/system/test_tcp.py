"""A client that connects over TCP, as Mission Planner does with ArduPilot."""

import socket

import pytest
from pymavlink import mavutil

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
