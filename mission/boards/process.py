"""The program of an outside autopilot: started, listened to, and ended with the flight."""

import ctypes
import os
import shlex
import signal
import subprocess
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import IO, cast

from sim.boards.outside import PeerError

END_S = 1.0  # of wall clock time, that it is given to end by itself; SITL does not while it waits for physics
LINE_MAX = 400  # characters of a line that are shown
READ_MAX = 65_536
_PR_SET_PDEATHSIG = 1


def _end_with_us() -> None:
    """In the child: it is killed when we are."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


class PeerProcess:
    """One program, in a process group of its own.

    Args:
        command: as on a command line; it is not given to a shell.
        folder: where it runs.
        environment: what is added to ours.
        log: its console, as a file.

    Raises:
        PeerError: it cannot be started.
    """

    def __init__(self, command: str, folder: Path, environment: Mapping[str, str], log: Path) -> None:
        self._log = log.open("wb")
        try:
            words = shlex.split(command)
            self._process = subprocess.Popen(  # noqa: S603  (what the user has asked for)
                words,
                cwd=folder,
                env={**os.environ, **environment},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                preexec_fn=_end_with_us,  # noqa: PLW1509  (no thread of ours holds a lock that the child needs)
            )
        except (OSError, ValueError, IndexError) as error:
            reason = error.strerror if isinstance(error, OSError) else str(error)
            self._log.close()
            raise PeerError(f"--command {command}: {reason or 'cannot be started'}") from error
        self._name = words[0]
        self._rest = b""
        self._stream = cast(IO[bytes], self._process.stdout)
        os.set_blocking(self._stream.fileno(), False)

    def lines(self) -> list[str]:
        """What it has said since the last call."""
        try:
            data = os.read(self._stream.fileno(), READ_MAX)
        except BlockingIOError:
            return []
        with suppress(OSError):  # a full disk
            self._log.write(data)
            self._log.flush()
        *whole, self._rest = (self._rest + data).split(b"\n")
        return [line.decode(errors="replace").rstrip()[:LINE_MAX] for line in whole if line.strip()]

    @property
    def has_ended(self) -> bool:
        return self._process.poll() is not None

    def check(self) -> None:
        """Raises PeerError if it has ended."""
        if self.has_ended:
            code = self._process.returncode
            raise PeerError(f"{self._name} has ended with exit code {code}; its console is in {self._log.name}")

    def close(self) -> None:
        """Ends it, and what it has started; once is enough."""
        if self._stream.closed:
            return
        if not self.has_ended:
            self._signal(15)
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(END_S)
        self._signal(9)
        self._process.wait()
        self._stream.close()
        self._log.close()

    def _signal(self, number: int) -> None:
        try:
            os.killpg(self._process.pid, number)
        except ProcessLookupError:
            return
