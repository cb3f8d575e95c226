"""`honeyguide park`: a rover drives into a spot; what it writes, and what it refuses."""

import json

import pytest
from typer.testing import CliRunner

from mission.cli import app


def run(*arguments):
    return CliRunner().invoke(app, ["park", *arguments])


def test_a_rover_parks_in_a_free_spot_and_says_so(tmp_path):
    result = run("--speed", "max", "--world-seed", "1", "--run-folder", str(tmp_path / "run"))
    assert result.exit_code == 0, result.output
    assert "parked" in result.output
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["outcome"] == "there"
    assert summary["distance_m"] < 0.3
    assert summary["turn_deg"] < 10.0
    assert summary["guard"]["decisions"] > 20
    assert (tmp_path / "run" / "flight.ulg").stat().st_size > 10_000


def test_time_that_is_up_before_it_stands_there_is_a_failure(tmp_path):
    result = run("--speed", "max", "--seconds", "3", "--run-folder", str(tmp_path / "run"))
    assert result.exit_code == 1
    assert "stopped before its end" in result.output


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--spot", "99"], "--spot 99: there are 10; free are 3, 4, 6, 9, 10"),
        (["--spot", "1"], "--spot 1: a car stands there; free are 3, 4, 6, 9, 10"),
        (["--policy", "navigate"], "task is Navigate there and Drive here"),
        (["--guard-setting", "hull_m=1"], "--guard-setting hull_m: the guard has no such setting"),
        (["--policy", "nobody"], "nobody: no such policy file"),
        (["--airframe", "x500"], "--airframe x500: a drone does not park"),
        (["--idle", "--speed", "max"], "give --seconds to say when it ends"),
    ],
)
def test_what_cannot_be_driven_is_refused_in_one_sentence(arguments, sentence, tmp_path):
    folder = tmp_path / "run"
    result = run("--world-seed", "1", *arguments, "--run-folder", str(folder))
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not folder.exists()
