"""What the tests of file transfer share: a vehicle with a folder, and a client of it."""

import pytest

from common.folder import ConfinedFolder
from tests.unit.autopilot.mavlink.rig import Rig
from tests.unit.autopilot.mavlink.services.files.ftp_rig import FtpClient


@pytest.fixture
def root(tmp_path):
    root = tmp_path / "files"
    root.mkdir()
    return root


@pytest.fixture
def rig(root):
    rig = Rig()
    rig.vehicle.host.files = ConfinedFolder(root, quota_bytes=100_000)
    return rig


@pytest.fixture
def ftp(rig):
    return FtpClient(rig)
