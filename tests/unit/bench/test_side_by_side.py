"""Processes side by side: what waits for what, and what is said of those that fail."""

import pytest
from rich.console import Console

from bench.side_by_side import Job, run_side_by_side

NOTE = """
import sys, time, pathlib
name, *waits_for = sys.argv[1:]
lines = pathlib.Path("lines")
def tell(word):
    with lines.open("a") as file:
        file.write(word + " " + name + "\\n")
tell("begin")
while any("end " + other not in lines.read_text() for other in waits_for):
    time.sleep(0.01)
tell("end")
"""


@pytest.fixture
def modules(tmp_path, monkeypatch):
    """Modules for `python -m`: `note NAME OTHER…` tells of its begin, waits for others, tells its end; `fail` fails."""
    (tmp_path / "lines").touch()
    (tmp_path / "note.py").write_text(NOTE)
    (tmp_path / "fail.py").write_text("raise SystemExit('no')\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(folder, *jobs):
    return run_side_by_side(jobs, folder / "logs", 2, Console(quiet=True))


def test_a_job_begins_when_what_it_needs_is_there(modules):
    later = Job("b", ("note", "b"), is_ready=lambda: "end a" in (modules / "lines").read_text())
    assert run(modules, later, Job("a", ("note", "a"))) == []
    assert (modules / "lines").read_text().split("\n")[:-1] == ["begin a", "end a", "begin b", "end b"]


def test_a_job_that_takes_all_waits_for_the_others_and_has_none_beside_it(modules):
    jobs = [Job("a", ("note", "a", "d")), Job("c", ("note", "c"), takes_all=True), Job("d", ("note", "d"))]
    assert run(modules, *jobs) == []
    lines = (modules / "lines").read_text().split("\n")
    assert lines[-3:-1] == ["begin c", "end c"]


def test_jobs_that_fail_and_those_that_wait_for_them_are_named(modules):
    waits = Job("b", ("note", "b"), is_ready=(modules / "b.py").exists)
    assert run(modules, Job("a", ("fail",)), waits) == ["a", "b"]
    assert (modules / "logs" / "a.log").read_text() == "no\n"
