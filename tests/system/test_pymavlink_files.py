"""pymavlink's own file transfer client, which MAVProxy's is made from, over UDP."""

import threading
from time import sleep

import pytest
from pymavlink import mavutil
from pymavlink.mavftp import MAVFTP

from autopilot.mavlink.links import UdpLink
from autopilot.mavlink.server import MavlinkServer
from common.folder import ConfinedFolder
from tests.system.vehicle import free_ports
from tests.unit.autopilot.mavlink.rig import RecordingVehicle

FRAME_US = 20_000
FRAME_WALL_S = 0.004
CONTENT = bytes(i * 7 % 251 for i in range(60_001))


@pytest.fixture
def vehicle(tmp_path):
    vehicle = RecordingVehicle()
    vehicle.host.files = ConfinedFolder(tmp_path / "files")
    return vehicle


@pytest.fixture
def ftp(vehicle):
    port, _ = free_ports()
    master = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", source_system=255, dialect="ardupilotmega")
    server = MavlinkServer(vehicle, [UdpLink(port)])
    is_over = threading.Event()

    def serve():
        while not is_over.is_set():
            vehicle.state.time_us += FRAME_US
            server.frame(vehicle.state.time_us)
            sleep(FRAME_WALL_S)

    thread = threading.Thread(target=serve)
    thread.start()
    assert master.wait_heartbeat(timeout=20.0) is not None
    yield MAVFTP(master, 1, 1)
    is_over.set()
    thread.join()
    server.close()
    master.close()


def done(ftp, result, what):
    """Whether the command succeeded, its replies included."""
    assert result.error_code == 0, what
    reply = ftp.process_ftp_reply(what, timeout=20)
    assert reply.error_code == 0, (what, reply.error_code)


@pytest.mark.slow
@pytest.mark.parametrize("loss_percent", [0, 2])
def test_file_goes_up_and_comes_down(ftp, vehicle, tmp_path, loss_percent):
    ftp.ftp_settings.pkt_loss_tx = ftp.ftp_settings.pkt_loss_rx = loss_percent
    (tmp_path / "up.bin").write_bytes(CONTENT)
    assert ftp.cmd_mkdir(["d"]).error_code == 0  # waits for its reply by itself
    done(ftp, ftp.cmd_put([str(tmp_path / "up.bin"), "d/a.bin"]), "CreateFile")
    assert (tmp_path / "files/d/a.bin").read_bytes() == CONTENT
    done(ftp, ftp.cmd_get(["d/a.bin", str(tmp_path / "down.bin")]), "OpenFileRO")
    assert (tmp_path / "down.bin").read_bytes() == CONTENT


def test_parameters_come_as_one_file(ftp, vehicle, tmp_path):
    done(ftp, ftp.cmd_get(["@PARAM/param.pck", str(tmp_path / "param.pck")]), "OpenFileRO")
    decoded = MAVFTP.ftp_param_decode((tmp_path / "param.pck").read_bytes())
    assert [name.decode() for name, _, _ in decoded.params] == vehicle.params.names
