"""A dataset command that is ended leaves nothing behind, whichever signal ends it."""

import signal
import subprocess
import sys

import pytest

from common.clock import wall_sleep_s
from tests.documents import ROOT

MOST_S = 120.0


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_collection_that_is_ended_leaves_nothing(tmp_path, number):
    words = ["dataset", "collect", "RollerBall", "--policy", "expert", "--episodes", "1000000", "-o", tmp_path / "set"]
    process = subprocess.Popen(
        [sys.executable, "-c", "from mission.cli import main; main()", *map(str, words)],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    data = tmp_path / "set.part" / "main_data.hdf5"
    while process.poll() is None and not (data.is_file() and data.stat().st_size > 10_000):
        wall_sleep_s(0.02)
    assert process.poll() is None, process.communicate()
    process.send_signal(number)
    _, errors = process.communicate(timeout=MOST_S)
    assert process.returncode not in (0, -number)
    assert "Traceback" not in errors
    assert list(tmp_path.iterdir()) == []
