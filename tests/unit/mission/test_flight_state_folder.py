"""`honeyguide fly --state`: what a second run finds of the first."""

import json
from contextlib import closing
from math import inf, nan

import pytest
from typer.testing import CliRunner

from common.geodesy import DEFAULT_HOME, GeoPoint
from common.state_folder import StateFolder
from mission.cli import app
from mission.flight_state_folder import stored_home


@pytest.fixture
def fly(tmp_path):
    """Flies in lockstep with the state folder; returns the exit code, what was printed and the summary."""
    runs = []

    def run(*arguments):
        folder = tmp_path / f"run{len(runs)}"
        runs.append(folder)
        options = ["--speed", "max", "--trees", "0", "--state", tmp_path / "state", "--run-folder", folder, *arguments]
        result = CliRunner().invoke(app, ["fly", *map(str, options)])
        return result, folder

    return run


def test_second_run_finds_home_mission_and_log_of_the_first(fly, tmp_path):
    result, _ = fly("--seconds", 6, "--home", "46.5,7.5,600", "--param", "MIS_TAKEOFF_ALT=6")
    assert result.exit_code in (0, 1), result.output  # it was not given the time to fly the mission
    state = tmp_path / "state"
    items = json.loads((state / "mission.json").read_text())["content"]["items"]
    assert len(items) > 3
    assert len(list((state / "logs").iterdir())) == 1
    assert not (state / "parameters.json").exists()
    result, _ = fly("--idle", "--seconds", 1)
    assert result.exit_code == 0, result.output
    assert "cannot be read" not in result.output
    assert json.loads((state / "mission.json").read_text())["content"]["items"] == items
    with closing(StateFolder(state)) as folder:
        assert stored_home(folder) == GeoPoint(46.5, 7.5, 600.0)


def test_damaged_file_is_one_sentence_and_put_aside(fly, tmp_path):
    (tmp_path / "state").mkdir()
    (tmp_path / "state/parameters.json").write_text("{")
    result, _ = fly("--idle", "--seconds", 1)
    assert result.exit_code == 0, result.output
    (line,) = [line for line in result.output.splitlines() if "parameters.json" in line]
    assert line.endswith("cannot be read; the defaults are used, and it is kept as parameters.json.bad-1")


@pytest.mark.parametrize(
    "home",
    [
        {"lat_deg": nan, "lon_deg": 8.0, "alt_m": 0.0},
        {"lat_deg": 91.0, "lon_deg": 8.0, "alt_m": 0.0},
        {"lat_deg": 47.0, "lon_deg": 1e9, "alt_m": 0.0},
        {"lat_deg": 47.0, "lon_deg": 8.0, "alt_m": inf},
        {"lat_deg": 10**400, "lon_deg": 8.0, "alt_m": 0.0},
        {"lat_deg": [], "lon_deg": 8.0, "alt_m": 0.0},
    ],
)
def test_home_that_is_no_place_on_earth_is_the_default(tmp_path, home):
    with closing(StateFolder(tmp_path)) as folder:
        folder.write("home", home)
        assert stored_home(folder) == DEFAULT_HOME


def test_folder_in_use_is_refused(fly, tmp_path):
    state = StateFolder(tmp_path / "state")
    result, folder = fly("--idle", "--seconds", 1)
    state.close()
    assert result.exit_code == 2
    assert result.stderr == f"honeyguide: --state {tmp_path / 'state'}: another flight is using it\n"
    assert not folder.exists()


def test_folder_that_is_a_file_is_refused(fly, tmp_path):
    (tmp_path / "state").write_text("")
    result, _ = fly("--idle", "--seconds", 1)
    assert result.exit_code == 2
    assert "File exists" in result.stderr
