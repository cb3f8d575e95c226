"""A Ray head with two workers, and whoever works there; for the tests of what flies on a cluster (extra `ray`)."""

import os
import signal
import subprocess
import sys
from contextlib import suppress

from common.clock import wall_sleep_s
from tests.documents import ROOT
from tests.system.datasets.killing import processes_with

FLAGS = (
    *("--head", "--block", "--node-ip-address=127.0.0.1", "--num-cpus=2", "--include-dashboard=false"),
    *("--disable-usage-stats", "--object-store-memory=100000000"),
)


class RayHead:
    """A head, and all that it starts, in a session of its own.

    Args:
        port: where it listens.
    """

    def __init__(self, port: int) -> None:
        self.address = f"127.0.0.1:{port}"
        path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
        self._process = subprocess.Popen(
            [sys.executable, "-m", "ray.scripts.scripts", "start", *FLAGS, f"--port={port}"],
            cwd=ROOT, env={**os.environ, "PYTHONPATH": path}, stdout=subprocess.PIPE, text=True, start_new_session=True,
        )  # fmt: skip
        said = []
        for line in self._process.stdout:
            said.append(line)
            if "Ray runtime started" in line:
                return
        self.end()
        raise RuntimeError(f"Ray does not start: {''.join(said)}")

    def kill_worker(self, task: str, whose: subprocess.Popen) -> bool:
        """Kills one of its workers as soon as one is at the task; False: whoever gave it ended before."""
        while whose.poll() is None:
            for pid in processes_with(f"ray::{task}"):
                with suppress(ProcessLookupError):
                    if os.getsid(pid) == self._process.pid:  # those of another head are left alone
                        os.kill(pid, signal.SIGKILL)
                        return True
            wall_sleep_s(0.02)
        return False

    def end(self) -> None:
        """Kills it with all that it has started."""
        os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait(60.0)
        self._process.stdout.close()
