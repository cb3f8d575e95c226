"""The console command in a process, with UDP ports and a run folder of its own."""

import signal
import socket
import subprocess
import sys
from pathlib import Path

HONEYGUIDE = str(Path(sys.executable).with_name("honeyguide"))
ROOT = Path(__file__).parents[2]
STOP_TIMEOUT_S = 30.0  # wall clock; on a busy machine writing the log and the picture takes seconds


def honeyguide(*arguments, timeout_s=300.0):
    """Runs the console command to its end."""
    command = [HONEYGUIDE, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout_s, check=False, cwd=ROOT)


def free_ports():
    """A ground station's and an API client's port; they and the vehicle's own ports are free."""
    for port in range(20_000 + hash_of_process(), 60_000, 7):
        if all(is_free(each) for each in (port, port + 4020, port + 1, port + 41)):
            return port, port + 1
    raise RuntimeError("no free ports")


def hash_of_process():
    """Spreads the ports of test processes that run at the same time."""
    from os import getpid

    return 13 * getpid() % 30_000


def is_free(port, kind=socket.SOCK_DGRAM):
    with socket.socket(socket.AF_INET, kind) as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True


class IdleVehicle:
    """A vehicle that waits for clients, faster than real time; a context manager.

    Args:
        folder: where its logs go.
        speed: times real time. The clients' timers run on the wall clock.
        arguments: of `honeyguide fly`.
    """

    def __init__(self, folder, *arguments, speed=5.0):
        self.folder = folder / "flight"
        self.gcs_port, self.api_port = free_ports()
        self._output = (folder / "output.txt").open("w+")
        ports = ["--gcs-port", self.gcs_port, "--api-port", self.api_port]
        command = [HONEYGUIDE, "fly", "--idle", "--speed", speed, *ports, "--run-folder", self.folder, *arguments]
        self._process = subprocess.Popen(
            [str(word) for word in command], stdout=self._output, stderr=subprocess.STDOUT, cwd=ROOT
        )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self._process.poll() is None:
            self.stop()
        self._output.close()

    def kill(self):
        """Ends it as a loss of power would."""
        self._process.kill()
        self._process.wait(STOP_TIMEOUT_S)

    def stop(self):
        """Ctrl-C; returns the exit code and what was printed."""
        self._process.send_signal(signal.SIGINT)
        try:
            exit_code = self._process.wait(STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            raise
        self._output.seek(0)
        return exit_code, self._output.read()
