"""The recipe "A sensor" of CONTRIBUTING.md: two new files, and lines in six others of a copy of the packages."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pyulog import ULog

from tests.recipes.optical_flow.edits import ADDED, NEW

ROOT = Path(__file__).parents[2]
HERE = Path(__file__).with_name("optical_flow")
FILES_MAX = 6


def with_flow(folder):
    """A copy of the packages to which the sensor is added."""
    for package in ("common", "autopilot", "sim", "policies", "mission"):
        shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
    for name, source in NEW.items():
        shutil.copy(HERE / source, folder / name)
    for name, anchor, lines in ADDED:
        path = folder / name
        text = path.read_text()
        assert text.count(f"\n{anchor}\n") == 1, (name, anchor)
        path.write_text(text.replace(f"\n{anchor}\n", f"\n{anchor}\n{lines}\n"))
    return folder


def test_a_fused_sensor_touches_six_files_and_they_are_those_of_the_recipe():
    touched = {name for name, _, _ in ADDED}
    assert len(touched) <= FILES_MAX
    recipe = (ROOT / "CONTRIBUTING.md").read_text().partition("### A sensor\n")[2].partition("\n### ")[0]
    reported = set(re.findall(r"`([\w./]+\.py)`", recipe.partition("\nBesides")[0]))
    assert touched <= reported
    assert {name for name in reported if (ROOT / name).exists()} == touched


def test_lines_that_the_recipe_adds_have_their_place(tmp_path):
    with_flow(tmp_path)


@pytest.mark.slow
def test_a_sensor_that_is_added_is_simulated_fused_shown_logged_broken_and_replayed(tmp_path):
    copy = with_flow(tmp_path / "copy")
    environment = {**os.environ, "PYTHONPATH": str(copy)}
    command = [sys.executable, HERE / "flight.py", tmp_path]
    ended = subprocess.run(command, cwd=copy, env=environment, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    reported = json.loads(ended.stdout.splitlines()[-1])
    assert reported["sensors"][-1] == "flow"
    assert reported["present"]
    assert reported["healthy"][-3:] == [False] * 3
    assert any(reported["healthy"])

    log = ULog(str(tmp_path / "flight.ulg"))
    (flow,) = [data for data in log.data_list if data.name == "vehicle_optical_flow_vel"]
    (innovations,) = [data for data in log.data_list if data.name == "estimator_innovations"]
    (variances,) = [data for data in log.data_list if data.name == "estimator_innovation_variances"]
    assert flow.data["vel_body[0]"].max() > 1.0
    assert flow.data["timestamp"][-1] < innovations.data["timestamp"][-1] - 3_000_000  # silent since it was broken
    is_judged = variances.data["flow[0]"] > 0.0
    judged = innovations.data["flow[0]"][is_judged] / np.sqrt(variances.data["flow[0]"][is_judged])
    assert 0.2 < np.std(judged) < 1.5
    assert reported["replayed"] > 0.8 * len(flow.data["timestamp"])
