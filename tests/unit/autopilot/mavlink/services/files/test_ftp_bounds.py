"""What a client of file transfer can cost: long listings and files, floods, folders without end."""

import os
import zlib

from autopilot.mavlink.services.files.ftp import (
    Opcode,
)
from autopilot.mavlink.services.files.ftp_files import Nak
from autopilot.mavlink.services.files.ftp_work import WORK_PER_FRAME
from tests.unit.autopilot.mavlink.services.files.ftp_rig import FtpClient


def test_listing_of_many_pages_looks_at_each_file_once(rig, ftp, root):
    for i in range(300):
        (root / f"file{i:03}").touch()
    entries, before = 0, rig.vehicle.host.files.looked_at
    while (reply := ftp.ask(Opcode.LIST_DIRECTORY, "/", offset=entries)).opcode == Opcode.ACK:
        entries += reply.data.count(b"\0")
    assert entries == 300
    assert rig.vehicle.host.files.looked_at - before < 2 * 300


def test_listing_that_begins_anew_shows_what_has_changed(ftp, root):
    (root / "a").touch()
    assert ftp.ask(Opcode.LIST_DIRECTORY, "/").data == b"Fa\t0\0"
    (root / "b").touch()
    assert ftp.ask(Opcode.LIST_DIRECTORY, "/").data == b"Fa\t0\0Fb\t0\0"


def test_listings_without_end_cost_a_frame_a_bounded_amount(rig, ftp, root):
    for i in range(1_000):
        (root / f"file{i:03}").touch()
    folder, total = rig.vehicle.host.files, 0
    for _ in range(50):
        before = folder.looked_at
        for _ in range(100):
            ftp.send(Opcode.LIST_DIRECTORY, "/")
        rig.frame()
        assert folder.looked_at - before <= 1_000
        total += folder.looked_at - before
    assert 1_000 < total <= 50 * WORK_PER_FRAME / 4 + 1_000


def test_checksum_of_a_long_file_is_spread_over_frames_and_repeats_of_the_request_change_nothing(rig, ftp, root):
    content = bytes(range(256)) * (20 << 12)  # 20 MiB
    (root / "long").write_bytes(content)
    other = FtpClient(rig, rig.second_client)
    replies, rounds = [], 0
    while not replies:
        ftp.send(Opcode.CALC_FILE_CRC32, "long", seq=1000)
        other.send(Opcode.NONE)
        replies += ftp.replies()
        assert len(other.replies()) >= 1
        rounds += 1
    assert 2 < rounds < 50
    assert int.from_bytes(replies[0].data, "little") == zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF


def test_a_client_that_floods_delays_itself_more_than_another(rig, ftp, root):
    (root / "a").write_bytes(b"x")
    other, waited = FtpClient(rig, rig.second_client), []
    for _ in range(20):
        for _ in range(60):
            ftp.send(Opcode.CALC_FILE_CRC32, "a")
        other.send(Opcode.LIST_DIRECTORY, "/")
        waited.append(1)
        while not other.replies():
            waited[-1] += 1
    assert max(waited) < 10


def test_folders_made_without_end_are_counted_not_searched(rig, ftp, root):
    folder = rig.vehicle.host.files
    before = folder.looked_at
    for i in range(50):
        assert ftp.ask(Opcode.CREATE_DIRECTORY, f"d{i}").opcode == Opcode.ACK
        assert ftp.ask(Opcode.CREATE_FILE, f"f{i}").opcode == Opcode.ACK
        ftp.ask(Opcode.RESET_SESSIONS)
    assert folder.looked_at == before


def test_a_pipe_among_the_files_is_refused(ftp, root):
    os.mkfifo(root / "pipe")
    assert ftp.ask(Opcode.OPEN_FILE_RO, "pipe").error == Nak.FILE_PROTECTED
    assert ftp.ask(Opcode.CALC_FILE_CRC32, "pipe").error == Nak.FILE_PROTECTED
    assert ftp.ask(Opcode.CREATE_FILE, "pipe").error == Nak.FILE_PROTECTED
