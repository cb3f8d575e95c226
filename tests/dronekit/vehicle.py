"""A vehicle in ArduPilot's dialect in a process of its own, and dronekit connected to it over TCP.

Runs in dronekit's environment: nothing of the project is imported but its clock.
"""

import collections
import collections.abc
import signal
import socket
import subprocess
import threading
from pathlib import Path

from common.clock import wall_time_s

collections.MutableMapping = collections.abc.MutableMapping  # dronekit 2.9.2 knows it by its name before Python 3.10
import dronekit  # noqa: E402

ROOT = Path(__file__).parents[2]
HOME = (-35.363261, 149.165230, 584.0)
SPEED = 3.0  # times real time; dronekit's timers run on the wall clock
START_TIMEOUT_S, STOP_TIMEOUT_S, PATIENCE_S = 120.0, 30.0, 60.0


def free_ports(kind, count):
    """Ports that are free now."""
    probes = [socket.socket(socket.AF_INET, kind) for _ in range(count)]
    for probe in probes:
        probe.bind(("127.0.0.1", 0))
    ports = [probe.getsockname()[1] for probe in probes]
    for probe in probes:
        probe.close()
    return ports


class Vehicle:
    """A waiting vehicle; a context manager."""

    def __init__(self, folder):
        (tcp_port,), udp_ports = free_ports(socket.SOCK_STREAM, 1), free_ports(socket.SOCK_DGRAM, 2)
        self.address = f"tcp:127.0.0.1:{tcp_port}"
        words = ["fly", "--idle", "--dialect", "ardupilot", "--speed", SPEED, "--tcp-port", tcp_port, "--trees", 0]
        words += ["--gcs-port", udp_ports[0], "--api-port", udp_ports[1], "--run-folder", folder / "flight"]
        words.append(f"--home={','.join(map(str, HOME))}")
        self._output = (folder / "vehicle.txt").open("w")
        command = [str(ROOT / ".venv" / "bin" / "honeyguide"), *map(str, words)]
        self._process = subprocess.Popen(command, stdout=self._output, stderr=subprocess.STDOUT, cwd=ROOT)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.send_signal(signal.SIGINT)
        try:
            self._process.wait(STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            raise
        finally:
            self._output.close()

    def connect(self, **options):
        """As a script does; as soon as the vehicle's port is open."""
        end_s = wall_time_s() + START_TIMEOUT_S
        host, port = self.address.split(":")[1:]
        while True:
            try:
                socket.create_connection((host, int(port)), 1.0).close()
                break
            except OSError:
                if self._process.poll() is not None or wall_time_s() > end_s:
                    raise
        return dronekit.connect(self.address, **options)


def until(condition, patience_s=PATIENCE_S):
    """Waits for what dronekit's own thread receives."""
    end_s = wall_time_s() + patience_s
    pause = threading.Event()
    while not condition():
        assert wall_time_s() < end_s, "waited in vain"
        pause.wait(0.05)
