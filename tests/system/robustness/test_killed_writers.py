"""A process killed at any moment leaves the old state or the new one; what was acknowledged is there."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(__file__).with_name("killed_writers.py")
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(PROGRAM.parents[3])}


@pytest.mark.parametrize("count", [15, pytest.param(200, marks=pytest.mark.slow)])
def test_killed_writer_leaves_whole_records(tmp_path, count):
    command = [sys.executable, PROGRAM, tmp_path, count, 7]
    result = subprocess.run(
        list(map(str, command)), capture_output=True, text=True, check=False, cwd=PROGRAM.parents[3], env=ENVIRONMENT
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith(f"{count} kills")
