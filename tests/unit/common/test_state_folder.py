"""Records outlive whoever wrote them, and damaged ones are put aside."""

import json
import subprocess
import sys
from zlib import crc32

import pytest

from common.state_folder import StateFolder


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "state"


def reopened(state):
    state.close()
    return StateFolder(state.folder)


def test_record_that_was_never_written_is_empty(folder):
    assert StateFolder(folder).read("parameters") == {}


def test_what_was_written_is_read_by_the_next(folder):
    state = StateFolder(folder)
    state.write("parameters", {"A": 1, "B": 2.5})
    assert reopened(state).read("parameters") == {"A": 1, "B": 2.5}
    assert json.loads((folder / "parameters.json").read_text())["version"] == 1


def test_noted_changes_are_there_without_a_whole_write(folder):
    state = StateFolder(folder)
    state.write("parameters", {"A": 1, "B": 2, "C": 3})
    state.note("parameters", {"A": 10})
    state.note("parameters", {"B": None, "D": 4})
    assert reopened(state).read("parameters") == {"A": 10, "C": 3, "D": 4}


def test_reading_folds_the_journal_into_the_record(folder):
    state = StateFolder(folder)
    state.note("parameters", {"A": 10})
    state.read("parameters")
    assert (folder / "parameters.journal").read_bytes() == b""
    assert json.loads((folder / "parameters.json").read_text())["content"] == {"A": 10}


def test_journal_of_an_older_generation_counts_no_more(folder):
    state = StateFolder(folder)
    state.write("parameters", {"A": 1})
    state.note("parameters", {"A": 2})
    journal = (folder / "parameters.journal").read_bytes()
    state.write("parameters", {"A": 3})
    (folder / "parameters.journal").write_bytes(journal)  # killed before it was emptied
    assert reopened(state).read("parameters") == {"A": 3}


@pytest.mark.parametrize("lost", range(1, 20))
def test_change_that_a_kill_cut_off_has_not_happened(folder, lost):
    state = StateFolder(folder)
    state.note("parameters", {"A": 1})
    state.note("parameters", {"A": 2})
    journal = (folder / "parameters.journal").read_bytes()
    (folder / "parameters.journal").write_bytes(journal[:-lost])
    state = reopened(state)
    assert state.read("parameters") == {"A": 1}
    assert state.problems == []
    state.note("parameters", {"B": 5})
    assert reopened(state).read("parameters") == {"A": 1, "B": 5}


@pytest.mark.parametrize(
    "content",
    [
        b"", b"{", b"[]", b'{"version": 2}', b"\xff\xfe", b'{"version": 1, "record": "b"}', b"[" * 100_000,
        b'{"version": 1, "record": "parameters", "generation": Infinity, "content": {}}',
        b'{"version": 1, "record": "parameters", "generation": 1, "content": 3}',
    ],
)  # fmt: skip
def test_damaged_record_is_put_aside_with_a_sentence(folder, content):
    state = StateFolder(folder)
    state.write("parameters", {"A": 1})
    state.note("parameters", {"A": 2})
    (folder / "parameters.json").write_bytes(content)
    state = reopened(state)
    assert state.read("parameters") == {}
    assert state.problems[0].startswith(f"{folder / 'parameters.json'}: cannot be read; the defaults are used")
    assert (folder / "parameters.json.bad-1").read_bytes() == content
    state.write("parameters", {"A": 3})
    (folder / "parameters.json").write_bytes(b"again")
    state = reopened(state)
    assert state.read("parameters") == {}
    assert (folder / "parameters.json.bad-2").read_bytes() == b"again"


def test_damaged_journal_is_used_up_to_the_damage_and_put_aside(folder):
    state = StateFolder(folder)
    for i in range(3):
        state.note("parameters", {f"P{i}": i})
    journal = bytearray((folder / "parameters.journal").read_bytes())
    journal[len(journal) // 2] ^= 0xFF
    (folder / "parameters.journal").write_bytes(journal)
    state = reopened(state)
    assert state.read("parameters") == {"P0": 0}
    assert "its changes up to there are used" in state.problems[0]
    assert (folder / "parameters.journal.bad-1").read_bytes() == bytes(journal)
    state.note("parameters", {"P9": 9})
    assert reopened(state).read("parameters") == {"P0": 0, "P9": 9}


@pytest.mark.parametrize("line", [b"3", b"{}", b"[1]", b"[1, 3]", b"[1, 2, 3]", b"[" * 100_000])
def test_line_of_a_journal_that_is_no_change_is_damage(folder, line):
    state = StateFolder(folder)
    state.write("parameters", {"A": 1})
    (folder / "parameters.journal").write_bytes(f"{crc32(line):08x} ".encode() + line + b"\n")
    state = reopened(state)
    assert state.read("parameters") == {"A": 1}
    assert "its changes up to there are used" in state.problems[0]


def test_long_journal_is_folded_into_the_record(folder):
    state = StateFolder(folder)
    for i in range(9):
        state.note("mission", {"items": ["x" * 500_000, i]})
    assert (folder / "mission.journal").stat().st_size < 4 << 20
    assert reopened(state).read("mission")["items"][1] == 8


def test_folder_is_one_processs_at_a_time(folder):
    state = StateFolder(folder)
    program = f"from common.state_folder import StateFolder\nStateFolder(__import__('pathlib').Path({str(folder)!r}))"
    other = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert "BlockingIOError" in other.stderr
    state.close()
    subprocess.run([sys.executable, "-c", program], check=True)
