"""`honeyguide test`: exit codes, JUnit, kept runs that can be flown again, the schema."""

import json
from xml.etree import ElementTree as ET

import pytest
from typer.testing import CliRunner

from mission.cli import app

HOP = """world: {kind: plain}
seeds: [1, 2]
vehicle:
  script: [arm, {takeoff: 5}, land]
checks:
  - altitude: {max: 6}
  - at_end: {is_armed: false}
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


def test_a_passing_run_is_not_kept(folder):
    assert run(folder, "--seeds", 1, "--jobs", 1, "--keep", folder / "kept", "--quiet").exit_code == 0
    assert not list((folder / "kept").iterdir())


def test_a_passing_run_is_kept_if_asked_for_and_for_foxglove_too(folder):
    pytest.importorskip("foxglove")
    kept = folder / "kept"
    result = run(folder, "--seeds", 1, "--jobs", 1, "--keep", kept, "--keep-all", "--mcap", "--quiet")
    assert result.exit_code == 0, result.output
    assert (kept / "hop-seed1" / "flight.mcap").read_bytes().startswith(b"\x89MCAP0\r\n")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--keep-all"], "test: --keep-all needs --keep FOLDER"),
        (["--mcap"], "test: --mcap needs --keep FOLDER"),
        (["--seeds", "1,x"], "--seeds 1,x: must be whole numbers from 0"),
        (["--junit", "/nowhere/junit.xml"], "--junit /nowhere/junit.xml: no such folder"),
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
