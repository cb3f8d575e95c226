"""File transfer with hand-made frames: every request, every refusal, sessions, repeats and bursts."""

import os
import zlib

import pytest

from autopilot.mavlink.services.files.ftp import (
    BURST_PACKETS,
    BURST_PACKETS_PER_FRAME,
    SESSION_IDLE_US,
    SESSIONS_PER_CLIENT,
    Opcode,
)
from autopilot.mavlink.services.files.ftp_files import Nak
from tests.unit.autopilot.mavlink.rig import FRAME_US
from tests.unit.autopilot.mavlink.services.files.ftp_rig import FtpClient, content_of


def test_file_is_written_and_read_back(ftp, root):
    content = content_of(1000)
    assert ftp.write("/a.bin", content).opcode == Opcode.ACK
    assert (root / "a.bin").read_bytes() == content
    assert ftp.read("a.bin") == content


def test_file_opened_for_writing_keeps_what_is_not_overwritten(ftp, root):
    (root / "a").write_bytes(b"0123456789")
    opened = ftp.ask(Opcode.OPEN_FILE_WO, "a")
    ftp.ask(Opcode.WRITE_FILE, b"xy", session=opened.session, offset=3)
    assert (root / "a").read_bytes() == b"012xy56789"


def test_listing_comes_in_pieces_and_ends_with_eof(ftp, root):
    for i in range(60):
        (root / f"file{i:02}").write_bytes(bytes(i))
    (root / "folder").mkdir()
    entries = []
    while (reply := ftp.ask(Opcode.LIST_DIRECTORY, "/", offset=len(entries))).opcode == Opcode.ACK:
        entries += reply.data.decode().rstrip("\0").split("\0")
    assert reply.error == Nak.EOF
    assert entries == [f"Ffile{i:02}\t{i}" for i in range(60)] + ["Dfolder"]


def test_listing_with_times_gives_size_and_time_of_files_and_folders(ftp, root):
    (root / "folder").mkdir()
    (root / "log").write_bytes(b"abc")
    for name in ("folder", "log"):
        os.utime(root / name, (1_700_000_000, 1_700_000_000))
    reply = ftp.ask(Opcode.LIST_DIRECTORY_WITH_TIME, "")
    assert reply.data == b"Dfolder\t0\t1700000000\0Flog\t3\t1700000000\0"


def test_names_are_removed_made_renamed_and_cut(ftp, root):
    (root / "a").write_bytes(b"abcdef")
    assert ftp.ask(Opcode.CREATE_DIRECTORY, "d").opcode == Opcode.ACK
    assert ftp.ask(Opcode.RENAME, "a\0d/b\0").opcode == Opcode.ACK
    assert ftp.ask(Opcode.TRUNCATE_FILE, "d/b", offset=2).opcode == Opcode.ACK
    assert (root / "d/b").read_bytes() == b"ab"
    assert ftp.ask(Opcode.REMOVE_DIRECTORY, "d").error == Nak.FAIL_ERRNO  # not empty
    assert ftp.ask(Opcode.REMOVE_FILE, "d/b").opcode == Opcode.ACK
    assert ftp.ask(Opcode.REMOVE_DIRECTORY, "d").opcode == Opcode.ACK
    assert list(root.iterdir()) == []


def test_checksum_is_the_one_without_inversions(ftp, root):
    (root / "a").write_bytes(content_of(70_000))
    reply = ftp.ask(Opcode.CALC_FILE_CRC32, "a")
    assert int.from_bytes(reply.data, "little") == zlib.crc32(content_of(70_000), 0xFFFFFFFF) ^ 0xFFFFFFFF


@pytest.mark.parametrize(
    ("opcode", "data", "error"),
    [
        (Opcode.OPEN_FILE_RO, "missing", Nak.FILE_NOT_FOUND),
        (Opcode.OPEN_FILE_RO, "../secret", Nak.FILE_PROTECTED),
        (Opcode.OPEN_FILE_RO, "/d/../../secret", Nak.FILE_PROTECTED),
        (Opcode.OPEN_FILE_RO, "link/secret", Nak.FILE_PROTECTED),
        (Opcode.OPEN_FILE_RO, "link_to_secret", Nak.FILE_PROTECTED),
        (Opcode.OPEN_FILE_RO, "d", Nak.FAIL_ERRNO),
        (Opcode.OPEN_FILE_RO, b"\xff\xfe", Nak.FAIL),
        (Opcode.OPEN_FILE_WO, "missing", Nak.FILE_NOT_FOUND),
        (Opcode.CREATE_FILE, "link/new", Nak.FILE_PROTECTED),
        (Opcode.CREATE_FILE, "@PARAM/other", Nak.FILE_PROTECTED),
        (Opcode.CREATE_FILE, "", Nak.FILE_PROTECTED),
        (Opcode.REMOVE_FILE, "missing", Nak.FILE_NOT_FOUND),
        (Opcode.REMOVE_FILE, "@PARAM/param.pck", Nak.FILE_PROTECTED),
        (Opcode.REMOVE_DIRECTORY, "/", Nak.FILE_PROTECTED),
        (Opcode.CREATE_DIRECTORY, "d", Nak.FILE_EXISTS),
        (Opcode.RENAME, "a\0d", Nak.FILE_EXISTS),
        (Opcode.RENAME, "a\0../a", Nak.FILE_PROTECTED),
        (Opcode.RENAME, "a", Nak.INVALID_DATA_SIZE),
        (Opcode.RENAME, "missing\0b", Nak.FILE_NOT_FOUND),
        (Opcode.LIST_DIRECTORY, "missing", Nak.FILE_NOT_FOUND),
        (Opcode.LIST_DIRECTORY, "link", Nak.FILE_PROTECTED),
        (Opcode.CALC_FILE_CRC32, "missing", Nak.FILE_NOT_FOUND),
        (Opcode.TERMINATE_SESSION, "", Nak.INVALID_SESSION),
        (Opcode.READ_FILE, "", Nak.INVALID_SESSION),
        (Opcode.WRITE_FILE, "x", Nak.INVALID_SESSION),
        (Opcode.BURST_READ_FILE, "", Nak.INVALID_SESSION),
        (17, "", Nak.UNKNOWN_COMMAND),
        (99, "", Nak.UNKNOWN_COMMAND),
    ],
)
def test_refusal_says_why(ftp, root, tmp_path, opcode, data, error):
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside/secret").write_text("secret")
    (tmp_path / "secret").write_text("secret")
    (root / "d").mkdir()
    (root / "a").write_text("a")
    (root / "link").symlink_to(tmp_path / "outside")
    (root / "link_to_secret").symlink_to(tmp_path / "secret")
    assert ftp.ask(opcode, data, session=9).error == error
    assert sorted(path.name for path in tmp_path.iterdir()) == ["files", "outside", "secret"]
    assert [path.name for path in (tmp_path / "outside").iterdir()] == ["secret"]


def test_listing_leaves_out_what_leads_outside(ftp, root, tmp_path):
    (root / "link").symlink_to(tmp_path)
    (root / "a").touch()
    assert ftp.ask(Opcode.LIST_DIRECTORY, "/").data == b"Fa\t0\0"


def test_size_beyond_the_payload_is_refused(ftp):
    assert ftp.ask(Opcode.OPEN_FILE_RO, "a", size=240).error == Nak.INVALID_DATA_SIZE


def test_folder_is_made_when_something_is_put_there(ftp, root):
    root.rmdir()
    assert ftp.ask(Opcode.LIST_DIRECTORY, "/").error == Nak.EOF
    assert ftp.ask(Opcode.OPEN_FILE_RO, "a").error == Nak.FILE_NOT_FOUND
    assert not root.exists()
    assert ftp.write("/a", b"content").opcode == Opcode.ACK
    assert (root / "a").read_bytes() == b"content"


def test_quota_is_kept_also_against_writing_far_behind_the_end(ftp, root):
    opened = ftp.ask(Opcode.CREATE_FILE, "a")
    reply = ftp.ask(Opcode.WRITE_FILE, b"x", session=opened.session, offset=4_000_000_000)
    assert (reply.error, reply.data[1]) == (Nak.FAIL_ERRNO, 28)  # ENOSPC
    assert ftp.ask(Opcode.WRITE_FILE, b"x", session=opened.session, offset=99_999).opcode == Opcode.ACK
    assert ftp.ask(Opcode.WRITE_FILE, b"x", session=opened.session, offset=100_000).error == Nak.FAIL_ERRNO


def test_file_open_for_reading_is_not_written(ftp, root):
    (root / "a").write_text("a")
    opened = ftp.ask(Opcode.OPEN_FILE_RO, "a")
    assert ftp.ask(Opcode.WRITE_FILE, b"x", session=opened.session).error == Nak.FILE_PROTECTED


def test_repeated_request_gets_the_same_reply_and_is_done_once(ftp, root):
    first = ftp.ask(Opcode.CREATE_DIRECTORY, "d", seq=7)
    assert ftp.ask(Opcode.CREATE_DIRECTORY, "d", seq=7) == first
    assert ftp.ask(Opcode.CREATE_DIRECTORY, "d", seq=9).error == Nak.FILE_EXISTS


def test_repeated_open_takes_one_session(ftp, root):
    (root / "a").touch()
    for _ in range(10):
        assert ftp.ask(Opcode.OPEN_FILE_RO, "a", seq=7).session == 0
    assert ftp.ask(Opcode.OPEN_FILE_RO, "a").session == 1


def test_sequence_number_goes_round(ftp):
    ftp.send(Opcode.NONE, seq=0xFFFF)
    (reply,) = ftp.replies()
    assert (reply.seq, reply.opcode) == (0, Opcode.ACK)


def test_reply_of_somebody_is_not_answered(ftp):
    ftp.send(Opcode.ACK)
    ftp.send(Opcode.NAK, bytes((Nak.EOF,)))
    assert ftp.replies() == []


def test_client_may_choose_the_number_of_its_session(rig, ftp, root):
    (root / "a").write_bytes(b"a")
    assert ftp.ask(Opcode.OPEN_FILE_RO, "a", session=221).session == 221
    assert ftp.ask(Opcode.OPEN_FILE_RO, "a", session=221).session == 0  # taken
    assert ftp.ask(Opcode.READ_FILE, session=221, size=1).data == b"a"


def test_sessions_of_a_client_are_limited_and_reset_closes_its_own_only(rig, ftp, root):
    (root / "a").write_text("a")
    other = FtpClient(rig, rig.second_client)
    others_session = other.ask(Opcode.OPEN_FILE_RO, "a").session
    for _ in range(SESSIONS_PER_CLIENT):
        assert ftp.ask(Opcode.OPEN_FILE_RO, "a").opcode == Opcode.ACK
    assert ftp.ask(Opcode.OPEN_FILE_RO, "a").error == Nak.NO_SESSIONS
    assert ftp.ask(Opcode.READ_FILE, session=others_session, size=1).error == Nak.INVALID_SESSION
    assert ftp.ask(Opcode.RESET_SESSIONS).opcode == Opcode.ACK
    assert ftp.ask(Opcode.OPEN_FILE_RO, "a").opcode == Opcode.ACK
    assert other.ask(Opcode.READ_FILE, session=others_session, size=1).data == b"a"


def test_idle_session_is_closed(rig, ftp, root):
    (root / "a").write_text("a")
    session = ftp.ask(Opcode.OPEN_FILE_RO, "a").session
    rig.time_us += SESSION_IDLE_US - 10 * FRAME_US
    assert ftp.ask(Opcode.READ_FILE, session=session, size=1).data == b"a"
    rig.time_us += SESSION_IDLE_US
    rig.frame()
    assert ftp.ask(Opcode.READ_FILE, session=session, size=1).error == Nak.INVALID_SESSION


def test_burst_is_paced_and_ends_with_eof(ftp, root):
    content = content_of(239 * 60 + 5)
    (root / "a").write_bytes(content)
    session = ftp.ask(Opcode.OPEN_FILE_RO, "a").session
    ftp.send(Opcode.BURST_READ_FILE, session=session, size=239, seq=500)
    replies = ftp.replies()
    assert len(replies) == BURST_PACKETS_PER_FRAME
    replies += ftp.replies(3)
    assert [reply.seq for reply in replies] == list(range(501, 501 + 62))
    assert [reply.offset for reply in replies] == [239 * i for i in range(61)] + [len(content)]
    assert b"".join(reply.data for reply in replies[:-1]) == content
    assert not any(reply.burst_complete for reply in replies)
    assert (replies[-1].error, replies[-1].request_opcode) == (Nak.EOF, Opcode.BURST_READ_FILE)


def test_long_file_takes_several_bursts_and_holes_are_read_again(ftp, root):
    content = content_of(239 * (BURST_PACKETS + 20))
    (root / "a").write_bytes(content)
    session = ftp.ask(Opcode.OPEN_FILE_RO, "a").session
    pieces = {}
    lost = {3, 4, 90}
    offset = 0
    while True:
        ftp.send(Opcode.BURST_READ_FILE, session=session, offset=offset, size=239)
        replies = ftp.replies(10)
        for i, reply in enumerate(replies):
            if i not in lost and reply.opcode == Opcode.ACK:
                pieces[reply.offset] = reply.data
        if replies[-1].error == Nak.EOF:
            break
        assert [reply.burst_complete for reply in replies] == [0] * (BURST_PACKETS - 1) + [1]
        offset = replies[-1].offset + replies[-1].size
    for hole in set(range(0, len(content), 239)) - set(pieces):
        pieces[hole] = ftp.ask(Opcode.READ_FILE, session=session, offset=hole, size=239).data
    assert b"".join(pieces[at] for at in sorted(pieces)) == content


def test_repeated_burst_request_is_sent_again(ftp, root):
    (root / "a").write_bytes(content_of(500))
    session = ftp.ask(Opcode.OPEN_FILE_RO, "a").session
    ftp.send(Opcode.BURST_READ_FILE, session=session, size=239, seq=500)
    first = ftp.replies(2)
    ftp.send(Opcode.BURST_READ_FILE, session=session, size=239, seq=500)
    assert ftp.replies(2) == first
    assert len(first) == 4
