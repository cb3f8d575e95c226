"""The folder of one run: chosen or made, kept from other processes, and what is written there besides the logs."""

import errno
import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from common.clock import wall_date_text
from common.files import write_whole
from mission.console.option_checks import UserError
from mission.console.terminal import print_line

_OF_A_FLIGHT = ("flight*.ulg", "flight*.tlog", "flight.mcap", "summary.json", "images.zip", "vehicle-*")


@contextmanager
def run_folder(folder: Path | None) -> Iterator[Path]:
    """The folder, which is this process's alone inside; one that already holds a flight is left alone.

    Args:
        folder: as asked for; None: a new one, named by the date.

    Raises:
        UserError: it cannot be used.
    """
    try:
        if folder is None:
            folder = _new(Path("runs") / wall_date_text())
        folder.mkdir(parents=True, exist_ok=True)
        lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise UserError(f"{folder}: cannot write there: {error.strerror}") from error
    try:
        _claim(folder, lock)
        yield folder
    finally:
        os.close(lock)


def _claim(folder: Path, lock: int) -> None:
    try:
        _lock(lock)
        if any(path for pattern in _OF_A_FLIGHT for path in folder.glob(pattern)):
            raise UserError(f"{folder}: already holds a flight; name another --run-folder")
        write_whole(folder / "flight.tlog", b"")
        (folder / "flight.tlog").unlink()
    except BlockingIOError as error:
        raise UserError(f"{folder}: another flight is writing there; name another --run-folder") from error
    except OSError as error:
        raise UserError(f"{folder}: cannot write there: {error.strerror}") from error


def _lock(folder: int) -> None:
    """Ends with the process, however it ends. Some network file systems lock no folders: one does without there.

    Raises:
        BlockingIOError: another process has it.
    """
    try:
        fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno not in (errno.EBADF, errno.EINVAL, errno.ENOLCK, errno.EOPNOTSUPP):
            raise


class OwnFiles:
    """What is written there besides the logs: a file that cannot be written is told, and ends nothing.

    Args:
        folder: of the run.
        console: where it is told.
    """

    def __init__(self, folder: Path, console: Console) -> None:
        self._folder = folder
        self._console = console
        self.missing: list[str] = []

    @contextmanager
    def writing(self, name: str) -> Iterator[Path]:
        """Inside, the file is written."""
        try:
            yield self._folder / name
        except OSError as error:
            self.missing.append(name)
            print_line(self._console, f"{self._folder / name}: not written: {error.strerror}")


def _new(stem: Path) -> Path:
    """A folder that did not exist."""
    stem.parent.mkdir(parents=True, exist_ok=True)
    folder, number = stem, 1
    while True:
        try:
            folder.mkdir()
        except FileExistsError:
            number += 1
            folder = stem.with_name(f"{stem.name}-{number}")
        else:
            return folder
