"""A log that may grow for days: it goes on in numbered parts, and a full disk ends it without an exception.

`flight.ulg` is followed by `flight-2.ulg`, `flight-3.ulg`, ...; each part can be read by itself, and the oldest gives
way. While a part grows it is NAME.part, as every file that is not complete.
"""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from common.files import PartFile

OnTrouble = Callable[[str], None]

PART_BYTES_MAX = 256 << 20  # over an hour of flight
PARTS_KEPT_MAX = 8


class LogFile(PartFile):
    """A growing file in parts.

    Args:
        target: path of the first part, or a binary stream, which stays one part.
        on_trouble: is told in a sentence when the log ends because it cannot be written; None: that is an exception.

    Raises:
        OSError: the folder is missing or may not be written.
    """

    def __init__(self, target: Path | str | BinaryIO, on_trouble: OnTrouble | None = None) -> None:
        super().__init__(target)
        self._first = self._target
        self._on_trouble = on_trouble
        self._size = 0
        self._number = 1
        self._complete: list[Path] = []
        self._has_failed = False
        self.write = self._write

    @property
    def is_full(self) -> bool:
        """Whether the log should go on in a new part."""
        return self._target is not None and self._size >= PART_BYTES_MAX

    def next_part(self) -> None:
        """Completes this part and begins the next one."""
        if self._first is None or self._target is None or self._has_failed:
            return
        try:
            super().close()
            self._complete.append(self._target)
            while len(self._complete) >= PARTS_KEPT_MAX:
                self._complete.pop(0).unlink(missing_ok=True)
            self._number += 1
            self._target = self._first.with_name(f"{self._first.stem}-{self._number}{self._first.suffix}")
            self.stream = self._opened(self._target)
            self._size = 0
        except OSError as error:
            self._fail(error)

    def parts(self) -> list[Path]:
        """Every part there is, the last one under the name that it has or will have."""
        return self._complete if self._target is None else [*self._complete, self._target]

    def _write(self, data: bytes) -> int:
        if not self._has_failed:
            try:
                self.stream.write(data)
            except OSError as error:
                self._fail(error)
        self._size += len(data)
        return len(data)

    def flush(self) -> None:
        """Hands what has been written to the file system; not once the log is complete."""
        if self._has_failed or self.stream.closed:
            return
        try:
            self.stream.flush()
        except OSError as error:
            self._fail(error)

    def close(self) -> None:
        """Completes the log; one that could not be written stays NAME.part."""
        if self._has_failed:
            return
        try:
            super().close()
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        """The log ends here, up to where it could be written."""
        if self._on_trouble is None:
            raise error
        self._has_failed = True
        with suppress(OSError):  # it cannot be flushed, which is known
            self.stream.close()
        name = self._target.name if self._target is not None else "log"
        self._on_trouble(f"{name} ended: {error.strerror}")
