"""MAVProxy 1.8.75 with a vehicle in ArduPilot's dialect: `make test-mavproxy`. The tests follow one another."""

from datetime import UTC, datetime

import pytest

from common.clock import wall_time_s
from tests.mavproxy.console import SPEED, Console

PLAN = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t47.397742\t8.545594\t488\t1
1\t0\t3\t22\t0\t0\t0\t0\t47.397742\t8.545594\t10\t1
2\t0\t3\t16\t0\t0\t0\t0\t47.397942\t8.545594\t12\t1
3\t0\t3\t16\t0\t0\t0\t0\t47.397942\t8.545794\t12\t1
4\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1
"""
FENCE = """QGC WPL 110
0\t0\t3\t5001\t4\t0\t0\t0\t47.3960\t8.5440\t0\t1
1\t0\t3\t5001\t4\t0\t0\t0\t47.3990\t8.5440\t0\t1
2\t0\t3\t5001\t4\t0\t0\t0\t47.3990\t8.5480\t0\t1
3\t0\t3\t5001\t4\t0\t0\t0\t47.3960\t8.5480\t0\t1
"""
RALLY = """QGC WPL 110
0\t0\t3\t5100\t0\t0\t0\t0\t47.3975\t8.5455\t20\t1
"""


@pytest.fixture(scope="module")
def console(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mavproxy")
    for name, text in (("plan.txt", PLAN), ("fence.txt", FENCE), ("rally.txt", RALLY)):
        (folder / name).write_text(text)
    with Console(folder) as console:
        yield console


def test_connects_and_has_every_parameter_by_file_within_5_s(console):
    console.expect("Detected vehicle 1:1")
    heard_s = wall_time_s()
    match = console.expect(r"Received (\d+) parameters( \(ftp\))?")
    assert int(match[1]) > 300
    assert match[2]
    assert wall_time_s() - heard_s < 5.0


def test_parameter_is_set_and_shown(console):
    console.do("param set RTL_ALT 2500", "LOITER> ")
    console.do("param fetch RTL_ALT", r"RTL_ALT *= *2500")
    console.do("param show RTL_ALT", r"RTL_ALT +2500")
    console.do("param fetch RTL_RETURN_ALT", r"RTL_RETURN_ALT *= *25\.0")


@pytest.mark.parametrize(
    ("module", "file", "kind", "listed"),
    [
        ("wp", "plan.txt", "MISSION", r"16 3 47\.397942.*\r\n20 3 "),
        ("fence", "fence.txt", "FENCE", r"5001 3 47\.396\d+ 8\.544"),
        ("rally", "rally.txt", "RALLY", r"5100 3 47\.3975"),
    ],
)
def test_list_is_loaded_and_listed(console, module, file, kind, listed):
    console.do(f"{module} load {file}", f"Got MISSION_ACK: TYPE_{kind}: ACCEPTED")
    console.do(f"{module} list", listed)
    console.expect("Saved")


def test_lists_go_up_and_come_down_as_files(console):
    console.do("wp clear", "wp> |LOITER> |ACCEPTED")
    console.do("wp ftpload plan.txt", "Sent waypoint of length 5")
    console.do("wp ftp", r"22 3 47\.397742\d* 8\.545594\d* 10\.0")
    console.expect("Saved")
    console.do("rally ftp", r"5100 3 47\.3975")
    console.expect("Saved")


def test_folders_of_ardupilot_are_there(console):
    console.do("ftp list @SYS", r"threads\.txt")
    console.do("ftp list /APM/LOGS", r"flight\.ulg")
    console.do("ftp list @MISSION", r"mission\.dat")


def test_vehicle_tells_the_date(console):
    year = datetime.now(UTC).year
    console.do("time", rf"{year} \(.*{year}\)", 10.0)


def test_simulator_is_told_of_wind_and_pace(console):
    console.do("param set SIM_WIND_SPD 3", "LOITER> ")
    console.shows("param show SIM_WIND_SPD", r"SIM_WIND_SPD +3\.0")
    console.do("param set SIM_WIND_SPD 0", "LOITER> ")
    console.shows("param show SIM_SPEEDUP", rf"SIM_SPEEDUP +{SPEED}")


def test_motor_turns_and_a_switch_changes_the_mode(console):
    console.do("long DO_MOTOR_TEST 1 0 10 1 1", "DO_MOTOR_TEST: ACCEPTED")
    console.expect("Motor test: finished")
    console.do("long DO_AUX_FUNCTION 55 2", "DO_AUX_FUNCTION: ACCEPTED")
    console.expect("Mode GUIDED")
    console.do("long DO_AUX_FUNCTION 55 0", "DO_AUX_FUNCTION: ACCEPTED")
    console.expect("Mode LOITER")


def test_modes_are_changed_by_name(console):
    """On the ground, where a simulated radio lies beside the vehicle; not all of them can be armed in."""
    for name in ("STABILIZE", "ALT_HOLD", "poshold", "ACRO", "RTL", "LAND", "CIRCLE", "BRAKE", "LOITER"):
        console.do(f"mode {name}", f"{name.upper()}> ")
    console.do("mode LAND", "LAND> ")
    console.do("arm throttle", "Mode not armable")
    console.do("mode GUIDED", "GUIDED> ")


def test_the_autopilot_alone_is_detected(console):
    assert "Detected vehicle" not in console.heard().split("Detected vehicle 1:1", 1)[1]


def test_sticks_are_overridden_and_given_back_to_the_radio(console):
    console.do("mode ALT_HOLD", "ALT_HOLD> ")
    console.child.sendline("set altreadout 2")
    console.do("arm throttle", "ARMED")
    console.child.sendline("rc 3 1700")
    console.expect("height [3456]")
    console.child.sendline("rc 3 1500")
    console.do("mode LOITER", "LOITER> ")
    before = len(console.heard())
    console.child.sendline("rc clear")
    console.do("watch RC_CHANNELS", r"chan3_raw : 1000")
    console.child.sendline("watch")
    console.do("mode LAND", "LAND> ")
    console.expect("DISARMED", 90.0)
    assert "Sticks lost" not in console.heard()[before:]
    console.do("mode GUIDED", "GUIDED> ")  # until then it has stayed in LAND
    assert "LOITER> " not in console.heard().rsplit("LAND> ", 1)[1]


def test_guided_flight(console):
    console.child.sendline("set altreadout 2")
    console.do("arm throttle", "ARMED")
    console.do("takeoff 8", "NAV_TAKEOFF: ACCEPTED")
    console.expect("height [678]")
    console.do("guided 47.397842 8.545694 12", "DO_REPOSITION: ACCEPTED")
    console.do("setspeed 3", "DO_CHANGE_SPEED: ACCEPTED")
    console.expect("height 1[012]")
    console.do("mode BRAKE", "BRAKE> ")
    console.do("mode LOITER", "LOITER> ")


def test_mission_is_flown_and_the_vehicle_returns_and_disarms(console):
    console.do("wp set 1", r"MISSION_CURRENT|ACCEPTED|waypoint 1|LOITER> ")
    console.do("auto", "AUTO> ")
    console.expect("waypoint 3", 60.0)
    console.do("rtl", "RTL> ")
    console.expect("AP: Landed", 120.0)
    console.expect("DISARMED", 30.0)


def test_unknown_command_number_is_refused_by_name(console):
    console.do("long DO_PARACHUTE 2", "DO_PARACHUTE: (UNSUPPORTED|DENIED|FAILED)")
