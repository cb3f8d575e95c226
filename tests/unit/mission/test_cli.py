"""`honeyguide fly` with wrong input: one sentence, exit code 2, and nothing is written."""

import json
import re
from io import StringIO
from types import SimpleNamespace

import pytest
from rich.console import Console
from typer.testing import CliRunner

from autopilot.interface.vehicle_state import Mode
from common.airframe import AIRFRAME_FOLDER
from mission.cli import app
from mission.console.progress_line import Progress
from mission.flight import Flight
from mission.plan.plan_file import DEFAULT_PLAN
from tests.unit.mission.follow.follow_flight import config


@pytest.fixture
def fly(tmp_path):
    """Runs the command into a folder of the test."""

    def run(*arguments):
        folder = () if "--run-folder" in arguments else ("--run-folder", tmp_path / "flight")
        words = ["fly", "--once", "--speed", "max", *folder, *arguments]
        return CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)

    return run


def assert_refused(result, pattern):
    """Exit code 2 and one sentence, nothing else."""
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1, result.stderr
    assert lines[0].startswith("honeyguide: ")
    assert re.search(pattern, lines[0]), lines[0]


def plan_with(item):
    """The default plan with entries of its second item replaced."""
    plan = json.loads(DEFAULT_PLAN.read_text())
    plan["mission"]["items"][1] |= item
    return json.dumps(plan)


WRONG_PLANS = {
    "empty": ("", r"line 1 is not valid JSON"),
    "truncated": (DEFAULT_PLAN.read_text()[:400], r"line \d+ is not valid JSON .* complete\?"),
    "another file": ('{"fileType": "Parameters"}', r"is neither a QGroundControl plan .* nor a QGC WPL 110 file"),
    "no items": ('{"fileType": "Plan", "version": 1, "mission": {"version": 2, "items": []}}', r"the mission has no"),
    "latitude": (plan_with({"params": [0, 0, 0, None, 147.4, 8.5, 10]}), r"item 2: params: latitude 147\.4 is not"),
    "words": (plan_with({"params": [0, 0, 0, None, "north", 8.5, 10]}), r"item 2: params must be 7 numbers or null"),
    "truncated waypoints": ("QGC WPL 110\n0\t1\t0\t16\t0\t0", r"item 0 \(line 2\): a line must have 12 columns, not 6"),
    "binary": ("\x00\x01\x02", r"line 1 is not valid JSON"),
}


@pytest.mark.parametrize("name", WRONG_PLANS)
def test_wrong_plan_is_refused(fly, tmp_path, name):
    text, pattern = WRONG_PLANS[name]
    plan = tmp_path / "wrong.plan"
    plan.write_text(text)
    assert_refused(fly("--plan", plan), rf"wrong\.plan: {pattern}")
    assert plan.read_text() == text
    assert list(tmp_path.iterdir()) == [plan]


def test_missing_plan_is_refused(fly, tmp_path):
    assert_refused(fly("--plan", tmp_path / "none.plan"), r"none\.plan: No such file")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "pattern"),
    [
        (
            ("--airframe", "zeppelin"),
            r"unknown airframe 'zeppelin'; known: c172, easyglider, f450, f550, f550-fitted, plane, rover, rover-skid",
        ),
        (("--airframe", "/dev/null/x.toml"), r"unknown airframe"),
        (("--speed", "0"), r"--speed 0: must be a number above 0, or 'max'"),
        (("--speed", "fast"), r"--speed fast: must be"),
        (("--speed", "nan"), r"--speed nan: must be"),
        (("--home", "47.4"), r"--home 47\.4: must be latitude,longitude"),
        (("--home", "north,east"), r"--home north,east: must be"),
        (("--home", "91,0"), r"--home 91,0: must be .* latitude within ±89, the longitude within ±180"),
        (("--idle",), r"--idle and --once: without a plan"),
        (("--idle", "--plan", DEFAULT_PLAN), r"--plan and --idle: choose one"),
        (("--speed", "1", "--gcs-port", "61516"), r"--gcs-port 61516: must be at most 61515"),
        (("--speed", "1", "--api-port", "65500"), r"--api-port 65500: must be at most 65495"),
        (("--speed", "1", "--gcs-port", "30000", "--api-port", "30000"), r"--api-port 30000: must differ"),
        (("--speed", "1", "--gcs-port", "30000", "--api-port", "34020"), r"ports 34020 and 34060"),
        (("--home", "47,8,nan"), r"--home 47,8,nan: must be"),
        (("--param", "NOPE=3"), r"parameter NOPE: there is none of that name"),
        (("--param", "MPC_XY_CRUISE=fast"), r"--param MPC_XY_CRUISE=fast: must be NAME=VALUE"),
        (("--param", "MPC_XY_CRUISE"), r"--param MPC_XY_CRUISE: must be NAME=VALUE"),
        (("--param", "MPC_XY_CRUISE=1e9"), r"parameter MPC_XY_CRUISE: 1e\+09 is not between 0\.5 and 20"),
        (("--param", "MPC_XY_CRUISE=nan"), r"parameter MPC_XY_CRUISE: nan is not between"),
        (("--run-folder", "/dev/null/x"), r"/dev/null/x: cannot write there: Not a directory"),
        (("--run-folder", DEFAULT_PLAN), r"default\.plan: cannot write there: "),
    ],
)
def test_wrong_option_is_refused(fly, tmp_path, arguments, pattern):
    assert_refused(fly(*arguments), pattern)
    assert list(tmp_path.iterdir()) == []


def test_wrong_airframe_file_is_refused(fly, tmp_path):
    airframe = tmp_path / "mine.toml"
    text = (AIRFRAME_FOLDER / "x500.toml").read_text()
    airframe.write_text(text.replace("mass_kg = { value = 1.5,", "mass_kg = { value = -1.5,"))
    assert_refused(fly("--airframe", airframe), r"mine\.toml: body\.mass_kg: Input should be greater than 0")
    airframe.write_text(text[:300])
    assert_refused(fly("--airframe", airframe), r"mine\.toml: not TOML")


def test_idle_in_lockstep_needs_an_end(tmp_path):
    words = ["fly", "--idle", "--speed", "max", "--run-folder", str(tmp_path / "flight")]
    assert_refused(CliRunner().invoke(app, words, catch_exceptions=False), r"--idle --speed max: .* give --seconds")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("count", "item"), [(0, "none"), (12, "12 of 12")])
def test_progress_fits_80_columns(count, item):
    """With figures as wide as they get."""
    estimate = SimpleNamespace(pos_ned=(-1234.5, -1234.5, -1234.5), vel_ned=(-12.0, 12.0, 0.0))
    widest_mode = max(Mode, key=lambda mode: len(mode.name))
    state = SimpleNamespace(
        estimate=estimate,
        mode=widest_mode,
        is_armed=True,
        mission_current=11,
        mission_count=count,
        battery_remaining=1.0,
    )
    flight = SimpleNamespace(time_us=3_600_000_000, controller=SimpleNamespace(state=state), owner=None)
    console = Console(width=80, file=StringIO())
    progress = Progress(flight, None)
    progress.table()
    console.print(progress.table())
    text = console.file.getvalue()
    assert len(text.splitlines()) == 3, text
    assert "…" not in text
    for part in ("3600.0", widest_mode.name, item, "-1234.5", "1234.5", "17.0", "100", "m/s"):
        assert part in text


def test_progress_of_a_flight_with_an_owner_shows_how_far_away_they_are():
    flight = Flight(config())
    flight.frame()
    console = Console(width=80, file=StringIO())
    console.print(Progress(flight, None).table())
    headings, units, figures = console.file.getvalue().splitlines()
    assert headings.split()[3:5] == ["to", "owner"]
    assert units.split()[1] == "m"
    assert float(figures.split()[3]) == pytest.approx(3.0, abs=1.0)  # a chest, 3 m away
    flight.close()


def test_option_out_of_range_is_refused(fly, tmp_path):
    result = fly("--wind", "99")
    assert result.exit_code == 2
    assert "Invalid value for '--wind'" in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_version_is_printed():
    result = CliRunner().invoke(app, ["--version"])
    assert result.exit_code == 0
    assert re.fullmatch(r"honeyguide \d+\.\d+\.\d+\n", result.stdout)


def test_a_shell_completes_the_commands():
    asked = {"_HONEYGUIDE_COMPLETE": "complete_bash", "COMP_WORDS": "honeyguide fo", "COMP_CWORD": "1"}
    result = CliRunner().invoke(app, [], env=asked, prog_name="honeyguide")
    assert result.stdout.split() == ["follow"]
