"""`honeyguide test`: exit codes, JUnit, kept runs that can be flown again, the schema."""

import json
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from typer.testing import CliRunner

from mission.cli import app
from mission.scenario import one_run
from mission.scenario.keeping import emptied, run_names
from mission.scenario.one_run import ScenarioRuns, fly, planned_runs
from mission.scenario.scenario_file import ScenarioFile, read_scenario

HOP = """world: {kind: plain}
seeds: [1, 2]
vehicle:
  script: [arm, {takeoff: 5}, land]
checks:
  - altitude: {max: 6}
  - at_end: {is_armed: false}
"""
BAD = """import os, signal

async def die(drone):
    await drone.wait_ready()
    os.kill(os.getpid(), signal.SIGSEGV)

async def leave(drone):
    raise SystemExit(3)

async def hang(drone):
    while True:
        pass
"""


def run(*arguments):
    return CliRunner().invoke(app, ["test", *map(str, arguments)])


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "hop.scenario.yaml").write_text(HOP)
    return tmp_path


def test_a_folder_that_passes_is_0(folder):
    junit = folder / "junit.xml"
    result = run(folder, "--jobs", 1, "--junit", junit)
    assert result.exit_code == 0, result.output
    assert "2 of 2 passed" in result.output
    root = ET.parse(junit).getroot()
    assert [suite.get("name") for suite in root] == ["hop seed 1", "hop seed 2"]
    assert [suite.get("failures") for suite in root] == ["0", "0"]


def test_a_failing_run_is_kept_and_can_be_flown_again(folder):
    (folder / "hop.scenario.yaml").write_text(HOP.replace("max: 6", "max: 4"))
    keep, junit = folder / "kept", folder / "junit.xml"
    result = run(folder / "hop.scenario.yaml", "--seeds", 7, "--jobs", 1, "--keep", keep, "--junit", junit, "--quiet")
    assert result.exit_code == 1
    kept = keep / "hop-seed7"
    assert {path.name for path in kept.iterdir()} == {"flight.ulg", "flight.tlog", "result.json", "hop.scenario.yaml"}
    again = kept / "hop.scenario.yaml"
    assert f"again: honeyguide test {again}" in result.output.replace("\n", "")
    assert "asked altitude at most 4 m" in result.output
    (failure,) = ET.parse(junit).getroot().iter("failure")
    assert "altitude at most 4 m" in failure.get("message")

    second = run(again, "--jobs", 1, "--keep", folder / "twice", "--quiet")
    assert second.exit_code == 1
    twice = folder / "twice" / "hop-seed7"
    assert (twice / "flight.ulg").read_bytes() == (kept / "flight.ulg").read_bytes()
    one, two = (json.loads((each / "result.json").read_text()) for each in (kept, twice))
    assert one["checks"] == two["checks"]


@pytest.mark.parametrize(
    ("files", "names"),
    [
        (["hop", "sub/square"], ["hop", "square"]),
        (["a/hop", "b/hop", "c/square"], ["a-hop", "b-hop", "square"]),
        (["a/c/hop", "b/c/hop", "b/hop"], ["a-c-hop", "b-c-hop", "b-hop"]),
    ],
)
def test_runs_of_equal_names_are_kept_by_their_folders(files, names):
    assert run_names([(Path(f"{file}.scenario.yaml"), file.rpartition("/")[2]) for file in files]) == names


def test_a_name_made_by_folders_is_no_other_scenarios_name():
    found = run_names([(Path(f"{file}.scenario.yaml"), file.rpartition("/")[2]) for file in ("a/x", "b/x", "a-x")])
    assert len(set(found)) == 3


def test_runs_of_a_folder_with_equal_names_are_kept_by_their_files():
    assert run_names([(Path(f"{file}.scenario.yaml"), "hop") for file in "abc"]) == ["a-hop", "b-hop", "c-hop"]


def test_a_failing_run_that_is_not_kept_can_be_flown_again(folder):
    file = folder / "hop.scenario.yaml"
    file.write_text(HOP.replace("max: 6", "max: 4"))
    output = run(file, "--seeds", 7, "--jobs", 1, "--quiet").output
    assert f"again: honeyguide test {file} --seeds 7 --keep failed" in output.splitlines()[-2]


def test_both_of_two_files_of_one_name_are_kept(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "hop.scenario.yaml").write_text(HOP.replace("max: 6", "max: 4"))
    keep = tmp_path / "kept"
    result = run(tmp_path, tmp_path / "a/../b/hop.scenario.yaml", "--seeds", "1,1", "--jobs", 2, "--keep", keep)
    assert result.exit_code == 1
    assert "0 of 2 passed" in result.output
    assert sorted(each.name for each in keep.glob("*/flight.ulg")) == ["flight.ulg", "flight.ulg"]
    assert sorted(each.name for each in keep.iterdir()) == ["a-hop-seed1", "b-hop-seed1"]


def test_no_run_is_kept_where_its_scenario_is(folder):
    kept = folder / "hop-seed1"
    kept.mkdir()
    (kept / "result.json").write_text("{}")
    (folder / "hop.scenario.yaml").rename(kept / "hop.scenario.yaml")
    result = run(kept / "hop.scenario.yaml", "--keep", folder)
    assert result.exit_code == 2
    assert "where it is: keep it elsewhere" in result.output.replace("\n", " ")
    assert (kept / "hop.scenario.yaml").is_file()


def test_a_passing_run_is_not_kept(folder):
    assert run(folder, "--seeds", 1, "--jobs", 1, "--keep", folder / "kept", "--quiet").exit_code == 0
    assert not list((folder / "kept").iterdir())


def test_a_passing_run_is_kept_if_asked_for_and_for_foxglove_too(folder):
    pytest.importorskip("foxglove")
    kept = folder / "kept"
    result = run(folder, "--seeds", 1, "--jobs", 1, "--keep", kept, "--keep-all", "--mcap", "--quiet")
    assert result.exit_code == 0, result.output
    assert (kept / "hop-seed1" / "flight.mcap").read_bytes().startswith(b"\x89MCAP0\r\n")


def test_a_script_that_takes_its_process_with_it_fails_alone(folder):
    (folder / "bad.py").write_text(BAD)
    for name in ("die", "hang", "leave"):
        (folder / f"{name}.scenario.yaml").write_text(f"world: {{kind: plain}}\nvehicle: {{python: 'bad.py:{name}'}}\n")
    keep, junit = folder / "kept", folder / "junit.xml"
    result = run(folder, "--seeds", 1, "--jobs", 2, "--run-max", 10, "--keep", keep, "--junit", junit)
    assert result.exit_code == 1, result.output
    assert "1 of 4 passed" in result.output
    suites = ET.parse(junit).getroot()
    errors = {suite.get("name"): [each.get("message") for each in suite.iter("error")] for suite in suites}
    assert errors == {
        "die seed 1": ["its process died (signal 11, Segmentation fault)"],
        "hang seed 1": ["hung: its process was ended after 10 s"],
        "hop seed 1": [],
        "leave seed 1": [f"{folder / 'bad.py'}:leave, line 8: SystemExit: 3"],
    }
    died = keep / "die-seed1"
    assert "signal 11" in json.loads((died / "result.json").read_text())["error"]
    assert f"again: honeyguide test {died / 'die.scenario.yaml'}" in result.output.replace("\n", "")
    assert emptied(died) == died  # the next run of it may be kept there


def test_a_run_that_cannot_be_flown_is_an_error_of_junit_too_and_leaves_no_folder(folder):
    (folder / "none.py").write_text("from math import nothing as fly\n")  # which only running it tells
    (folder / "none.scenario.yaml").write_text("vehicle: {python: 'none.py:fly'}\n")
    keep, junit = folder / "kept", folder / "junit.xml"
    result = run(folder, "--seeds", 1, "--jobs", 2, "--keep", keep, "--junit", junit)
    assert result.exit_code == 2
    assert "cannot be flown: " in result.output
    hop, none = ET.parse(junit).getroot()
    assert (hop.get("name"), hop.get("errors")) == ("hop seed 1", "0")
    assert (none.get("name"), none.get("tests"), none.get("errors")) == ("none seed 1", "1", "1")
    (error,) = none.iter("error")
    assert "none.py: cannot be imported: ImportError: " in error.get("message")
    assert not list(keep.iterdir())


def test_a_run_whose_logs_cannot_be_kept_is_one_sentence(folder):
    scenario, keep = read_scenario(folder / "hop.scenario.yaml"), folder / "kept"
    keep.write_text("no folder")
    (planned,) = planned_runs([ScenarioFile(folder, scenario)], [1], keep, keeps_all=True, has_mcap=False)
    flown = fly(planned)
    assert flown.result is None
    assert flown.refusal == f"{keep / 'hop-seed1'}: cannot be written: Not a directory"
    assert ScenarioRuns().lost(planned, "hung").note == f"{keep / 'hop-seed1'}: cannot be written: Not a directory"


def planned_hop(folder):
    """One run of the scenario, kept if it fails."""
    files = [ScenarioFile(folder / "hop.scenario.yaml", read_scenario(folder / "hop.scenario.yaml"))]
    (planned,) = planned_runs(files, [1], folder / "kept", keeps_all=False, has_mcap=False)
    return planned


def test_a_run_lost_before_it_began_leaves_what_is_no_kept_run(folder):
    planned = planned_hop(folder)
    planned.folder.mkdir(parents=True)
    (planned.folder / "thesis.txt").write_text("mine")
    flown = ScenarioRuns().lost(planned, "hung")
    assert flown.note == f"{planned.folder}: is there already, and is no kept run"
    assert (flown.result.error, flown.result.folder, flown.command) == ("hung", "", "")
    assert [each.name for each in planned.folder.iterdir()] == ["thesis.txt"]


def test_a_run_lost_before_it_began_is_not_mixed_with_an_earlier_one(folder):
    planned = planned_hop(folder)
    ScenarioRuns().lost(planned, "hung")
    (planned.folder / "flight.ulg").touch()
    assert ScenarioRuns().lost(planned, "died").command
    assert {each.name for each in planned.folder.iterdir()} == {"result.json", "hop.scenario.yaml"}


def test_a_run_lost_under_way_keeps_its_logs(folder, monkeypatch):
    class Died(BaseException):
        pass

    def die(scenario, seed, *, folder, file):
        (folder / "flight.ulg").touch()
        raise Died

    monkeypatch.setattr(one_run, "run_scenario", die)
    planned = planned_hop(folder)
    with pytest.raises(Died):
        fly(planned)
    assert ScenarioRuns().lost(planned, "died").command
    assert {each.name for each in planned.folder.iterdir()} == {"flight.ulg", "result.json", "hop.scenario.yaml"}


def test_a_file_that_cannot_be_read_is_not_called_unwritten(folder, monkeypatch):
    def read(*_, **__):
        raise FileNotFoundError(2, "No such file or directory", "tower.stl")

    monkeypatch.setattr(one_run, "run_scenario", read)
    planned = planned_hop(folder)
    flown = fly(planned)
    assert flown.result is None
    assert flown.refusal == f"{planned.file}: tower.stl: No such file or directory"
    assert not planned.folder.exists()


def test_a_log_of_which_no_mcap_can_be_made_is_one_sentence(folder, monkeypatch):
    from mission.foxglove import convert

    def refuse(log, target):
        raise convert.ConversionError(f"{log}: holds no attitude and no position")

    pytest.importorskip("foxglove")
    monkeypatch.setattr(convert, "convert", refuse)
    files = [ScenarioFile(folder, read_scenario(folder / "hop.scenario.yaml"))]
    (planned,) = planned_runs(files, [1], folder / "kept", keeps_all=True, has_mcap=True)
    flown = fly(planned)
    assert flown.result.passed
    assert flown.note.endswith("flight.ulg: holds no attitude and no position")
    assert flown.command


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--keep-all"], "test: --keep-all needs --keep FOLDER"),
        (["--mcap"], "test: --mcap needs --keep FOLDER"),
        (["--seeds", "1,x"], "--seeds 1,x: must be whole numbers from 0"),
        (["--junit", "/nowhere/junit.xml"], "--junit /nowhere/junit.xml: no such folder"),
        (["--junit", "/proc/junit.xml"], "--junit /proc/junit.xml: cannot be written: "),
        (["--junit", "/proc"], "--junit /proc: "),
        (["--keep", "/proc/kept"], "--keep /proc/kept: cannot be written: "),
        (["missing"], "missing: no such file or folder"),
    ],
)
def test_wrong_arguments_are_2(folder, arguments, sentence):
    result = run(folder, *arguments)
    assert result.exit_code == 2
    assert sentence in result.output.replace("\n", " ")


def test_a_wrong_file_is_2(folder):
    (folder / "hop.scenario.yaml").write_text(HOP.replace("takeoff", "takeof"))
    result = run(folder)
    assert result.exit_code == 2
    assert "did you mean takeoff?" in result.output


def test_nothing_to_fly_is_2():
    result = run()
    assert result.exit_code == 2
    assert "name scenario files" in result.output


def test_the_schema_is_printed():
    result = run("--schema")
    assert result.exit_code == 0
    assert json.loads(result.output)["title"] == "Honeyguide scenario"
