"""The program of an outside autopilot: heard, missed, and ended with everything that it has started."""

import sys
from pathlib import Path

import pytest

from common.clock import wall_sleep_s
from mission.boards.process import PeerProcess
from sim.boards.outside import PeerError

PATIENCE_S = 10.0


def started(code, folder, **environment):
    return PeerProcess(f'{sys.executable} -u -c "{code}"', folder, environment, folder / "console.log")


def heard(process, count):
    lines = []
    for _ in range(int(PATIENCE_S / 0.02)):
        lines += process.lines()
        if len(lines) >= count:
            return lines
        wall_sleep_s(0.02)
    raise AssertionError(lines)


def is_alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_its_console_is_heard_and_kept_and_it_gets_its_environment(tmp_path):
    process = started("import os; print('hello'); print(os.environ['NAME'])", tmp_path, NAME="value")
    assert heard(process, 2) == ["hello", "value"]
    process.close()
    process.close()  # once is enough
    assert (tmp_path / "console.log").read_text() == "hello\nvalue\n"


def test_its_end_is_a_sentence_with_its_exit_code(tmp_path):
    process = started("raise SystemExit(3)", tmp_path)
    for _ in range(500):
        if process.has_ended:
            break
        wall_sleep_s(0.02)
    with pytest.raises(PeerError, match="has ended with exit code 3"):
        process.check()
    process.close()


def test_it_ends_with_all_that_it_has_started(tmp_path):
    code = "import subprocess, sys, time; p = subprocess.Popen(['sleep', '60']); print(p.pid); time.sleep(60)"
    process = started(code, tmp_path)
    child = int(heard(process, 1)[0])
    process.close()
    for _ in range(100):
        if not is_alive(child):
            break
        wall_sleep_s(0.02)
    assert not is_alive(child)


@pytest.mark.parametrize("command", ["/no/such/program", "", "'unfinished"])
def test_what_cannot_be_started_is_told(command, tmp_path):
    with pytest.raises(PeerError, match="--command"):
        PeerProcess(command, tmp_path, {}, tmp_path / "console.log")
