import pytest
from typer.testing import CliRunner

from autopilot.control.margins import GAIN_REQUIRED_DB, PHASE_REQUIRED_DEG
from autopilot.tuning import app
from autopilot.vehicles.rover.params import ROVER_PARAMETERS
from autopilot.vehicles.rover.tuning import SPEEDS_M_S, all_margins, design
from common.airframe import load_airframe


@pytest.mark.parametrize("name", ["rover", "rover-skid"])
def test_default_gains_leave_the_required_margins_at_every_speed(name):
    rows = all_margins(load_airframe(name))
    assert len(rows) >= 4 * 2
    for row in rows:
        assert row.phase_deg >= PHASE_REQUIRED_DEG, row
        assert row.gain_db >= GAIN_REQUIRED_DB, row


def test_the_car_is_judged_at_every_speed():
    assert len(all_margins(load_airframe("rover"))) == 4 * len(SPEEDS_M_S)


def test_default_gains_are_the_designed_ones():
    designed = design(load_airframe("rover"))
    for item in ROVER_PARAMETERS:
        if item.source.startswith("python -m autopilot.tuning"):
            assert designed[item.field] == pytest.approx(item.default, rel=1e-6), item.name


def test_command_prints_a_rover_s_loops():
    result = CliRunner().invoke(app, ["--airframe", "rover"], env={"COLUMNS": "140"})
    assert result.exit_code == 0, result.output
    for word in ("cross-track at 5 m/s", "RO_SPEED_P", "RO_YAW_RATE_I"):
        assert word in result.output
