"""The folders that ArduPilot's clients look for: lists as files, what runs, flight logs."""

import struct

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from autopilot.interface.item_lists import ItemRefusal, ListKind, MissionItem
from autopilot.interface.platform import LogFile
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.services.files.ftp import Opcode
from autopilot.mavlink.services.files.ftp_files import Nak
from common.folder import ConfinedFolder
from tests.unit.autopilot.mavlink.rig import HOME, Rig, texts
from tests.unit.autopilot.mavlink.services.files.ftp_rig import FtpClient

ABOVE_HOME, TAKEOFF, WAYPOINT, JUMP, RALLY = 3, 22, 16, 177, 5100
LOG = bytes(range(256)) * 5
MESSAGE = mavlink.MAVLink_mission_item_int_message


class Shelf:
    """Two logs."""

    def logs(self):
        return [LogFile("log_00001.ulg", len(LOG), 1_700_000_000), LogFile("log_00002.ulg", 7, 1_700_000_100)]

    def read(self, name, offset, count):
        return (
            LOG[offset : offset + count] if name == "log_00001.ulg" else b"longer than it was"[offset : offset + count]
        )


@pytest.fixture
def rig(tmp_path):
    rig = Rig(dialect=ARDUPILOT)
    (tmp_path / "own.txt").write_text("mine")
    rig.vehicle.host.files = ConfinedFolder(tmp_path)
    rig.vehicle.host.logs = Shelf()
    return rig


@pytest.fixture
def ftp(rig):
    return FtpClient(rig)


def listed(ftp, path):
    return ftp.ask(Opcode.LIST_DIRECTORY, path).data.rstrip(b"\0").split(b"\0")


def decoded(data):
    """Header and items of a file, as MAVProxy decodes them."""
    header = struct.unpack("<5H", data[:10])
    values = MESSAGE.unpacker.iter_unpack(data[10:])
    items = [MESSAGE(*(item[position] for position in MESSAGE.orders)) for item in values]
    return header, items


def encoded(items, *, kind=0, options=0, start=0, magic=0x763D):
    """A file of (command, lat, lon, alt), as MAVProxy encodes it."""
    data = struct.pack("<5H", magic, kind, options, start, len(items))
    for seq, (command, lat, lon, alt) in enumerate(items):
        item = MESSAGE(1, 1, seq, ABOVE_HOME, command, 0, 1, 0, 0, 0, 0, round(lat * 1e7), round(lon * 1e7), alt, kind)
        data += MESSAGE.unpacker.pack(*(getattr(item, name) for name in MESSAGE.ordered_fieldnames))
    return data


PLAN = [(WAYPOINT, 47.0, 8.0, 488.0), (TAKEOFF, 47.1, 8.1, 10.0), (WAYPOINT, 47.2, 8.2, 20.0)]


def stored(rig, kind=ListKind.MISSION):
    return [(item.seq, item.command, item.x, item.z) for item in rig.vehicle.lists.items(kind)]


def test_folders_are_listed(ftp):
    assert listed(ftp, "/") == [b"D@MISSION", b"D@PARAM", b"D@SYS", b"DAPM", b"Fown.txt\t4"]
    assert listed(ftp, "/APM") == [b"DLOGS"]
    assert listed(ftp, "@MISSION") == [b"Fmission.dat\t10", b"Ffence.dat\t10", b"Frally.dat\t10"]
    assert listed(ftp, "APM/LOGS/")[:2] == [b"Flog_00001.ulg\t1280", b"Flog_00002.ulg\t7"]


def test_mission_comes_down_with_home_first(rig, ftp):
    rig.vehicle.lists.load(
        ListKind.MISSION, [MissionItem(0, ABOVE_HOME, TAKEOFF, (0.0, 0.0, 0.0, 0.0), 47.1, 8.1, 12.0)]
    )
    data = ftp.read("@MISSION/mission.dat")
    assert listed(ftp, "@MISSION")[0] == b"Fmission.dat\t%d" % len(data)
    header, items = decoded(data)
    assert header == (0x763D, 0, 0, 0, 2)
    assert [(item.seq, item.command, item.x) for item in items] == [
        (0, WAYPOINT, round(HOME.lat_deg * 1e7)),
        (1, TAKEOFF, 471_000_000),
    ]
    assert items[1].z == 12.0


def test_mission_goes_up_without_home(rig, ftp):
    assert ftp.write("@MISSION/mission.dat", encoded(PLAN)).opcode == Opcode.ACK
    assert stored(rig) == [(0, TAKEOFF, pytest.approx(47.1), 10.0), (1, WAYPOINT, pytest.approx(47.2), 20.0)]


def test_what_went_up_comes_down(rig, ftp):
    ftp.write("@MISSION/mission.dat", encoded(PLAN))
    _, items = decoded(ftp.read("@MISSION/mission.dat"))
    assert [(item.command, item.x, item.z) for item in items[1:]] == [
        (TAKEOFF, 471_000_000, 10.0), (WAYPOINT, 472_000_000, 20.0)
    ]  # fmt: skip


def test_rally_points_go_up_and_down(rig, ftp):
    data = encoded([(RALLY, 47.1, 8.1, 20.0)], kind=2)
    assert ftp.write("@MISSION/rally.dat", data).opcode == Opcode.ACK
    assert stored(rig, ListKind.RALLY) == [(0, RALLY, pytest.approx(47.1), 20.0)]
    header, items = decoded(ftp.read("@MISSION/rally.dat"))
    assert header[1] == 2
    assert items[0].command == RALLY


def test_a_part_replaces_the_items_it_names(rig, ftp):
    ftp.write("@MISSION/mission.dat", encoded(PLAN))
    ftp.write("@MISSION/mission.dat", encoded([(WAYPOINT, 47.9, 8.9, 30.0)], options=1, start=2))
    assert [item[3] for item in stored(rig)] == [10.0, 30.0]
    ftp.write("@MISSION/mission.dat", encoded([(WAYPOINT, 47.9, 8.9, 40.0)], options=1, start=3))
    assert [item[3] for item in stored(rig)] == [10.0, 30.0, 40.0]


@pytest.mark.parametrize(
    "data",
    [
        encoded(PLAN, magic=0x1234),
        encoded(PLAN, kind=1),
        encoded(PLAN)[:-1],
        encoded(PLAN) + b"\0" * 38,
        encoded(PLAN, start=1),
        encoded(PLAN, start=9, options=1),
        encoded(PLAN)[:48] + bytes(38) + encoded(PLAN)[86:],
        b"short",
        encoded([PLAN[0], (WAYPOINT, 47.0, 8.0, float("inf"))]),
    ],
    ids=["magic", "kind", "cut off", "too long", "start", "far start", "empty item", "short", "infinite"],
)
def test_a_file_that_is_none_changes_nothing_and_is_told(rig, ftp, data):
    ftp.write("@MISSION/mission.dat", encoded(PLAN))
    before = stored(rig)
    session = ftp.ask(Opcode.CREATE_FILE, "@MISSION/mission.dat").session
    ftp.ask(Opcode.WRITE_FILE, data, session=session)
    ftp.send(Opcode.TERMINATE_SESSION, session=session)
    messages = rig.frame(2)
    assert any("mission.dat not taken" in text for text in texts(messages))
    assert stored(rig) == before


def test_a_list_that_the_vehicle_refuses_is_not_taken(rig, ftp):
    rig.vehicle.stored[ListKind.MISSION].refusal = ItemRefusal(0, 3, "no such thing")
    reply = ftp.write("@MISSION/mission.dat", encoded(PLAN))
    assert (reply.opcode, reply.error) == (Opcode.NAK, Nak.FAIL)


def test_a_file_never_closed_changes_nothing(rig, ftp):
    session = ftp.ask(Opcode.CREATE_FILE, "@MISSION/mission.dat").session
    ftp.ask(Opcode.WRITE_FILE, encoded(PLAN), session=session)
    ftp.ask(Opcode.RESET_SESSIONS)
    assert stored(rig) == []


def test_a_file_longer_than_any_list_is_refused(ftp):
    session = ftp.ask(Opcode.CREATE_FILE, "@MISSION/rally.dat").session
    assert ftp.ask(Opcode.WRITE_FILE, b"x", session=session, offset=10_000_000).error == Nak.INVALID_DATA_SIZE


def test_logs_are_read_as_they_were_when_opened(ftp):
    assert ftp.read("/APM/LOGS/log_00001.ulg") == LOG
    assert ftp.read("APM/LOGS/log_00002.ulg") == b"longer "
    assert ftp.read("APM/LOGS/LASTLOG.TXT") == b"2\n"
    assert ftp.ask(Opcode.OPEN_FILE_RO, "APM/LOGS/log_00003.ulg").error == Nak.FILE_NOT_FOUND


@pytest.mark.parametrize("name", ["threads.txt", "tasks.txt", "memory.txt", "uarts.txt", "version.txt"])
def test_what_runs_is_told_as_text(ftp, name):
    data = ftp.read(f"@SYS/{name}")
    assert data.endswith(b"\n")
    assert b"F%s\t%d" % (name.encode(), len(data)) in listed(ftp, "@SYS")


@pytest.mark.parametrize("path", ["@SYS/memory.txt", "APM/LOGS/log_00001.ulg", "APM/x", "@SYS"])
def test_nothing_else_is_written(ftp, path):
    assert ftp.ask(Opcode.CREATE_FILE, path).error == Nak.FILE_PROTECTED
    assert ftp.ask(Opcode.REMOVE_FILE, path).error == Nak.FILE_PROTECTED


@pytest.mark.parametrize("path", ["@SYS/no.txt", "@MISSION/no.dat", "@MISSION/", "APM", "APM/LOGS/../../own.txt"])
def test_what_there_is_not_is_not_found(ftp, path):
    assert ftp.ask(Opcode.OPEN_FILE_RO, path).opcode == Opcode.NAK


def test_px4_vehicles_have_no_such_folders(tmp_path):
    rig = Rig()
    rig.vehicle.host.files = ConfinedFolder(tmp_path)
    assert FtpClient(rig).ask(Opcode.LIST_DIRECTORY, "@MISSION").opcode == Opcode.NAK
