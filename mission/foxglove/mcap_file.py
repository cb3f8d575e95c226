"""The MCAP file of a flight: `flight.mcap`, which Foxglove opens.

Chunks have a fixed size, times are simulated, and one thread compresses: the same messages make the same bytes. While
it grows it is NAME.part, and a full disk ends it without ending the flight, as with every log.
"""

from collections.abc import Callable
from pathlib import Path

from foxglove import Context, open_mcap
from foxglove.mcap import MCAPWriteOptions

from common.logs.log_file import LogFile

FILE = "flight.mcap"
CHUNK_BYTES = 1 << 20


class _Growing:
    """A log's file as the writer wants it: it asks where it is, and goes nowhere else."""

    def __init__(self, file: LogFile) -> None:
        self._file, self._position = file, 0

    def write(self, data: bytes | bytearray) -> int:
        self._file.write(bytes(data))
        self._position += len(data)
        return len(data)

    def seek(self, offset: int, whence: int = 0) -> int:
        del offset, whence  # to where it is
        return self._position

    def flush(self) -> None:
        self._file.flush()


class McapFile:
    """One file, under way.

    Args:
        path: where it will be.
        on_trouble: is told in a sentence if it cannot be written; None: that is an exception.

    Raises:
        OSError: the folder is missing or may not be written.
    """

    def __init__(self, path: Path, on_trouble: Callable[[str], None] | None = None) -> None:
        self.context = Context()
        self._file = LogFile(path, on_trouble)
        options = MCAPWriteOptions(disable_seeking=True, chunk_size=CHUNK_BYTES, compression_threads=0)
        self._writer = open_mcap(_Growing(self._file), context=self.context, writer_options=options)

    def close(self) -> None:
        """Completes the file."""
        self._writer.close()
        self._file.close()
