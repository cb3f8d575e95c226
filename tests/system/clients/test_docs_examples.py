"""The examples in the documentation that talk to a vehicle in another process, against one."""

import subprocess
import sys

import pytest
from pyulog import ULog

from autopilot.mavlink.transport.links import LinkRole, UdpLink
from common.clock import Pacer
from common.kernels import FRAME_US
from mission.script import Drone
from tests.documents import ROOT, blocks, pages
from tests.system.vehicle import IdleVehicle

EXAMPLES = [(page, block) for page in pages() for block in blocks(page, "python", needs_vehicle=True)]
START_UP_S = 120.0  # wall clock, with the kernels to compile on a busy machine


def wait_until_ready(port):
    """Returns when the vehicle that sends to the ground station's port may be armed."""
    link = UdpLink(port + 4020, LinkRole.GROUND, local_port=port)
    drone = Drone(link)
    running = drone.start(drone.wait_ready(START_UP_S))
    pacer, time_us = Pacer(1.0), 0
    while not running.is_done:
        time_us += FRAME_US
        pacer.wait_until(time_us)
        drone.frame(time_us)
    link.close()
    assert running.error is None


@pytest.mark.parametrize(
    ("page", "program"), EXAMPLES, ids=[f"{page.relative_to(ROOT)}-{i}" for i, (page, _) in enumerate(EXAMPLES)]
)
def test_example_runs(page, program, tmp_path):
    with IdleVehicle(tmp_path) as vehicle:
        wait_until_ready(vehicle.gcs_port)
        program = program.replace("14540", str(vehicle.api_port)).replace("14580", str(vehicle.api_port + 40))
        example = tmp_path / "example.py"
        example.write_text(program)
        run = [sys.executable, str(example)]
        result = subprocess.run(run, cwd=ROOT, capture_output=True, text=True, timeout=START_UP_S, check=False)
        assert result.returncode == 0, result.stderr
        vehicle.stop()
    texts = [entry.message for entry in ULog(str(vehicle.folder / "flight.ulg")).logged_messages]
    assert "Armed" in texts
