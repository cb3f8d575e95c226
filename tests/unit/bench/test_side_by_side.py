"""Processes side by side: what waits for what, and what is said of those that fail."""

import pytest
from rich.console import Console

from bench.side_by_side import Job, run_side_by_side


@pytest.fixture
def modules(tmp_path, monkeypatch):
    """Modules for `python -m`: `note NAME` adds a line at its begin and its end, `fail` fails."""
    (tmp_path / "lines").touch()
    lines = "import sys\nfor word in ('begin', 'end'):\n    open('lines', 'a').write(f'{word} {sys.argv[1]}\\n')\n"
    (tmp_path / "note.py").write_text(lines)
    (tmp_path / "fail.py").write_text("raise SystemExit('no')\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(folder, *jobs):
    return run_side_by_side(jobs, folder / "logs", 2, Console(quiet=True))


def test_a_job_begins_when_what_it_needs_is_there(modules):
    later = Job("b", ("note", "b"), is_ready=lambda: "end a" in (modules / "lines").read_text())
    assert run(modules, Job("a", ("note", "a")), later) == []
    assert (modules / "lines").read_text().split("\n")[:-1] == ["begin a", "end a", "begin b", "end b"]


def test_a_job_that_takes_all_is_alone(modules):
    jobs = [Job(name, ("note", name), takes_all=name == "c") for name in "abcd"]
    assert run(modules, *jobs) == []
    lines = (modules / "lines").read_text().split("\n")
    assert lines.index("end c") == lines.index("begin c") + 1


def test_jobs_that_fail_and_those_that_wait_for_them_are_named(modules):
    waits = Job("b", ("note", "b"), is_ready=(modules / "b.py").exists)
    assert run(modules, Job("a", ("fail",)), waits) == ["a", "b"]
    assert (modules / "logs" / "a.log").read_text() == "no\n"
