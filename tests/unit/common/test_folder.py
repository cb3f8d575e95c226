"""A folder that nobody gets out of."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.folder import ConfinedFolder

PARTS = st.sampled_from(["..", ".", "", "a", "b", "link", "@PARAM", "~", "...", "\\..", "..\\"])


@given(parts=st.lists(PARTS, max_size=8), is_absolute=st.booleans())
def test_no_name_leads_outside(tmp_path_factory, parts, is_absolute):
    base = tmp_path_factory.mktemp("base")
    root = base / "root"
    root.mkdir()
    (root / "link").symlink_to(base)
    name = ("/" if is_absolute else "") + "/".join(parts)
    try:
        path = ConfinedFolder(root).path(name)
    except PermissionError:
        return
    assert path.resolve().is_relative_to(root.resolve())


def test_link_within_the_folder_is_followed(tmp_path):
    (tmp_path / "a").write_bytes(b"content")
    (tmp_path / "link").symlink_to("a")
    assert ConfinedFolder(tmp_path).read("link", 0, 10) == b"content"


def test_quota_counts_what_was_there_and_what_is_removed(tmp_path):
    (tmp_path / "a").write_bytes(bytes(90))
    folder = ConfinedFolder(tmp_path, quota_bytes=100)
    folder.create("b")
    with pytest.raises(OSError, match="full"):
        folder.write("b", 0, bytes(11))
    folder.write("b", 0, bytes(10))
    folder.remove("a")
    folder.write("b", 0, bytes(100))
    with pytest.raises(OSError, match="full"):
        folder.write("b", 100, b"x")


def test_number_of_files_is_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr("common.folder.ENTRIES_MAX", 2)
    folder = ConfinedFolder(tmp_path)
    folder.create("a")
    folder.make_folder("b")
    with pytest.raises(OSError, match="too many"):
        folder.create("c")
    folder.create("a")  # it is there already
