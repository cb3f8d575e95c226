"""Betaflight's own program stabilises our bodies in our worlds: `make test-betaflight`, or with BETAFLIGHT=PROGRAM."""

import os
from pathlib import Path

import pytest

from tests.boards.binaries import flown, killed_in_flight

BETAFLIGHT = os.environ.get("BETAFLIGHT", "")
pytestmark = pytest.mark.skipif(not BETAFLIGHT, reason="BETAFLIGHT=PROGRAM, its SITL of version 4.6")
PROGRAM = str(Path(BETAFLIGHT).resolve())
COMMAND = f"'{PROGRAM}'"
HOVER = """QGC WPL 110
0	1	0	16	0	0	0	0	47.397742	8.545594	488	1
1	0	3	22	0	0	0	0	47.397742	8.545594	5	1
2	0	3	19	20	0	0	0	47.397742	8.545594	5	1
3	0	3	21	0	0	0	0	47.397742	8.545594	0	1
"""


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_it_hovers_and_lands(tmp_path, seed):
    plan = tmp_path / "hover.waypoints"
    plan.write_text(HOVER)
    options = ("--plan", plan, "--once", "--speed", "max", "--seed", str(seed))
    run = flown("fly", "betaflight", COMMAND, tmp_path / "run", *options)
    assert run.exit_code == 0, run.output
    assert run.summary["result"] == "mission completed"
    assert run.summary["landing_error_est_m"] < 0.5
    assert run.summary["landing_error_true_m"] < 2.0


def test_it_flies_the_tour_of_the_hills(tmp_path):
    run = flown("fly", "betaflight", COMMAND, tmp_path / "run", "--once", "--speed", "max")
    assert run.exit_code == 0, run.output
    assert run.summary["result"] == "mission completed"
    assert run.summary["landing_error_true_m"] < 2.0
    assert run.summary["cross_track_p95_m"] < 2.0


def test_killed_in_flight_it_is_missed_with_a_sentence(tmp_path):
    run = killed_in_flight("betaflight", COMMAND, tmp_path / "run", Path(PROGRAM).name)
    assert run.exit_code == 1
    assert "has ended with exit code -9" in run.output
    assert (tmp_path / "run" / "flight.ulg").stat().st_size > 0
