"""A vehicle in ArduPilot's dialect and MAVProxy on its console, each in a process of its own.

Runs in MAVProxy's environment: nothing of the project is imported but its clock.
"""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pexpect

from common.clock import wall_time_s

ROOT = Path(__file__).parents[2]
MODULES = "log,wp,rally,fence,param,arm,mode,rc,cmdlong,misc,signing,ftp,output,link"
SPEED = 4.0  # times real time; MAVProxy's timers run on the wall clock
STOP_TIMEOUT_S = 30.0
START_TIMEOUT_S = 120.0  # with a cold cache the kernels are compiled first


def free_port():
    """A UDP port that is free, and the vehicle's own end with it."""
    for port in range(26_000 + os.getpid() % 2000, 40_000, 7):
        try:
            for each in (port, port + 4020, port + 1, port + 41):
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                    probe.bind(("127.0.0.1", each))
        except OSError:
            continue
        return port
    raise RuntimeError("no free ports")


class Console:
    """MAVProxy connected to a waiting vehicle, made with further arguments; a context manager."""

    def __init__(self, folder, *further):
        self.folder = folder
        port = free_port()
        honeyguide = ROOT / ".venv" / "bin" / "honeyguide"
        arguments = [
            "fly",
            "--idle",
            "--dialect",
            "ardupilot",
            "--speed",
            SPEED,
            "--gcs-port",
            port,
            "--api-port",
            port + 1,
            *further,
        ]
        output = folder / "vehicle.txt"
        self._output = output.open("w")
        self._vehicle = subprocess.Popen(
            [str(word) for word in (honeyguide, *arguments, "--run-folder", folder / "flight")],
            stdout=self._output,
            stderr=subprocess.STDOUT,
            cwd=ROOT,
        )
        self._wait_for_vehicle(output)
        self.child = pexpect.spawn(
            str(Path(sys.executable).with_name("mavproxy.py")),
            [
                f"--master=udpin:127.0.0.1:{port}",
                f"--state-basedir={folder}",
                "--dialect=ardupilotmega",
                f"--default-modules={MODULES}",
                "--streamrate=4",
            ],
            env=dict(os.environ, HOME=str(folder), TERM="dumb"),
            encoding="utf-8",
            timeout=30,
            cwd=str(folder),
        )
        self.child.logfile_read = (folder / "mavproxy.txt").open("w", buffering=1)

    def _wait_for_vehicle(self, output):
        """MAVProxy asks too early, and for system 0, if the vehicle comes up after it."""
        end_s = wall_time_s() + START_TIMEOUT_S
        while "flying" not in output.read_text():
            if self._vehicle.poll() is not None or wall_time_s() > end_s:
                raise RuntimeError(f"the vehicle did not start: {output.read_text()}")
            time.sleep(0.1)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.child.sendeof()
        self.child.expect(pexpect.EOF, timeout=10)
        self.child.close(force=True)
        self.child.logfile_read.close()
        self._vehicle.send_signal(signal.SIGINT)
        try:
            self._vehicle.wait(STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._vehicle.kill()
            raise
        finally:
            self._output.close()

    def heard(self):
        """All that MAVProxy has printed so far."""
        return (self.folder / "mavproxy.txt").read_text()

    def expect(self, pattern, timeout_s=30.0):
        """Waits for a text; returns what matched."""
        self.child.expect(pattern, timeout=timeout_s)
        return self.child.match

    def do(self, line, pattern, timeout_s=30.0):
        """Types a command and waits for a text."""
        self.child.sendline(line)
        return self.expect(pattern, timeout_s)

    def shows(self, line, pattern, timeout_s=30.0):
        """Types a command again and again until it shows a text: MAVProxy sets parameters beside its console."""
        end_s = wall_time_s() + timeout_s
        while True:
            try:
                return self.do(line, pattern, 2.0)
            except pexpect.TIMEOUT:
                if wall_time_s() > end_s:
                    raise
