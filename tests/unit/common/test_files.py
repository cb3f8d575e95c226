"""Files appear whole or not at all."""

import pytest

from common.files import PartFile, part_path, write_whole


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
