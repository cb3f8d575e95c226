"""MAVSDK's file plugins against the server, in this process."""

import pytest
from mavsdk.plugins.ftp import FilesystemEntry, Ftp, FtpError, FtpResult

from common.folder import ConfinedFolder
from tests.system.raw_mavsdk import Outcome, RawMavsdk, served
from tests.unit.autopilot.mavlink.rig import RecordingVehicle

FILE, DIRECTORY = FilesystemEntry.EntryType.FILE, FilesystemEntry.EntryType.DIRECTORY
LONG = bytes(i * 7 % 251 for i in range(100_001))  # three bursts and a bit


@pytest.fixture
def vehicle(tmp_path):
    vehicle = RecordingVehicle()
    vehicle.host.files = ConfinedFolder(tmp_path / "files")
    return vehicle


@pytest.fixture
def mavsdk(vehicle):
    with RawMavsdk(served(vehicle)) as mavsdk:
        yield mavsdk


def test_files_go_up_and_down_and_are_managed(mavsdk, tmp_path):
    ftp = Ftp(mavsdk.system)
    (tmp_path / "long.bin").write_bytes(LONG)
    upload = Outcome(FtpResult.NEXT)
    ftp.create_directory("/d")
    ftp.upload_async(str(tmp_path / "long.bin"), "/d", upload)
    assert upload.wait() == FtpResult.SUCCESS
    assert (tmp_path / "files/d/long.bin").read_bytes() == LONG
    assert ftp.are_files_identical(str(tmp_path / "long.bin"), "/d/long.bin")
    ftp.rename("/d/long.bin", "/moved.bin")
    for use_burst in (False, True):
        folder = tmp_path / f"down{use_burst}"
        folder.mkdir()
        download = Outcome(FtpResult.NEXT)
        ftp.download_async("/moved.bin", str(folder), use_burst, download)
        assert download.wait() == FtpResult.SUCCESS
        assert (folder / "moved.bin").read_bytes() == LONG
    entries = ftp.list_directory("/").entries
    time_s = int((tmp_path / "files/moved.bin").stat().st_mtime)
    assert [(entry.name, entry.entry_type) for entry in entries] == [("d", DIRECTORY), ("moved.bin", FILE)]
    assert (entries[1].size_bytes, entries[1].modification_time_s) == (len(LONG), time_s)
    (tmp_path / "moved.bin").write_bytes(LONG[:-1])
    assert not ftp.are_files_identical(str(tmp_path / "moved.bin"), "/moved.bin")
    ftp.remove_file("/moved.bin")
    ftp.remove_directory("/d")
    with pytest.raises(FtpError) as caught:
        ftp.remove_file("/moved.bin")
    assert caught.value.result == FtpResult.FILE_DOES_NOT_EXIST
    with pytest.raises(FtpError) as caught:
        ftp.list_directory("../..")
    assert caught.value.result == FtpResult.FILE_PROTECTED
    assert list((tmp_path / "files").iterdir()) == []
