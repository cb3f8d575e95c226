"""Rows of a batch split into chunks of nearly equal size, each gone through by a thread of its own.

Warp runs a kernel on one core of a CPU; launches of separate rows from separate threads use the others.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise


class Workers:
    """Threads for the rows of a batch; one chunk needs none.

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
