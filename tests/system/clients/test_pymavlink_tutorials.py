"""Scripts in the manner of pymavlink's tutorials, each in a process of its own, over UDP: all on one vehicle."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.system.clients.pymavlink_tutorials import TUTORIALS
from tests.system.vehicle import IdleVehicle

SCRIPTS = Path(__file__).with_name("pymavlink_tutorials.py")
TIMEOUT_S = 150.0  # wall clock

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tutorials")
    with IdleVehicle(folder, "--dialect", "ardupilot", "--trees", 0, speed=5.0) as vehicle:
        yield f"udpin:127.0.0.1:{vehicle.gcs_port}"


@pytest.mark.parametrize("name", TUTORIALS)  # in their order: each leaves the vehicle disarmed
def test_tutorial_runs_as_it_is_copied(address, name):
    script = [sys.executable, str(SCRIPTS), name, address]
    done = subprocess.run(script, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
