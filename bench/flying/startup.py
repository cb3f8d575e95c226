"""How long is the first compile of everything, and how long is it from a command to its first sign of life?"""

import os
import resource
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from bench.row import Row, best_of, require

HEARTBEAT_ID = 0
MAVLINK_2 = 0xFD
TIMEOUT_S = 120.0
POLL_S = 0.2
COMMAND = "python -m bench startup"
HONEYGUIDE = str(Path(sys.executable).with_name("honeyguide"))
FIRST_LINES = (
    ("fly", "--idle", "--speed", "max", "--seconds", "1"),
    ("follow", "--speed", "max", "--seconds", "1", "--no-mp4"),
    ("eval", "RollerBall", "--episodes", "1"),
    ("play", "RollerBall", "--mp4", "film.mp4", "--episodes", "1"),
    ("train", "RollerBall", "--run-id", "bench"),
)
WRONG = (
    ("fly", "--plan", "nowhere.plan"),
    ("fly", "--param", "NOTHING=1"),
    ("fly", "--airframe", "nothing"),
    ("follow", "--policy", "nothing"),
    ("companion", "--policy", "nothing"),
    ("estimate", "nowhere.ulg"),
    ("replay", "nowhere"),
    ("train", "Nothing"),
    ("eval", "nothing"),
    ("play", "nothing"),
)
EVERYTHING = """
import gymnasium
import policies
from bench.flying.fleet import hovering
from mission.flight import Flight, FlightConfig
Flight(FlightConfig()).frame()
gymnasium.make("honeyguide/Hover-v0").reset(seed=0)
hovering(1, has_estimator=False)
"""


def measure() -> list[Row]:
    return [
        Row("first compile of everything", _compile_s(), "s", "lower", 60.0, COMMAND),
        Row("warm start: command to first heartbeat", _heartbeat_s(), "s", "lower", 3.0, COMMAND),
        Row("command to first line, slowest command", max(map(_first_line_s, FIRST_LINES)), "s", "lower", 1.0, COMMAND),
        Row("wrong argument to its sentence, CPU, worst", max(map(_refusal_s, WRONG)), "s", "lower", 1.5, COMMAND),
    ]


def _compile_s() -> float:
    """A process that flies each kind of rig a little, with an empty kernel cache."""
    with TemporaryDirectory() as cache:
        environment = os.environ | {"WARP_CACHE_PATH": cache}
        start = time.perf_counter()
        subprocess.run([sys.executable, "-c", EVERYTHING], env=environment, check=True, stdout=subprocess.DEVNULL)
        spent = time.perf_counter() - start
        require(any(Path(cache).rglob("*.o")), "nothing was compiled")
    return spent


def _heartbeat_s() -> float:
    _first_heartbeat_s()  # fills the kernel cache where it is empty
    return best_of(3, _first_heartbeat_s)


def _first_line_s(words: tuple[str, ...]) -> float:
    """From the command to the first line that it prints; it is stopped then."""

    def once() -> float:
        with TemporaryDirectory() as folder:
            start = time.perf_counter()
            process = subprocess.Popen([HONEYGUIDE, *words], stdout=subprocess.PIPE, text=True, cwd=folder)
            line = process.stdout.readline() if process.stdout else ""
            spent = time.perf_counter() - start
            process.kill()
            process.communicate(timeout=TIMEOUT_S)
            require(bool(line.strip()), f"honeyguide {' '.join(words)} printed nothing")
            return spent

    return best_of(3, once)


def _refusal_s(words: tuple[str, ...]) -> float:
    """CPU time of a command that refuses what it was given."""

    def once() -> float:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([HONEYGUIDE, *words], capture_output=True, text=True, check=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        is_refused = done.returncode == 2 and len(done.stderr.splitlines()) == 1
        require(is_refused, f"honeyguide {' '.join(words)}: no refusal")
        return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime

    return best_of(3, once)


def _first_heartbeat_s() -> float:
    """Starts `honeyguide fly --idle`, waits for a MAVLink heartbeat on the ground station's port and stops it."""
    with TemporaryDirectory() as folder, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as station:
        station.bind(("127.0.0.1", 0))
        station.settimeout(POLL_S)
        command = [HONEYGUIDE, "fly", "--idle", "--gcs-port", str(station.getsockname()[1]), "--run-folder", folder]
        start = time.perf_counter()
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        try:
            while not _is_heartbeat(_received(station)):
                require(process.poll() is None, "honeyguide fly ended before its first heartbeat")
                require(time.perf_counter() - start < TIMEOUT_S, f"no heartbeat in {TIMEOUT_S:.0f} s")
            return time.perf_counter() - start
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=TIMEOUT_S)


def _received(station: socket.socket) -> bytes:
    """The next datagram, or nothing for a while."""
    try:
        return station.recv(2048)
    except TimeoutError:
        return b""


def _is_heartbeat(datagram: bytes) -> bool:
    """MAVLink 2 frame whose 24-bit message id is that of HEARTBEAT."""
    return len(datagram) >= 10 and datagram[0] == MAVLINK_2 and int.from_bytes(datagram[7:10], "little") == HEARTBEAT_ID
