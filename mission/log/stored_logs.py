"""The logs that clients can download: that of this run, or those of every flight since a state folder was begun.

A log in the state folder is begun and ended as SDLOG_MODE says. It takes its name when its definitions are written, and
grows under it: killed at any moment, what is there can be read.
"""

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import BinaryIO

from autopilot.interface.platform import LogFile
from common.files import part_path
from common.logs.log_file import PART_BYTES_MAX
from common.params import ParameterTable
from mission.log.flight_recorder import Recorder

LOGS_KEPT_MAX = 200  # about 1 GB of flights of a minute and a half; the oldest gives way
MODE_PARAMETER = "SDLOG_MODE"
OFF, ARMED_ONLY, FROM_BOOT_TO_DISARM, FROM_BOOT = -1, 0, 1, 2  # its values


class RunLog:
    """The log of this run alone, while it grows, in all its parts."""

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder

    def logs(self) -> Sequence[LogFile]:
        self._recorder.flush_file()
        stats = [(path.name, _file(path).stat()) for path in self._recorder.log_parts() if _file(path).exists()]
        return [LogFile(name, stat.st_size, int(stat.st_mtime)) for name, stat in stats]

    def read(self, name: str, offset: int, count: int) -> bytes:
        paths = [path for path in self._recorder.log_parts() if path.name == name]
        return _read(_file(paths[0]), offset, count) if paths else b""

    def erase(self) -> int:
        return 0


def _file(path: Path) -> Path:
    """The log, or what there is of it."""
    part = part_path(path)
    return part if part.exists() else path


class FlightLogs:
    """A folder of logs, one per flight.

    Args:
        folder: made if it is missing; what an earlier run had begun and not got as far as its data is removed.
        recorder: where the data comes from.
        params: has SDLOG_MODE.
        on_trouble: is told when a log cannot be written, which then ends; the next one is tried again.
    """

    def __init__(
        self, folder: Path, recorder: Recorder, params: ParameterTable, on_trouble: Callable[[str], None]
    ) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        for leftover in folder.glob("*.part"):
            leftover.unlink()
        self._folder = folder
        self._recorder = recorder
        self._params = params
        self._on_trouble = on_trouble
        self._file: BinaryIO | None = None
        self._size = 0
        self._has_failed = False
        self._name = ""
        self._ended: Sequence[LogFile] | None = None  # the others; None: to be looked for. Clients ask often
        self._was_armed = False
        if params[MODE_PARAMETER] >= FROM_BOOT_TO_DISARM:
            self._begin()

    def frame(self, *, is_armed: bool) -> None:
        """Begins and ends logs; at the end of each frame."""
        if self._has_failed:
            self.end()
        elif self._size >= PART_BYTES_MAX:
            self.end()
            self._begin()
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
            try:
                self._file.close()
            except OSError as error:
                self._fail(error)
            if self._has_failed:
                _remove(part_path(self._folder / self._name))  # not got as far as its data
        self._file, self._size, self._has_failed, self._ended = None, 0, False, None

    def _begin(self) -> None:
        names = self._names()
        self._ended = None
        for name in names[: max(len(names) + 1 - LOGS_KEPT_MAX, 0)]:
            _remove(self._folder / name)
        self._name = f"log_{_number(names[-1]) + 1 if names else 1:05}.ulg"
        path = self._folder / self._name
        part = part_path(path)
        try:
            self._file = part.open("wb")
            self._write(self._recorder.listen(self._write))
            self._file.flush()
            part.replace(path)
        except OSError as error:
            self._fail(error)

    def _write(self, records: bytes) -> None:
        if self._file is None or self._has_failed:
            return
        try:
            self._size += self._file.write(records)
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        """The log ends with this frame: whoever writes to it is in the middle of that."""
        if not self._has_failed:
            self._on_trouble(f"{self._name} ended: {error.strerror}")
        self._has_failed = True

    def _names(self) -> list[str]:
        return sorted(path.name for path in self._folder.glob("log_*.ulg") if _number(path.name))

    # ---- autopilot.interface.platform.StoredLogs ----

    def logs(self) -> Sequence[LogFile]:
        if self._file is not None:
            self._recorder.flush()
            try:
                self._file.flush()
            except OSError as error:
                self._fail(error)
        if self._ended is None:
            others = [name for name in self._names() if self._file is None or name != self._name]
            self._ended = [log for name in others if (log := self._log(name)) is not None]
        growing = None if self._file is None else self._log(self._name)
        return self._ended if growing is None else [*self._ended, growing]

    def _log(self, name: str) -> LogFile | None:
        try:
            stat = os.stat(self._folder / name)  # noqa: PTH116  one call per log
        except OSError:
            return None
        return LogFile(name, stat.st_size, int(stat.st_mtime))

    def read(self, name: str, offset: int, count: int) -> bytes:
        return _read(self._folder / name, offset, count)

    def erase(self) -> int:
        others = [name for name in self._names() if self._file is None or name != self._name]
        self._ended = None
        return sum(_remove(self._folder / name) for name in others)


def _remove(path: Path) -> bool:
    """Whether it is gone: a disk that has become read-only keeps what it has."""
    try:
        path.unlink(missing_ok=True)
    except OSError:
        return False
    return True


def _number(name: str) -> int:
    """The number in `log_00012.ulg`; 0 if that is not its form."""
    digits = name.removeprefix("log_").removesuffix(".ulg")
    return int(digits) if digits.isdecimal() else 0


def _read(path: Path, offset: int, count: int) -> bytes:
    try:
        with path.open("rb") as file:
            file.seek(offset)
            return file.read(count)
    except OSError:
        return b""
