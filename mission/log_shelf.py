"""The logs that clients can download: that of this run, or those of every flight since a state folder was begun.

A log in the state folder is begun and ended as SDLOG_MODE says. It takes its name when its definitions are written, and
grows under it: killed at any moment, what is there can be read.
"""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

from autopilot.host import LogFile
from common.files import part_path
from common.params import ParameterTable
from mission.recorder import Recorder

LOGS_KEPT_MAX = 200  # about 1 GB of flights of a minute and a half; the oldest gives way
MODE_PARAMETER = "SDLOG_MODE"
OFF, ARMED_ONLY, FROM_BOOT_TO_DISARM, FROM_BOOT = -1, 0, 1, 2  # its values


class RunLog:
    """The log of this run alone, while it grows."""

    def __init__(self, path: Path, recorder: Recorder) -> None:
        self._path = path
        self._recorder = recorder

    def logs(self) -> Sequence[LogFile]:
        self._recorder.flush_file()
        stat = self._file().stat()
        return [LogFile(self._path.name, stat.st_size, int(stat.st_mtime))]

    def read(self, name: str, offset: int, count: int) -> bytes:
        return _read(self._file(), offset, count) if name == self._path.name else b""

    def erase(self) -> int:
        return 0

    def _file(self) -> Path:
        part = part_path(self._path)
        return part if part.exists() else self._path


class FlightLogs:
    """A folder of logs, one per flight.

    Args:
        folder: made if it is missing; what an earlier run had begun and not got as far as its data is removed.
        recorder: where the data comes from.
        params: has SDLOG_MODE.
    """

    def __init__(self, folder: Path, recorder: Recorder, params: ParameterTable) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        for leftover in folder.glob("*.part"):
            leftover.unlink()
        self._folder = folder
        self._recorder = recorder
        self._params = params
        self._file: BinaryIO | None = None
        self._name = ""
        self._was_armed = False
        if params[MODE_PARAMETER] >= FROM_BOOT_TO_DISARM:
            self._begin()

    def frame(self, *, is_armed: bool) -> None:
        """Begins and ends logs; at the end of each frame."""
        if is_armed != self._was_armed:
            self._was_armed = is_armed
            mode = self._params[MODE_PARAMETER]
            if is_armed and mode != OFF and self._file is None:
                self._begin()
            elif not is_armed and mode != FROM_BOOT:
                self.end()

    def end(self) -> None:
        """Completes the log under way."""
        if self._file is not None:
            self._recorder.stop_listening(self._write)
            self._file.close()
            self._file = None

    def _begin(self) -> None:
        names = self._names()
        for name in names[: max(len(names) + 1 - LOGS_KEPT_MAX, 0)]:
            (self._folder / name).unlink(missing_ok=True)
        self._name = f"log_{_number(names[-1]) + 1 if names else 1:05}.ulg"
        path = self._folder / self._name
        part = part_path(path)
        header = self._recorder.listen(self._write)
        self._file = part.open("wb")
        self._file.write(header)
        self._file.flush()
        part.replace(path)

    def _write(self, records: bytes) -> None:
        if self._file is not None:
            self._file.write(records)

    def _names(self) -> list[str]:
        return sorted(path.name for path in self._folder.glob("log_*.ulg") if _number(path.name))

    # ---- autopilot.host.LogShelf ----

    def logs(self) -> Sequence[LogFile]:
        if self._file is not None:
            self._recorder.flush()
            self._file.flush()
        stats = [(name, os.stat(self._folder / name)) for name in self._names()]  # noqa: PTH116  one call per log
        return [LogFile(name, stat.st_size, int(stat.st_mtime)) for name, stat in stats]

    def read(self, name: str, offset: int, count: int) -> bytes:
        return _read(self._folder / name, offset, count)

    def erase(self) -> int:
        erased = [name for name in self._names() if self._file is None or name != self._name]
        for name in erased:
            (self._folder / name).unlink(missing_ok=True)
        return len(erased)


def _number(name: str) -> int:
    """The number in `log_00012.ulg`; 0 if that is not its form."""
    digits = name.removeprefix("log_").removesuffix(".ulg")
    return int(digits) if digits.isdecimal() else 0


def _read(path: Path, offset: int, count: int) -> bytes:
    try:
        with path.open("rb") as file:
            file.seek(offset)
            return file.read(count)
    except FileNotFoundError:
        return b""
