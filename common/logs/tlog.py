"""Telemetry log (.tlog): every MAVLink frame of a link behind its time, as ground stations record and replay them.

Each record is the time as a big-endian uint64 in microseconds since 1970, then the raw frame. The times are the
simulated epoch plus simulated time, so the same flight writes the same bytes.
"""

from pathlib import Path
from struct import Struct
from typing import BinaryIO

from common.clock import SIMULATED_EPOCH_US
from common.logs.log_file import LogFile, OnTrouble

_TIME = Struct(">Q")
_BATCH = 512  # pieces that are written at once: a flight has hundreds of frames per second


class TlogWriter(LogFile):
    """Appends frames as they cross a link."""

    def __init__(self, target: Path | str | BinaryIO, on_trouble: OnTrouble | None = None) -> None:
        super().__init__(target, on_trouble)
        self._waiting: list[bytes] = []
        self._time_us = -1
        self._time = b""  # as it is written: several frames have the same

    def frame(self, time_us: int, frame: bytes) -> None:
        """Records one raw frame, sent or received at simulated `time_us`."""
        if time_us != self._time_us:
            self._time_us, self._time = time_us, _TIME.pack(SIMULATED_EPOCH_US + time_us)
        self._waiting += (self._time, frame)
        if len(self._waiting) >= _BATCH:
            self._write_waiting()

    def flush(self) -> None:
        self._write_waiting()
        super().flush()

    def close(self) -> None:
        self._write_waiting()
        super().close()

    def _write_waiting(self) -> None:
        if self._waiting:
            if self.is_full:
                self.next_part()
            self.write(b"".join(self._waiting))
            self._waiting.clear()
