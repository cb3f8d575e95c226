"""One of our commands as a process with a live page, and a browser that looks at it."""

import re
import socket
import subprocess
from contextlib import contextmanager

from tests.browser import Browser
from tests.system.vehicle import HONEYGUIDE, ROOT, free_ports


class ShownProcess:
    """The process, the browser at its page; `end` waits for it and returns all that it printed."""

    def __init__(self, process, browser):
        self._process = process
        self.browser = browser
        self._said = ""
        while not (address := re.search(r"live page: (\S+)", self._said)):
            line = process.stdout.readline()
            assert line, self._said
            self._said += line
        browser.open(address[1])

    def end(self):
        self._said += self._process.communicate(timeout=60.0)[0]
        assert self._process.returncode == 0, self._said
        return self._said


@contextmanager
def shown(tmp_path, *arguments):
    """Runs a command of Honeyguide with `--view`, logging to the folder `run`."""
    gcs, api = free_ports()
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        page = probe.getsockname()[1]
    command = [HONEYGUIDE, *arguments, "--view", "--view-port", page, "--gcs-port", gcs, "--api-port", api]
    process = subprocess.Popen(
        [*map(str, command), "--run-folder", str(tmp_path / "run")],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=ROOT,
    )
    browser = Browser(tmp_path / "profile", 1000, 700)
    try:
        yield ShownProcess(process, browser)
    finally:
        browser.close()
        process.kill()
