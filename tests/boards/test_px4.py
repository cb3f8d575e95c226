"""PX4's own binary flies our bodies in our worlds: `make test-px4 PX4=FOLDER`."""

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.boards.binaries import flown, killed_in_flight, px4_command

PX4 = os.environ.get("PX4", "")
pytestmark = pytest.mark.skipif(not PX4, reason="PX4=FOLDER of its build px4_sitl_default")
COMMAND = px4_command(Path(PX4))


@pytest.mark.parametrize("seed", [0, 1])
def test_it_flies_the_tour_of_the_hills(tmp_path, seed):
    run = flown("fly", "px4", COMMAND, tmp_path / "run", "--once", "--speed", "max", "--seed", str(seed))
    assert run.exit_code == 0, run.output
    assert run.summary["result"] == "mission completed"
    assert run.summary["ready_s"] < 30.0
    assert run.summary["landing_error_true_m"] < 2.0
    assert run.summary["cross_track_p95_m"] < 3.0
    assert run.summary["pos_h_rms_m"] < 1.5


def test_it_flies_it_in_wind(tmp_path):
    run = flown("fly", "px4", COMMAND, tmp_path / "run", "--once", "--speed", "max", "--wind", "6")
    assert run.summary["result"] == "mission completed", run.output


def test_it_flies_with_bullets_body(tmp_path):
    pytest.importorskip("pybullet")
    run = flown("fly", "px4", COMMAND, tmp_path / "run", "--once", "--speed", "max", "--engine", "pybullet")
    assert run.summary["result"] == "mission completed", run.output


def test_three_fly_it_at_once_each_by_its_own_ports(tmp_path):
    def fly(i):
        options = ("--once", "--speed", "max", "--seed", str(i), "--instance", str(i))
        return flown("fly", "px4", COMMAND, tmp_path / f"run{i}", *options)

    with ThreadPoolExecutor() as pool:
        runs = list(pool.map(fly, range(3)))
    for i, run in enumerate(runs):
        assert run.exit_code == 0, run.output
        assert run.summary["result"] == "mission completed"
        assert run.summary["landing_error_true_m"] < 2.0
        assert (tmp_path / f"run{i}" / "px4" / "log").is_dir()


@pytest.mark.parametrize("airframe", ["rover", "rover-skid"])
def test_a_rover_drives_its_tour(tmp_path, airframe):
    run = flown("fly", "px4", COMMAND, tmp_path / "run", "--airframe", airframe, "--once", "--speed", "max")
    assert run.exit_code == 0, run.output
    assert run.summary["result"] == "mission completed"
    assert run.summary["landing_error_true_m"] < 2.0
    assert run.summary["cross_track_p95_m"] < 2.0


@pytest.mark.parametrize("wind_m_s", [0, 5])
def test_a_plane_flies_its_tour_and_lands(tmp_path, wind_m_s):
    options = ("--airframe", "plane", "--once", "--speed", "max", "--wind", str(wind_m_s))
    run = flown("fly", "px4", COMMAND, tmp_path / "run", *options)
    assert run.exit_code == 0, run.output
    assert run.summary["result"] == "mission completed"


@pytest.mark.parametrize("seed", range(3))
def test_the_policy_follows_its_owner(tmp_path, seed):
    options = ("--speed", "4", "--seconds", "60", "--seed", str(seed), "--no-mp4")
    run = flown("follow", "px4", COMMAND, tmp_path / "run", *options)
    assert run.exit_code == 0, run.output
    assert run.summary["in_band"] >= 0.9
    assert run.summary["collision"] == 0.0


def test_killed_in_flight_it_is_missed_with_a_sentence(tmp_path):
    run = killed_in_flight("px4", COMMAND, tmp_path / "run", "px4")
    assert run.exit_code == 1
    assert "has ended with exit code -9" in run.output
    assert (tmp_path / "run" / "flight.ulg").stat().st_size > 0
