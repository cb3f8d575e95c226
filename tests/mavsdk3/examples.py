"""Do the examples that come with MAVSDK-Python fly, as they are? `python -m tests.mavsdk3.examples FOLDER`.

Each example of the folder runs, unmodified, in MAVSDK 3's environment against a vehicle started for it alone, at real
time, on the ports that the examples expect (14540, 14550). It passes if it ends as it should (many run for ever and are
stopped), has printed what it should and nothing of an exception, and the vehicle truly did what it was asked.
"""

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import mkdtemp
from time import monotonic, sleep

import numpy as np
from pyulog import ULog
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[2]
HONEYGUIDE = Path(sys.executable).with_name("honeyguide")
IDLE = ("--idle",)
START_S, STOP_S = 120.0, 30.0
LANDING_S = 30.0  # after an example that leaves as soon as it has asked for a landing
RAISED = re.compile(r"Traceback|^\w*(Error|Exception)\b|terminate called", re.MULTILINE)
HARMED = re.compile(r"Crash detected|has failed|Traceback")
FIRMWARE = "etc/extras/px4_io-v2_default.bin"  # what ftp_download_file asks for
PARAMETERS = "1\t1\tMPC_XY_CRUISE\t4.0\t9\n1\t1\tMIS_TAKEOFF_ALT\t3.0\t9\n1\t1\tNAV_DLL_ACT\t0\t6\n"


@dataclass(frozen=True, slots=True)
class Example:
    """One example and what is expected of it."""

    name: str
    prints: tuple[str, ...] = ()
    seconds: float = 30.0  # wall clock: the limit, or how long one that never ends is listened to
    is_endless: bool = False
    rises: tuple[float, float] | None = None  # [m] between what its greatest height truly lies; None: stays down
    lands: bool = False
    vehicle: tuple[object, ...] = IDLE
    arguments: tuple[str, ...] = ()
    has_server: bool = False  # it wants a mavsdk_server beside it


def endless(name, *prints, seconds=12.0, **more):
    return Example(name, prints, seconds, is_endless=True, **more)


EXAMPLES = (
    Example("all_params", ("SYS_AUTOSTART: ", "MPC_XY_CRUISE: ")),
    Example("calibration", ("-- Board level calibration finished",), 90.0),
    Example("do_orbit", ("--- Landing",), 120.0, rises=(10.0, 16.0)),
    Example("failure_injection", ("-- Disabling failure injection",), 90.0, rises=(15.0, 30.0), lands=True),
    Example("firmware_version", ("flight_sw_major: 1",)),
    Example("follow_me_example", ("-- Following Target", "-- Landing"), 60.0, rises=(2.0, 12.0), lands=True),
    Example("ftp_download_file", ("Got 40000 of 40000 bytes",), 60.0, has_server=True),
    Example("ftp_list_dir", ("directory list", "etc"), has_server=True),
    Example("geofence", ("Geofence uploaded!",)),
    endless("goto", "Staying connected", seconds=60.0, rises=(18.0, 22.0)),
    endless("gripper", "-- Gripper Release"),
    endless("highres_imu", "HIGHRES_IMU (105)", "Z Gyro (rad/s): "),
    Example("logfile_download", ("Downloading: log", " %"), 120.0),
    endless("manual_control", "-- Starting manual control", rises=(1.0, 120.0), seconds=40.0),
    endless("mavlink_direct_receive", "ATTITUDE from 1/1"),
    Example("mavlink_direct_send", ("Sending airspeed 19...",)),
    Example("mission", ("Mission progress: 3/3",), 180.0, rises=(25.0, 35.0), lands=True),
    Example("mission_import", ("5 mission items", "Mission uploaded")),
    Example("mission_raw", ("-- Done",)),
    Example("offboard_attitude", ("-- Hover at 60% thrust", "-- Stopping offboard"), 60.0, rises=(5.0, 40.0)),
    Example("offboard_from_csv", ("-- Shape completed", "-- Disarming"), 260.0, rises=(13.0, 30.0), lands=True),
    Example("offboard_position_ned", ("-- Stopping offboard",), 90.0, rises=(4.0, 6.0)),
    Example("offboard_position_velocity_ned", ("-- Stopping offboard",), 90.0, rises=(9.0, 11.0)),
    Example("offboard_velocity_body", ("-- Fly a circle sideways", "-- Stopping offboard"), 100.0, rises=(3.0, 7.0)),
    Example("offboard_velocity_ned", ("-- Stopping offboard",), 90.0, rises=(4.0, 8.0)),
    endless("px4_ev_automation", "Setting EV params...", "Landed state: ON_GROUND", "Flight Mode: ", seconds=30.0),
    Example("rtcm"),
    Example("send_status_message", ("-- Connected to drone!",)),
    Example("takeoff_and_land", ("-- Taking off", "-- Landing"), 60.0, rises=(2.0, 3.5), lands=True),
    endless("telemetry", "Battery: ", "GPS info: ", "In air: False", "Position: "),
    endless("telemetry_flight_mode", "FlightMode: HOLD"),
    endless("telemetry_is_armed_is_in_air", "Is_armed: False", "Is_in_air: False"),
    endless("telemetry_status_text", "Statustext: ", vehicle=(), rises=(5.0, 60.0), seconds=20.0),  # who flies talks
    Example("telemetry_takeoff_and_land", ("Altitude: 10", "-- Landing"), 90.0, rises=(9.0, 11.0), lands=True),
    endless("transponder", "Waiting for transponder messages", "AdsbVehicle: ", vehicle=(*IDLE, "--traffic", 8)),
    Example("tune", ("Tune played",)),
    Example(
        "upload_params",
        ("Connected to the Vehicle", "Params uploaded!"),
        arguments=("udpin://0.0.0.0:14540", "x.params"),
    ),
    endless("winch", "-- Winch action: load payload", "Staying connected"),
)
CANNOT_BE_JUDGED = {
    "camera": "calls set_mode and take_photo without the camera's number, which MAVSDK 3 asks for",
    "camera_params": "waits for a keyboard, with a package of its own",
    "gimbal": "waits for the end of a stream that has none, and then has no list of gimbals",
    "px4_ev_automation_keyboard": "waits for a keyboard",
    "rtk_base_ublox": "reads a GNSS receiver at a serial port",
    "shell": "its loop ends at once, before anything is typed",
    "show_debug_output": "connects to an invalid address on purpose",
}


@dataclass(frozen=True, slots=True)
class Verdict:
    """What came of one example; no fault: it passes."""

    fault: str
    height_m: float
    seconds: float


def run_example(example, script, python, folder):
    """Starts a vehicle, runs the example against it and judges both."""
    run = folder / "run"
    extras = run / "files" / FIRMWARE
    extras.parent.mkdir(parents=True)
    extras.write_bytes(bytes(40_000))
    (script.parent / "x.params").write_text(PARAMETERS)
    began_s = monotonic()
    with background(
        [HONEYGUIDE, "fly", *example.vehicle, "--run-folder", run], folder / "vehicle.txt", ROOT
    ) as vehicle:
        await_text(folder / "vehicle.txt", "flying:", vehicle)
        server = [next(python.parent.parent.glob("lib/python*/site-packages/mavsdk/bin/mavsdk_server")), "-p", "50051"]
        beside = [*server, "udpin://0.0.0.0:14540"] if example.has_server else ["true"]
        with background(beside, folder / "server.txt", script.parent):
            fault = fault_of_client(example, [python, "-u", script.name, *example.arguments], script.parent, folder)
        if example.lands and not fault:
            sleep(LANDING_S)
    height_m, end_m = heights_m(run)
    return Verdict(fault or fault_of_vehicle(example, folder, height_m, end_m), height_m, monotonic() - began_s)


@contextmanager
def background(command, output, cwd):
    """A process with a group of its own, that ends with the block."""
    with output.open("w") as file:
        process = subprocess.Popen(
            [str(word) for word in command],
            stdout=file,
            stderr=file,
            stdin=subprocess.DEVNULL,
            cwd=cwd,
            process_group=0,
        )
        try:
            yield process
        finally:
            end(process)


def end(process):
    """Ends a process and those that it started; without mercy if it does not hear."""
    for number, seconds in ((signal.SIGTERM, STOP_S), (signal.SIGKILL, STOP_S)):
        try:
            os.killpg(process.pid, number)
            process.wait(seconds)
        except subprocess.TimeoutExpired:
            continue
        except ProcessLookupError:
            pass
        return


def await_text(path, text, process):
    until_s = monotonic() + START_S
    while text not in path.read_text():
        if process.poll() is not None or monotonic() > until_s:
            raise SystemExit(f"the vehicle does not start:\n{path.read_text()}")
        sleep(0.2)


def fault_of_client(example, command, cwd, folder):
    """Runs the example to its end or its time; what is wrong with how it ended and with what it has printed."""
    path = folder / "client.txt"
    with background(command, path, cwd) as client:
        try:
            ended = client.wait(example.seconds)
        except subprocess.TimeoutExpired:
            ended = None
        printed = path.read_text(errors="replace")  # before it is stopped, which prints a traceback
    if raised := RAISED.search(printed):
        return f"it raised: {printed[raised.start() :].strip().splitlines()[-1]}"
    if example.is_endless and ended is not None:
        return f"it ended, with exit code {ended}"
    if not example.is_endless and ended != 0:
        return f"not over after {example.seconds:g} s" if ended is None else f"exit code {ended}"
    missing = [text for text in example.prints if text not in printed]
    return f"it never printed {missing[0]!r}" if missing else ""


def heights_m(run):
    """The greatest true height above the start, and the last."""
    logs = sorted(run.glob("*.ulg"))
    if not logs:
        return float("nan"), float("nan")
    down_m = ULog(str(logs[0]), ["vehicle_local_position_groundtruth"]).data_list[0].data["z"]
    return float(np.max(down_m[0] - down_m)), float(down_m[0] - down_m[-1])


def fault_of_vehicle(example, folder, height_m, end_m):
    """What the vehicle did that it should not have done, by its texts and by the truth."""
    if harm := HARMED.search((folder / "vehicle.txt").read_text()):
        return f"the vehicle: {harm.group()}"
    low_m, high_m = example.rises or (-0.5, 0.5)
    if not low_m <= height_m <= high_m:
        return f"it rose to {height_m:.1f} m instead of {low_m:g} to {high_m:g} m"
    return f"{end_m:.1f} m high in the end" if example.lands and not abs(end_m) < 0.5 else ""


def main():
    parser = argparse.ArgumentParser(prog="python -m tests.mavsdk3.examples", description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="the examples")
    parser.add_argument(
        "--python", type=Path, default=ROOT / ".venv-mavsdk3/bin/python", help="of MAVSDK 3's environment"
    )
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="these alone")
    asked = parser.parse_args()
    if not asked.folder.is_dir() or not asked.python.exists():
        parser.error(f"{asked.folder if asked.python.exists() else asked.python}: there is none")
    kept = Path(mkdtemp(prefix="examples-"))
    copies = shutil.copytree(asked.folder, kept / "examples")  # they write beside themselves
    only = {name.removesuffix(".py") for name in asked.only}
    scripts = {path.stem: path for path in sorted(copies.rglob("*.py")) if not only or path.stem in only}
    if missing := sorted(only - scripts.keys()):
        parser.error(f"{asked.folder} has no example {missing[0]}")
    console, table = Console(), Table("example", "verdict", "highest [m]", "took [s]")
    faults = 0
    for name, script in scripts.items():
        example = next((each for each in EXAMPLES if each.name == name), None)
        if example is None:
            table.add_row(
                name, f"not judged: {CANNOT_BE_JUDGED.get(name, 'nobody has said what it should do')}", "", ""
            )
            continue
        verdict = run_example(example, script, asked.python.absolute(), kept / name)
        faults += bool(verdict.fault)
        table.add_row(name, verdict.fault or "passes", f"{verdict.height_m:.1f}", f"{verdict.seconds:.0f}")
        console.print(f"{name}: {verdict.fault or 'passes'}", highlight=False, markup=False)
    console.print(table)
    judged = sum(example.name in scripts for example in EXAMPLES)
    console.print(f"{judged - faults} of {judged} that can be judged pass, {len(scripts) - judged} cannot be judged")
    if faults or not judged:
        console.print(f"what they and their vehicles said, and the logs: {kept}")
        return 1
    shutil.rmtree(kept)
    return 0


if __name__ == "__main__":
    sys.exit(main())
