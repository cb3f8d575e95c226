"""Files appear whole or not at all."""

import os

import pytest

from common.files import PartFile, part_path, write_durably, write_whole


def test_the_target_appears_at_close(tmp_path):
    target = tmp_path / "a.bin"
    target.write_bytes(b"old")
    file = PartFile(target)
    file.write(b"new")
    assert target.read_bytes() == b"old"
    file.close()
    file.close()
    assert target.read_bytes() == b"new"
    assert not part_path(target).exists()


def test_an_error_leaves_the_old_file_and_the_part(tmp_path):
    target = tmp_path / "a.bin"
    target.write_bytes(b"old")
    with pytest.raises(RuntimeError), PartFile(target) as file:
        file.write(b"half")
        raise RuntimeError
    assert target.read_bytes() == b"old"
    assert part_path(target).read_bytes() == b"half"


def test_a_missing_folder_is_an_os_error(tmp_path):
    with pytest.raises(OSError, match="No such file"):
        write_whole(tmp_path / "nowhere" / "a.bin", b"")


def test_what_is_written_durably_is_forced_to_the_disk_before_it_takes_its_name_and_its_folder_after(
    tmp_path, monkeypatch
):
    target = tmp_path / "target"
    target.write_bytes(b"old")
    seen = []

    def fsync(descriptor):
        seen.append((os.fstat(descriptor).st_ino, target.read_bytes(), os.fstat(descriptor).st_size))

    monkeypatch.setattr(os, "fsync", fsync)
    write_durably(target, b"content")
    folder = tmp_path.stat()
    assert seen == [(target.stat().st_ino, b"old", 7), (folder.st_ino, b"content", folder.st_size)]


def test_a_private_file_never_was_another(tmp_path):
    target = tmp_path / "target"
    part = tmp_path / "target.part"
    part.write_bytes(b"of a killed process")
    part.chmod(0o644)
    write_durably(target, b"secret", mode=0o600)
    assert target.stat().st_mode & 0o777 == 0o600
