"""`pytest --link`: a folder of tests that knows nothing of this one flies a vehicle of another process, over UDP."""

import os
import socket
import subprocess
import sys
import xml.etree.ElementTree as ET

import pytest

from tests.system.vehicle import ROOT, IdleVehicle

TESTS = """
import pytest


@pytest.fixture
async def airborne(vehicle):
    await vehicle.wait_ready()
    await vehicle.arm()
    await vehicle.takeoff(5.0)
    return vehicle


async def test_hops(airborne, flight):
    flight.check(altitude={"min": 3, "max": 7}, from_="up", to="end")
    flight.check(modes=MODES)
    flight.check(altitude={"min": 4, "max": 6}, during=MODES[1], from_="up", to="end")
    flight.mark("up")
    await airborne.sleep(3.0)
    flight.mark("end")
    await airborne.land()


async def test_too_much_is_asked(airborne, flight):
    flight.check(name="low", altitude={"max": 2})
    await airborne.land()


async def test_a_fault(vehicle, flight):
    flight.fail(motor={"number": 1, "power": 0.6}, for_s=2)
"""


def wait_for(port):
    """Until something is heard there: loading the program may take longer than a vehicle may be silent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(("127.0.0.1", port))
        ear.settimeout(60.0)
        ear.recv(2048)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("dialect", "modes"), [("px4", ["takeoff", "hold", "land"]), ("ardupilot", ["guided", "brake", "land"])]
)
def test_tests_of_a_foreign_folder_fly_a_vehicle_of_another_process(tmp_path, dialect, modes):
    (tmp_path / "other").mkdir()
    (tmp_path / "test_hops.py").write_text(TESTS.replace("MODES", str(modes)))
    with IdleVehicle(tmp_path / "other", "--dialect", dialect) as vehicle:
        wait_for(vehicle.api_port)
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--junit-xml", "junit.xml"]
        result = subprocess.run(
            [*command, "--link", f"udpin:127.0.0.1:{vehicle.api_port}"],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
    assert result.returncode == 1, result.stdout + result.stderr
    cases = {
        str(case.get("name")).partition("[")[0]: case for case in ET.parse(tmp_path / "junit.xml").iter("testcase")
    }
    assert [child.tag for child in cases["test_hops"]] == [], result.stdout
    assert "low: asked altitude at most 2 m" in result.stdout
    assert cases["test_too_much_is_asked"].find("failure") is not None
    skipped = cases["test_a_fault"].find("skipped")
    assert skipped is not None
    assert "a fault (motor, for_s): only in simulation" in str(skipped.get("message"))
