"""How kernels are launched: recorded once and made again, or by several threads for the rows of a batch.

Warp runs a kernel on one core of a CPU; launches of separate rows from separate threads use the others.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any


class RecordedLaunches:
    """Launches of one maker, made again while they are given the same arrays.

    To pack the arguments of a launch takes as long as a small launch itself.

    Args:
        record: makes the launches for some arrays.
    """

    def __init__(self, record: Callable[..., list[Any]]) -> None:
        self._record = record
        self._given: tuple[Any, ...] | None = None
        self._launches: list[Any] = []

    def of(self, *arrays: Any) -> list[Any]:
        """The launches for these arrays, made anew only if they are others than the last."""
        if self._given != arrays:
            self._given, self._launches = arrays, self._record(*arrays)
        return self._launches


class Workers:
    """Threads for the rows of a batch, split into chunks of nearly equal size; one chunk needs none.

    Args:
        row_count: rows of the batch.
        threads: at most so many chunks.

    Attributes:
        chunks: (first row, number of rows) of each.
    """

    def __init__(self, row_count: int, threads: int) -> None:
        bounds = [row_count * k // threads for k in range(threads + 1)]
        self.chunks = [(low, high - low) for low, high in pairwise(bounds) if high > low]
        self._pool = ThreadPoolExecutor(len(self.chunks)) if len(self.chunks) > 1 else None

    def run(self, job: Callable[[int], None]) -> None:
        """Does the job of every chunk, which is given the chunk's index, and returns when all are done."""
        if self._pool is None:
            for k in range(len(self.chunks)):
                job(k)
        else:
            list(self._pool.map(job, range(len(self.chunks))))
