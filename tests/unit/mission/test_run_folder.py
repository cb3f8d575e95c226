"""The run folder: one flight's alone, as long as its process lives, however that ends."""

import errno
import signal
import subprocess
import sys
from io import StringIO

import pytest
from rich.console import Console

from mission.console.option_checks import UserError
from mission.run_folder import OwnFiles, run_folder

HOLDER = """
import sys
from pathlib import Path
from mission.run_folder import run_folder
with run_folder(Path(sys.argv[1])) as folder:
    (folder / "flight.ulg.part").write_bytes(b"ULog")
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_second_flight_is_refused_while_the_first_one_flies(tmp_path):
    with run_folder(tmp_path / "run") as folder:
        (folder / "flight.ulg.part").write_bytes(b"data")
        with pytest.raises(UserError, match="run: another flight is writing there"), run_folder(folder):
            pass
        assert [path.name for path in folder.iterdir()] == ["flight.ulg.part"]
        assert (folder / "flight.ulg.part").read_bytes() == b"data"
    with run_folder(tmp_path / "run"):  # over, and nothing complete was left
        pass


def test_another_process_holds_the_folder_until_it_is_killed(tmp_path):
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as holder:
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(UserError, match="another flight is writing there"), run_folder(tmp_path):
            pass
        assert (tmp_path / "flight.ulg.part").read_bytes() == b"ULog"
        holder.send_signal(signal.SIGKILL)
    with run_folder(tmp_path):
        pass


@pytest.mark.parametrize("name", ["flight.ulg", "flight-3.ulg", "flight-2.tlog", "summary.json"])
def test_a_folder_that_holds_a_flight_is_left_alone(tmp_path, name):
    (tmp_path / name).write_bytes(b"old")
    with pytest.raises(UserError, match="already holds a flight"), run_folder(tmp_path):
        pass
    assert (tmp_path / name).read_bytes() == b"old"


def test_new_folders_of_the_same_second_are_different(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("mission.run_folder.wall_date_text", lambda: "20260131-120000")
    with run_folder(None) as first, run_folder(None) as second:
        assert [first.name, second.name] == ["20260131-120000", "20260131-120000-2"]


def test_a_file_that_cannot_be_written_is_told_and_the_next_one_is_written(tmp_path):
    output = StringIO()
    files = OwnFiles(tmp_path, Console(file=output, width=300))
    with files.writing("summary.json"):
        raise OSError(errno.ENOSPC, "No space left on device")
    with files.writing("flight.png") as path:
        path.write_bytes(b"png")
    assert files.missing == ["summary.json"]
    assert "summary.json: not written: No space left on device" in output.getvalue()
    assert (tmp_path / "flight.png").exists()
