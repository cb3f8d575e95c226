"""Which frames of a flight are kept in memory and in its log, and the rows that are: bounded for a vehicle left idle.

Every frame is kept while armed, and until it has been disarmed for two minutes; from then on one each second.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

QUIET_AFTER_US = 120_000_000  # since power-on or disarming
QUIET_PERIOD_US = 1_000_000
_CHUNK_ROWS = 4096

Rows = NDArray[Any]


class FrameChoice:
    """Chooses the frames that are kept."""

    def __init__(self) -> None:
        self._busy_us = 0

    def keeps(self, time_us: int, *, is_armed: bool) -> bool:
        """Asked once for each frame, in their order."""
        if is_armed:
            self._busy_us = time_us
        return time_us - self._busy_us <= QUIET_AFTER_US or time_us % QUIET_PERIOD_US == 0


class KeptRows:
    """Rows of a growing table, copied: what they were taken from is not held."""

    def __init__(self, dtype: Any) -> None:
        self._chunks: list[Rows] = []
        self._free = 0  # rows of the last chunk
        self._newest = np.empty(0, dtype)  # the last row, if it was not kept: how a flight ended is always known

    def add(self, rows: Rows, is_kept: NDArray[np.bool_]) -> None:
        """Adds those that are kept, shape (rows,)."""
        if not len(rows):
            return
        self._newest = rows[-1:].copy() if not is_kept[-1] else self._newest[:0]
        rows = rows[is_kept]
        while len(rows):
            if self._free == 0:
                self._chunks.append(np.empty(_CHUNK_ROWS, self._newest.dtype))
                self._free = _CHUNK_ROWS
            count = min(len(rows), self._free)
            start = _CHUNK_ROWS - self._free
            self._chunks[-1][start : start + count] = rows[:count]
            self._free -= count
            rows = rows[count:]

    def all(self) -> Rows:
        """One table; its last row is the last that was added."""
        *full, last = self._chunks or [self._newest[:0]]
        table = np.concatenate([*full, last[: len(last) - self._free], self._newest])
        self._chunks, self._free = [table[: len(table) - len(self._newest)]], 0  # not held twice
        return table
