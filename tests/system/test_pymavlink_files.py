"""pymavlink's own file transfer client, which MAVProxy's is made from, over UDP."""

import subprocess
import sys

import pytest
from pymavlink import mavutil
from pymavlink.mavftp import MAVFTP

from autopilot.params import parameter_table
from tests.system.vehicle import ROOT, free_ports

CONTENT = bytes(i * 7 % 251 for i in range(60_001))


@pytest.fixture
def ftp(tmp_path):
    port, _ = free_ports()
    master = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", source_system=255, dialect="ardupilotmega")
    command = [sys.executable, "-m", "tests.system.file_server", str(port), str(tmp_path / "files")]
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
