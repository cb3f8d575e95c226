"""ArduPilot's own binaries fly and drive our bodies in our worlds: `make test-ardupilot SITL=FOLDER`."""

import os
from pathlib import Path

import pytest

from tests.boards.binaries import ardupilot_command, flown, killed_in_flight

SITL = os.environ.get("SITL", "")
pytestmark = pytest.mark.skipif(not SITL, reason="SITL=FOLDER of ArduPilot's source, built for the board sitl")
COPTER, ROVER, PLANE = (ardupilot_command(Path(SITL), name) for name in ("arducopter", "ardurover", "arduplane"))


@pytest.mark.parametrize("seed", [0, 1])
def test_a_copter_flies_the_tour_of_the_hills(tmp_path, seed):
    run = flown("fly", "ardupilot", COPTER, tmp_path / "run", "--once", "--speed", "max", "--seed", str(seed))
    assert run.exit_code == 0, run.output
    assert run.summary["result"] == "mission completed"
    assert run.summary["ready_s"] < 60.0
    assert run.summary["landing_error_true_m"] < 0.5
    assert run.summary["cross_track_p95_m"] < 2.0
    assert run.summary["pos_h_rms_m"] < 1.0


def test_a_copter_flies_it_in_wind(tmp_path):
    run = flown("fly", "ardupilot", COPTER, tmp_path / "run", "--once", "--speed", "max", "--wind", "6")
    assert run.summary["result"] == "mission completed", run.output
    assert run.summary["landing_error_true_m"] < 1.0


def test_a_rover_drives_its_tour(tmp_path):
    run = flown("fly", "ardupilot", ROVER, tmp_path / "run", "--airframe", "rover", "--once", "--speed", "max")
    assert run.exit_code == 0, run.output
    assert run.summary["result"] == "mission completed"
    assert run.summary["landing_error_true_m"] < 1.0
    assert run.summary["cross_track_p95_m"] < 2.0


@pytest.mark.parametrize("seed", [0, 1])
def test_a_plane_flies_its_circuit(tmp_path, seed):
    options = ("--airframe", "plane", "--once", "--speed", "max", "--seed", str(seed))
    run = flown("fly", "ardupilot", PLANE, tmp_path / "run", *options)
    assert run.exit_code == 0, run.output
    assert run.summary["result"] == "mission completed"


def test_a_plane_flies_it_in_wind(tmp_path):
    options = ("--airframe", "plane", "--once", "--speed", "max", "--wind", "5")
    run = flown("fly", "ardupilot", PLANE, tmp_path / "run", *options)
    assert run.exit_code == 0, run.output
    assert run.summary["result"] == "mission completed"


@pytest.mark.parametrize("seed", range(3))
def test_the_policy_follows_its_owner(tmp_path, seed):
    options = ("--speed", "4", "--seconds", "60", "--seed", str(seed), "--no-mp4")
    run = flown("follow", "ardupilot", COPTER, tmp_path / "run", *options)
    assert run.exit_code == 0, run.output
    assert run.summary["in_band"] >= 0.9
    assert run.summary["collision"] == 0.0


def test_killed_in_flight_it_is_missed_with_a_sentence(tmp_path):
    run = killed_in_flight("ardupilot", COPTER, tmp_path / "run", "arducopter")
    assert run.exit_code == 1
    assert "has ended with exit code -9" in run.output
    assert (tmp_path / "run" / "flight.ulg").stat().st_size > 0
