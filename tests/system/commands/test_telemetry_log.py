"""flight.tlog of a flight with several clients, read by pymavlink's own tools."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from autopilot.mavlink.transport.links import LinkRole, memory_pair
from mission.flight import Flight, FlightConfig
from tests.unit.autopilot.mavlink.rig import Client

TOOLS = Path(sys.executable).parent
SECONDS = 30.0


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A vehicle on the ground, and two clients with the same ids on two links who ask for much."""
    folder = tmp_path_factory.mktemp("tlog")
    ends = [memory_pair(role) for role in (LinkRole.GROUND, LinkRole.ONBOARD)]
    clients = [Client(end, 245, 190) for _, end in ends]
    clients[1]._seq = 100
    flight = Flight(FlightConfig(), links=[end for end, _ in ends], folder=folder)
    for client in clients:
        client.command(511, 30, 20_000)  # ATTITUDE at 50 Hz
        client.send("PARAM_REQUEST_LIST")
    while flight.time_us < SECONDS * 1e6:
        if flight.time_us % 1_000_000 == 0:
            for client in clients:
                client.send("HEARTBEAT", type=6, autopilot=8)
                client.command(512, 148)
        flight.frame()
    flight.close()
    return folder / "flight.tlog"


def run(tool, path):
    words = [sys.executable, TOOLS / tool, "--dialect", "all", path]
    return subprocess.run(words, capture_output=True, text=True, check=True, timeout=60.0).stdout


def test_mavloss_counts_no_loss(path):
    rows = re.findall(r"^ +(\d+) +(\d+) +(\d+) +(\d+) +[\d.]+%", run("mavloss.py", path), re.MULTILINE)
    counted = {(int(sysid), int(compid)): (int(packets), int(lost)) for sysid, compid, packets, lost in rows}
    assert counted[(1, 1)][0] > 1000
    assert counted[(245, 190)][0] > 100
    assert {lost for _, lost in counted.values()} == {0}


def test_mavsummarize_tells_the_time_of_the_flight(path):
    minutes, seconds = re.search(r"Total time \(mm:ss\): +(\d+):(\d+)", run("mavsummarize.py", path)).groups()
    assert 60 * int(minutes) + int(seconds) == pytest.approx(SECONDS, abs=2.0)
