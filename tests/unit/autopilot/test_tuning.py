import control
import numpy as np
import pytest
from typer.testing import CliRunner

from autopilot.control.margins import (
    GAIN_DESIGN_DB,
    GAIN_REQUIRED_DB,
    PHASE_REQUIRED_DEG,
    greatest_gain,
    margins_of,
)
from autopilot.tuning import app
from autopilot.vehicles.multirotor.params import CONTROL_PARAMETERS
from autopilot.vehicles.multirotor.tuning import Cascade, all_margins, default_gains, design
from common.airframe import airframe_names, load_airframe

MULTIROTORS = [name for name in airframe_names() if load_airframe(name).vehicle == "multirotor"]


@pytest.mark.parametrize("name", MULTIROTORS)
def test_default_gains_leave_the_required_margins_on_every_airframe(name: str) -> None:
    rows = all_margins(load_airframe(name))
    assert len(rows) == 10
    for row in rows:
        assert row.phase_deg >= PHASE_REQUIRED_DEG, row
        assert row.gain_db >= GAIN_REQUIRED_DB, row
        assert row.disk_gain_db > 5.0, row


def test_default_gains_are_the_designed_ones() -> None:
    designed = design(load_airframe("x500"))
    for item in CONTROL_PARAMETERS:
        if item.source.startswith("python -m autopilot.tuning"):
            assert designed[item.field] == pytest.approx(item.default, rel=1e-6), item.name


@pytest.mark.parametrize("name", MULTIROTORS)
def test_designed_gains_leave_the_required_margins(name: str) -> None:
    airframe = load_airframe(name)
    assert all(row.is_sufficient for row in all_margins(airframe, design(airframe)))


def test_margins_of_a_known_loop() -> None:
    # 4 / (s (s + 1) (s + 4)): phase -180 deg at 2 rad/s where the size is 4 / (2 sqrt(5) sqrt(20)) = 0.2
    loop = control.ss(control.tf([4.0], [1.0, 5.0, 4.0, 0.0]))
    row = margins_of("known", loop)
    assert row.gain_db == pytest.approx(20.0 * np.log10(5.0), abs=0.05)
    s = 1j * row.crossover_rad_s
    size = 4.0 / (s * (s + 1.0) * (s + 4.0))
    assert abs(size) == pytest.approx(1.0, abs=1e-2)
    assert row.phase_deg == pytest.approx(180.0 + np.degrees(np.angle(size)), abs=0.2)


def test_greatest_gain_is_limited_by_phase_or_by_gain() -> None:
    loop = control.ss(control.tf([1.0], [0.1, 1.0, 0.0]))
    row = margins_of("loop", greatest_gain(loop, 60.0, GAIN_DESIGN_DB) * loop)
    assert row.phase_deg == pytest.approx(60.0, abs=0.5)
    slow = control.ss(control.tf([1.0], [0.01, 0.21, 1.2, 1.0]))
    row = margins_of("slow", greatest_gain(slow, 5.0, 12.0) * slow)
    assert row.gain_db == pytest.approx(12.0, abs=0.3)  # the frequency grid steps by 1 %


def test_thrust_as_modelled_hides_the_disturbance_observer() -> None:
    airframe = load_airframe("x500")
    without = {**default_gains(), "disturbance_cutoff_hz": 0.0}
    row, other = (Cascade(airframe, gains).margins("velocity xy") for gains in (default_gains(), without))
    assert row.phase_deg == pytest.approx(other.phase_deg, abs=1e-9)


def test_command_prints_every_loop_and_gain() -> None:
    result = CliRunner().invoke(app, ["--airframe", "f450"], env={"COLUMNS": "120"})
    assert result.exit_code == 0
    for word in ("rate roll/pitch", "position z", "MC_RPRATE_P_ACC", "disk"):
        assert word in result.output


def test_command_names_an_unknown_airframe() -> None:
    result = CliRunner().invoke(app, ["--airframe", "zeppelin"])
    assert result.exit_code == 2
    assert "unknown airframe 'zeppelin'" in result.output
