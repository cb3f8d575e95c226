"""MAVProxy with a rover in ArduPilot's dialect: it takes it for one, and drives it. The tests follow one another."""

import pytest

from tests.mavproxy.console import Console

PLAN = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t47.397742\t8.545594\t488\t1
1\t0\t3\t16\t0\t0\t0\t0\t47.397842\t8.545594\t0\t1
2\t0\t3\t16\t0\t0\t0\t0\t47.397842\t8.545794\t0\t1
3\t0\t3\t16\t0\t0\t0\t0\t47.397742\t8.545594\t0\t1
"""


@pytest.fixture(scope="module")
def console(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mavproxy")
    (folder / "plan.txt").write_text(PLAN)
    with Console(folder, "--airframe", "rover") as console:
        yield console


def test_it_is_a_rover_with_a_rovers_parameters(console):
    console.expect("Detected vehicle 1:1")
    console.expect(r"Received (\d+) parameters")
    console.do("param set CRUISE_SPEED 3", "HOLD> ")
    console.shows("param show CRUISE_SPEED", r"CRUISE_SPEED +3\.0")


def test_modes_of_a_rover_are_changed_by_name(console):
    for name in ("ACRO", "STEERING", "LOITER", "SIMPLE", "CIRCLE", "RTL", "GUIDED", "HOLD"):
        console.do(f"mode {name}", f"{name}> ")


def test_guided_drive_and_backwards(console):
    console.do("mode GUIDED", "GUIDED> ")
    console.do("arm throttle", "ARMED")
    console.do("guided 47.397792 8.545694 0", "DO_REPOSITION: ACCEPTED")
    console.do("setspeed 2", "DO_CHANGE_SPEED: ACCEPTED")
    console.do("long DO_SET_REVERSE 1", "DO_SET_REVERSE: ACCEPTED")
    console.do("long NAV_TAKEOFF 0 0 0 0 0 0 5", "NAV_TAKEOFF: (UNSUPPORTED|DENIED|FAILED)")


def test_mission_is_driven_and_the_rover_returns_and_disarms(console):
    console.do("wp load plan.txt", "Got MISSION_ACK: TYPE_MISSION: ACCEPTED")
    console.do("auto", "AUTO> ")
    console.expect("waypoint 2", 60.0)
    console.do("rtl", "RTL> ")
    console.expect("DISARMED", 120.0)
