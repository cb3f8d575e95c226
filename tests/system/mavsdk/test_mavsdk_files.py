"""MAVSDK's file plugins against the server, in this process."""

from base64 import b64decode
from io import BytesIO
from time import monotonic, sleep

import numpy as np
import pytest
from mavsdk.plugins.ftp import FilesystemEntry, Ftp, FtpError, FtpResult
from mavsdk.plugins.log_files import LogFiles, LogFilesResult
from mavsdk.plugins.log_streaming import LogStreaming
from mavsdk.plugins.shell import Device, Shell
from pyulog import ULog

from common.folder import ConfinedFolder
from common.state_folder import StateFolder
from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig
from tests.system.mavsdk.raw_mavsdk import Outcome, RawMavsdk, served
from tests.unit.autopilot.mavlink.rig import AskedVehicle

FILE, DIRECTORY = FilesystemEntry.EntryType.FILE, FilesystemEntry.EntryType.DIRECTORY
FTP_ID = (110).to_bytes(3, "little")
LONG = bytes(i * 7 % 251 for i in range(100_001))  # three bursts and a bit


@pytest.fixture
def vehicle(tmp_path):
    vehicle = AskedVehicle()
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


def test_burst_with_holes_is_made_whole(vehicle, tmp_path):
    (tmp_path / "files").mkdir()
    (tmp_path / "files/long.bin").write_bytes(LONG)
    rng = np.random.default_rng(5)
    lost = []

    def is_lost(data):
        is_burst = data[7:10] == FTP_ID and len(data) > 200 and rng.random() < 0.03
        lost.extend([data] * is_burst)
        return is_burst

    with RawMavsdk(served(vehicle), is_lost) as mavsdk:
        ftp, download = Ftp(mavsdk.system), Outcome(FtpResult.NEXT)
        (tmp_path / "down").mkdir()
        ftp.download_async("/long.bin", str(tmp_path / "down"), True, download)
        assert download.wait(60.0) == FtpResult.SUCCESS
    assert len(lost) > 5
    assert (tmp_path / "down/long.bin").read_bytes() == LONG


@pytest.fixture
def flight(tmp_path):
    """A flight that has stood on the ground for five seconds, with what two earlier ones have left."""
    state = StateFolder(tmp_path / "state")
    (tmp_path / "state/logs").mkdir()
    (tmp_path / "state/logs/log_00007.ulg").write_bytes(LONG)
    (tmp_path / "state/logs/log_00009.ulg").write_bytes(LONG[:90])
    flights = []

    def make_turn(link):
        config = FlightConfig(parameters={"SDLOG_MODE": 2}, world=WorldConfig(trees_per_ha=0.0))
        flights.append(Flight(config, links=[link], state=state))
        flights[0].run(lambda flight: flight.time_us >= 5_000_000)
        return flights[0].frame

    with RawMavsdk(make_turn) as mavsdk:
        yield mavsdk
    flights[0].close()
    state.close()


def test_logs_are_listed_downloaded_and_erased(flight, tmp_path):
    log_files = LogFiles(flight.system)
    entries = log_files.get_entries()
    assert [(entry.id, entry.size_bytes) for entry in entries[:2]] == [(0, len(LONG)), (1, 90)]
    for i, name in ((0, "log_00007.ulg"), (2, "log_00010.ulg")):
        download = Outcome(LogFilesResult.NEXT)
        log_files.download_log_file_async(entries[i], str(tmp_path / name), download)
        assert download.wait() == LogFilesResult.SUCCESS
        stored = (tmp_path / "state/logs" / name).read_bytes()
        assert (tmp_path / name).read_bytes() == stored[: entries[i].size_bytes]
    ulog = ULog(str(tmp_path / "log_00010.ulg"))
    assert ulog.get_dataset("vehicle_attitude").data["timestamp"][-1] >= 4_900_000
    log_files.erase_all_log_files()
    (left,) = log_files.get_entries()
    assert left.size_bytes > entries[2].size_bytes


def test_log_is_streamed(flight):
    streaming = LogStreaming(flight.system)
    pieces = []
    streaming.subscribe_log_streaming_raw(lambda piece, _: pieces.append(b64decode(piece.data_base64)))
    streaming.start_log_streaming()
    deadline_s = monotonic() + 20.0
    while sum(map(len, pieces)) < 200_000:
        assert monotonic() < deadline_s, f"{sum(map(len, pieces))} bytes"
        sleep(0.05)
    streaming.stop_log_streaming()
    ulog = ULog(BytesIO(b"".join(pieces)))
    assert ulog.initial_parameters["SDLOG_MODE"] == 2
    assert len(ulog.get_dataset("vehicle_attitude").data["timestamp"]) >= 50
    assert not ulog.dropouts


def test_shell_takes_commands_and_answers(flight):
    shell = Shell(flight.system)
    received = []
    shell.subscribe_receive(lambda piece, _: received.append(piece.data))
    for line, expected in (
        ("ver all", "Honeyguide"),
        ("param set MIS_TAKEOFF_ALT 4.5", "-> 4.5"),
        ("listener vehicle_attitude", "    q: ["),
        ("logger status", "3 logs"),
    ):
        received.clear()
        shell.send(line + "\n", Device.SHELL)
        deadline_s = monotonic() + 10.0
        while not "".join(received).endswith("nsh> "):
            assert monotonic() < deadline_s, "".join(received)
            sleep(0.01)
        assert expected in "".join(received)
