"""Files written whole: the bytes go to `NAME.part` beside the target, which is renamed when they are complete.

A target is either the old file or the new one, never half of it; what a killed process had written stays in the .part.
"""

import os
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

BUFFER_BYTES = 1 << 16


class PartFile:
    """A growing file that takes its name at `close`; an in-memory stream may stand in for the path."""

    def __init__(self, target: Path | str | BinaryIO) -> None:
        """Opens the part file.

        Raises:
            OSError: the folder is missing or may not be written.
        """
        self._target: Path | None = None
        if isinstance(target, str | Path):
            self._target = Path(target)
            self.stream = self._opened(self._target)
        else:
            self.stream = target
        self.write: Callable[[bytes], int] = self.stream.write

    @staticmethod
    def _opened(target: Path) -> BinaryIO:
        return part_path(target).open("wb", buffering=BUFFER_BYTES)

    def close(self) -> None:
        """Completes the file; a stream given by the caller stays open. A second call does nothing."""
        if self._target is None:
            self.stream.flush()
        elif not self.stream.closed:
            self.stream.close()
            part_path(self._target).replace(self._target)

    def leave_part(self) -> None:
        """Gives up: what was written stays in the part file, and the target stays as it was."""
        if self._target is not None:
            self.stream.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        else:
            self.leave_part()


def part_path(target: Path) -> Path:
    """Where the bytes of `target` are collected until it is complete."""
    return target.with_name(target.name + ".part")


def write_whole(target: Path | str, content: bytes) -> None:
    """Writes the file in one go.

    Raises:
        OSError: the folder is missing or may not be written; an existing file is as it was.
    """
    with PartFile(target) as file:
        file.write(content)


def write_durably(target: Path, content: bytes, mode: int = 0o666) -> None:
    """Writes the file in one go, and returns when it would survive a loss of power.

    Args:
        target: the file.
        content: all of it.
        mode: who may read it, from the first byte on; the umask takes from it.

    Raises:
        OSError: the folder is missing or may not be written; an existing file is as it was.
    """
    part = part_path(target)
    part.unlink(missing_ok=True)  # what a killed process left may be open to others
    with os.fdopen(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    part.replace(target)
    folder = os.open(target.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def write_to_nowhere(*descriptors: int) -> None:
    """From now on what is written there is lost, and fails no more: standard output is 1, standard error 2."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for descriptor in descriptors:
        os.dup2(nowhere, descriptor)
    os.close(nowhere)
