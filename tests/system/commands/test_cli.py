"""The console command: wrong input gives one sentence and exit code 2, a failed mission 1, a flown one 0."""

import json
import re
import signal
import socket
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest
from pyulog import ULog

from mission.cli import main
from mission.plan.plan_file import DEFAULT_PLAN
from tests.system.vehicle import HONEYGUIDE, ROOT, IdleVehicle, free_ports, honeyguide

LOCKSTEP = ("--once", "--speed", "max")


def assert_refused(result, pattern):
    """Exit code 2 and one sentence, nothing else."""
    assert result.returncode == 2, result.stderr
    assert "Traceback" not in result.stderr
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1, result.stderr
    assert re.search(pattern, lines[0]), lines[0]
    assert lines[0].startswith("honeyguide: ")


RUN_FILES = ["flight.png", "flight.tlog", "flight.ulg", "summary.json"]  # of a whole flight


@pytest.fixture
def here(capfd, monkeypatch):
    """Runs the console command to its end in this process, which has the program loaded already."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["honeyguide", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        stdout, stderr = capfd.readouterr()
        return SimpleNamespace(returncode=end.value.code, stdout=stdout, stderr=stderr)

    return run


@pytest.fixture
def fly(tmp_path, here):
    """Runs a lockstep flight into a folder of the test."""

    def run(*arguments, command=here):
        return command("fly", *LOCKSTEP, "--run-folder", tmp_path / "flight", *arguments)

    return run


def plan_with_a_vtol_takeoff():
    """The default plan with a VTOL's take-off: valid in a file, not flown here."""
    plan = json.loads(DEFAULT_PLAN.read_text())
    plan["mission"]["items"][1]["command"] = 84
    return json.dumps(plan)


def test_missing_plan_is_refused(fly, tmp_path):
    assert_refused(fly("--plan", tmp_path / "none.plan"), r"none\.plan: No such file")
    assert list(tmp_path.iterdir()) == []


def test_port_in_use_is_refused(here, tmp_path):
    gcs_port, api_port = free_ports()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", api_port + 40))
        result = here(
            "fly", "--idle", "--gcs-port", gcs_port, "--api-port", api_port, "--run-folder", tmp_path / "flight"
        )
    assert_refused(result, rf"UDP port {api_port + 40} is in use .*: choose --gcs-port or --api-port$")
    assert list(tmp_path.iterdir()) == []


def test_a_second_vehicle_on_the_same_ports_is_told_before_anything_is_loaded():
    gcs_port, api_port = free_ports()
    words = ["fly", "--idle", "--gcs-port", str(gcs_port), "--api-port", str(api_port)]
    code = f"""
import sys
from mission.cli import app
try:
    app({words})
except SystemExit as end:
    print(end.code, *sys.modules)
"""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", gcs_port + 4020))
        result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    exit_code, *modules = result.stdout.split()
    assert exit_code == "2"
    assert "another flight may be running" in result.stderr
    assert not {
        "mission.flight",
        "sim.rig",
        "autopilot.flight_controller",
        "matplotlib",
        "cv2",
        "viser",
        "torch",
    } & set(modules)


def test_folder_with_a_flight_is_left_alone(fly, tmp_path):
    log = tmp_path / "flight" / "flight.ulg"
    log.parent.mkdir()
    log.write_bytes(b"an earlier flight")
    assert_refused(fly(), r"already holds a flight")
    assert log.read_bytes() == b"an earlier flight"
    assert list(log.parent.iterdir()) == [log]


def test_flown_mission_gives_0_and_a_whole_run_folder(fly, tmp_path):
    result = fly("--wind", "5", command=honeyguide)
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    assert "mission completed" in result.stdout
    folder = tmp_path / "flight"
    assert sorted(path.name for path in folder.iterdir()) == RUN_FILES
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["is_success"] is True
    assert summary["cross_track_p95_m"] < 1.5
    assert (folder / "flight.png").read_bytes().startswith(b"\x89PNG")


def test_mission_is_flown_at_a_pace_too(here, tmp_path):
    gcs_port, api_port = free_ports()
    result = here(
        "fly", "--once", "--speed", "50", "--gcs-port", gcs_port, "--api-port", api_port, "--run-folder", tmp_path / "f"
    )
    assert result.returncode == 0, result.stderr
    assert "mission completed" in result.stdout


def test_mission_that_the_vehicle_refuses_gives_1(fly, tmp_path):
    plan = tmp_path / "vtol.plan"
    plan.write_text(plan_with_a_vtol_takeoff())
    result = fly("--plan", plan)
    assert result.returncode == 1, result.stderr
    assert "Traceback" not in result.stderr
    summary = json.loads((tmp_path / "flight" / "summary.json").read_text())
    assert not summary["is_success"]
    assert "item 2" in summary["result"]
    ULog(str(tmp_path / "flight" / "flight.ulg"))  # is whole


def test_mission_far_away_gives_1(fly):
    result = fly("--plan", str(DEFAULT_PLAN), "--home", "-33.9,18.4,20")
    assert result.returncode == 1, result.stderr
    assert "km away" in result.stdout


def test_flight_ends_when_its_time_is_over(fly, tmp_path):
    result = fly("--seconds", "0.1")
    assert result.returncode == 1
    assert result.stderr == ""
    lines = result.stdout.splitlines()
    assert lines[0] == "loading the program ..."
    lines = [line for line in lines[1:] if not line.endswith("so far")]
    assert lines[:2] == ["flying: lockstep, without network links", f"logs: {tmp_path / 'flight'}"]
    assert lines[2:4] == ["result: mission not finished", "simulated: 0.1 s, never armed"]
    assert "nan" not in result.stdout
    assert json.loads((tmp_path / "flight" / "summary.json").read_text())["simulated_s"] == pytest.approx(0.1)


def test_idle_vehicle_stops_on_interrupt_with_its_log_whole(tmp_path):
    with IdleVehicle(tmp_path) as vehicle:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as station:
            station.bind(("127.0.0.1", vehicle.gcs_port))
            station.settimeout(120.0)
            for _ in range(100):  # the first comes in the middle of the first frame
                assert station.recv(1000)[0] == 0xFD  # MAVLink 2
        exit_code, output = vehicle.stop()
    assert exit_code == 0, output
    assert "stopped by the user" in output
    assert "Traceback" not in output
    ULog(str(vehicle.folder / "flight.ulg"))


def test_sigterm_ends_a_flight_like_an_interrupt(tmp_path):
    """The line that says where it flies comes at once, also into a pipe; a service manager's SIGTERM ends it whole."""
    gcs_port, api_port = free_ports()
    folder = tmp_path / "flight"
    words = ["fly", "--idle", "--wind", 17, "--gcs-port", gcs_port, "--api-port", api_port, "--run-folder", folder]
    process = subprocess.Popen(
        [HONEYGUIDE, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    lines = iter(process.stdout.readline, "")
    assert next(lines).strip() == "loading the program ..."
    first = next(line.strip() for line in lines if not line.endswith("so far\n"))
    assert first == f"flying: UDP {gcs_port} (ground stations), {api_port} (offboard API)"
    assert next(lines).strip() == f"logs: {folder}"
    assert next(lines).strip() == "wind of 17 m/s is more than an x500 can be relied on to fly"
    time.sleep(0.5)
    process.send_signal(signal.SIGTERM)
    output, errors = process.communicate(timeout=60.0)
    assert process.returncode == 0, errors
    assert "stopped by the user" in output
    assert errors == ""
    assert sorted(path.name for path in folder.iterdir()) == RUN_FILES
    ULog(str(folder / "flight.ulg"))


def test_a_terminal_that_is_closed_ends_a_flight_like_an_interrupt(tmp_path):
    gcs_port, api_port = free_ports()
    folder = tmp_path / "flight"
    words = ["fly", "--idle", "--gcs-port", gcs_port, "--api-port", api_port, "--run-folder", folder]
    process = subprocess.Popen(
        [HONEYGUIDE, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert any(line.startswith("logs: ") for line in iter(process.stdout.readline, ""))
    time.sleep(0.5)
    process.send_signal(signal.SIGHUP)
    process.stdout.close()  # what is printed from now on would fail
    with process.stderr:
        errors = process.stderr.read()
    assert process.wait(timeout=60.0) == 0, errors
    assert errors == ""
    assert sorted(path.name for path in folder.iterdir()) == RUN_FILES
    ULog(str(folder / "flight.ulg"))


def test_interrupt_while_starting_is_no_traceback(tmp_path):
    ports = [str(port) for port in free_ports()]
    process = subprocess.Popen(
        [HONEYGUIDE, "fly", "--idle", "--gcs-port", ports[0], "--api-port", ports[1], "--run-folder", tmp_path / "f"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while not (tmp_path / "f").exists() and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60.0)
    assert "Traceback" not in errors
    assert process.returncode != 0


def test_help_names_the_options(here):
    result = here("fly", "--help")
    assert result.returncode == 0
    for option in ("--plan", "--once", "--speed", "--seconds", "--seed", "--wind", "--airframe", "--home"):
        assert option in result.stdout
