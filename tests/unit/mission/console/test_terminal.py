"""What a command shows while nothing else can be seen, on a terminal and without one."""

import subprocess
import sys
from io import StringIO
from pathlib import Path
from threading import Event

import pytest
from rich.console import Console

from autopilot.interface.vehicle_state import Severity
from mission.console import terminal
from mission.console.status_texts import KEPT, Texts
from mission.console.terminal import busy


def test_lines_into_a_file_on_a_full_disk_are_lost_and_end_nothing():
    script = (
        "from rich.console import Console; from mission.console.terminal import print_line; console = Console()\n"
        "print_line(console, 'one'); print_line(console, 'two'); console.print('three')"
    )
    with Path("/dev/full").open("wb") as full:
        result = subprocess.run([sys.executable, "-c", script], stdout=full, stderr=subprocess.PIPE, check=False)
    assert result.stderr == b"honeyguide: nothing more is printed: No space left on device\n"
    assert result.returncode == 0


def test_without_a_terminal_the_first_line_comes_at_once():
    console = Console(file=StringIO(), width=80)
    with busy(console, "loading"):
        assert console.file.getvalue() == "loading ...\n"


def test_without_a_terminal_a_line_comes_every_few_seconds_with_what_is_under_way(monkeypatch):
    monkeypatch.setattr(terminal, "LINE_PERIOD_S", 0.01)
    console, is_reported = Console(file=StringIO(), width=80), Event()
    write = console.file.write
    console.file.write = lambda text: (write(text), is_reported.set() if "so far" in text else None)
    with busy(console, "loading") as say:
        say("kernel 2 of 3")
        assert is_reported.wait(10.0)
    assert "kernel 2 of 3: 0 s so far" in console.file.getvalue()


def test_on_a_terminal_it_is_one_line_with_the_time_that_goes_away():
    console = Console(file=StringIO(), width=80, force_terminal=True)
    with busy(console, "loading") as say:
        say("kernel 2 of 3")
    written = console.file.getvalue()
    assert "kernel 2 of 3" in written
    assert "0:00:00" in written
    assert written.endswith("\x1b[2K")  # the line is erased


@pytest.fixture
def texts():
    return Texts(lambda: 1_500_000)


def test_texts_are_given_once_to_who_counts_them(texts):
    texts.statustext(Severity.INFO, "Armed")
    seen = texts.count
    texts.statustext(Severity.CRITICAL, "Crash detected: motors stopped")
    assert [str(text) for text in texts.since(seen)] == ["    1.5 s  Crash detected: motors stopped"]
    assert texts.since(texts.count) == []


def test_a_vehicle_that_says_very_much_fills_no_memory(texts):
    for i in range(10 * KEPT):
        texts.statustext(Severity.INFO, str(i))
    assert [text.text for text in texts.since(0)] == [str(i) for i in range(9 * KEPT, 10 * KEPT)]
