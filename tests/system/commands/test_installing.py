"""The wheel holds all that a flight needs, and a plain install of it flies."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


@pytest.mark.slow
def test_a_flight_from_the_wheel(tmp_path):
    """Another folder than the clone's, and nothing of the clone on the path."""
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    subprocess.run([*pip, "wheel", "--quiet", "--no-deps", "--wheel-dir", tmp_path, ROOT], check=True)
    (wheel,) = tmp_path.glob("honeyguide-*.whl")
    site = tmp_path / "site"
    subprocess.run([*pip, "install", "--quiet", "--no-deps", "--target", site, wheel], check=True)
    program = "import mission, sys; print(mission.__file__); from mission.cli import main; main()"
    result = subprocess.run(
        [sys.executable, "-P", "-c", program, "fly", "--once", "--speed", "max", "--run-folder", tmp_path / "flight"],
        env={**os.environ, "PYTHONPATH": str(site)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith(str(site))
    assert "mission completed" in result.stdout
