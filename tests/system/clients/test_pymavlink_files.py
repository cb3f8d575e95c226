"""pymavlink's own file transfer client, which MAVProxy's is made from, over UDP."""

import struct
import subprocess
import sys

import pytest
from pymavlink import mavutil
from pymavlink.mavftp import MAVFTP

from autopilot.params import parameter_table
from tests.system.vehicle import ROOT, free_ports

CONTENT = bytes(i * 7 % 251 for i in range(60_001))


@pytest.fixture
def dialect():
    return "px4"


@pytest.fixture
def ftp(tmp_path, dialect):
    port, _ = free_ports()
    master = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", source_system=255, dialect="ardupilotmega")
    command = [sys.executable, "-m", "tests.system.clients.file_server", str(port), str(tmp_path / "files"), dialect]
    server = subprocess.Popen(command, cwd=ROOT)
    assert master.wait_heartbeat(timeout=60.0) is not None
    yield MAVFTP(master, 1, 1)
    server.terminate()
    server.wait(10.0)
    master.close()


def done(ftp, result, what):
    """Whether the command succeeded, its replies included."""
    assert result.error_code == 0, what
    reply = ftp.process_ftp_reply(what, timeout=20)
    assert reply.error_code == 0, (what, reply.error_code)


@pytest.mark.slow
@pytest.mark.parametrize("loss_percent", [0, 2])
def test_file_goes_up_and_comes_down(ftp, tmp_path, loss_percent):
    ftp.ftp_settings.pkt_loss_tx = ftp.ftp_settings.pkt_loss_rx = loss_percent
    (tmp_path / "up.bin").write_bytes(CONTENT)
    assert ftp.cmd_mkdir(["d"]).error_code == 0  # waits for its reply by itself
    done(ftp, ftp.cmd_put([str(tmp_path / "up.bin"), "d/a.bin"]), "CreateFile")
    assert (tmp_path / "files/d/a.bin").read_bytes() == CONTENT
    done(ftp, ftp.cmd_get(["d/a.bin", str(tmp_path / "down.bin")]), "OpenFileRO")
    assert (tmp_path / "down.bin").read_bytes() == CONTENT


def test_parameters_come_as_one_file(ftp, tmp_path):
    done(ftp, ftp.cmd_get(["@PARAM/param.pck", str(tmp_path / "param.pck")]), "OpenFileRO")
    decoded = MAVFTP.ftp_param_decode((tmp_path / "param.pck").read_bytes())
    assert [name.decode() for name, _, _ in decoded.params] == parameter_table().names


@pytest.mark.parametrize("dialect", ["ardupilot"])
def test_mission_goes_up_and_comes_down_as_ardupilots_file(ftp, tmp_path):
    message = mavutil.mavlink.MAVLink_mission_item_int_message
    data = struct.pack("<5H", 0x763D, 0, 0, 0, 3)
    for seq, command in enumerate((16, 22, 16)):
        item = message(1, 1, seq, 3, command, 0, 1, 0, 0, 0, 0, 473_977_420, 85_455_940, 10.0, 0)
        data += message.unpacker.pack(*(getattr(item, name) for name in message.ordered_fieldnames))
    (tmp_path / "up.dat").write_bytes(data)
    done(ftp, ftp.cmd_put([str(tmp_path / "up.dat"), "@MISSION/mission.dat"]), "CreateFile")
    done(ftp, ftp.cmd_get(["@MISSION/mission.dat", str(tmp_path / "down.dat")]), "OpenFileRO")
    back = (tmp_path / "down.dat").read_bytes()
    assert len(back) == len(data)
    assert back[10 + 38 :][:28] == data[10 + 38 :][:28]  # parameters and place of the take-off; item 0 is home
