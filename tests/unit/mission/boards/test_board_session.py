"""`honeyguide fly --board`: what it refuses, and how a flight goes whose program comes and ends."""

import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from mission.cli import app

ROOT = Path(__file__).parents[4]
STAND_IN = f"{sys.executable} -m bench.standins.ardupilot 9502 2"  # the port of instance 50; two seconds


def fly(*options):
    return CliRunner().invoke(app, ["fly", *options])


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--board", "px4", "--dialect", "ardupilot"), "--dialect and --board px4"),
        (("--board", "px4", "--noise", "0"), "--noise 0 and --board px4"),
        (("--board", "ardupilot", "--engine", "pybullet"), "only the native one"),
        (("--board", "ardupilot", "--command", "/no/such/program"), "--command /no/such/program"),
        (("--board", "ardupilot", "--param", "SYSID_THISMAV=7"), "--param SYSID_THISMAV: the number of the vehicle"),
        (("--board", "px4", "--airframe", "easyglider"), "nobody throws it"),
    ],
)
def test_what_cannot_be_flown_is_refused_with_a_sentence(options, sentence, tmp_path):
    result = fly(*options, "--instance", "50", "--run-folder", str(tmp_path / "run"))
    assert result.exit_code == 2
    assert sentence in result.stderr


def test_a_program_finds_its_files_from_where_it_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    options = ("--idle", "--speed", "max", "--seconds", "60", "--instance", "50", "--run-folder", "run")
    fly("--board", "ardupilot", *options, "--command", "cat {params}")
    assert "MAV_SYSID 51" in (tmp_path / "run" / "ardupilot" / "console.log").read_text()


def test_a_program_that_ends_ends_the_flight_with_a_sentence_and_its_logs(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    folder = tmp_path / "run"
    options = ("--idle", "--speed", "max", "--seconds", "60", "--instance", "50", "--run-folder", str(folder))
    result = fly("--board", "ardupilot", *options, "--command", STAND_IN)
    assert result.exit_code == 1
    assert "has ended with exit code 0" in result.stdout
    assert "ArduPilot | faults=0" in result.stdout
    assert (folder / "flight.ulg").stat().st_size > 1000
    assert "MAV_SYSID 51" in (folder / "ardupilot" / "vehicle.parm").read_text()
