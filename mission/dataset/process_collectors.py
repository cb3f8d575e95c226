"""Shards collected by processes of this machine. Where one is killed, what it and its neighbours had is begun anew."""

import multiprocessing
import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

from common.pool_worker import end_with_parent
from mission.dataset.collect_shard import collect_into
from mission.dataset.shards import ShardOrder
from policies.datasets.episodes import DatasetError

TRIES = 3  # in which no shard is finished, before it is the shard


class ProcessCollectors:
    """Processes that collect.

    Args:
        jobs: how many at a time.
    """

    def __init__(self, jobs: int) -> None:
        self._jobs = jobs

    def collect(self, orders: Sequence[ShardOrder], folder: Path) -> Iterator[ShardOrder]:
        """See `mission.dataset.shards.Collectors`."""
        left, tries = list(orders), 0
        while left:
            tries += 1
            try:
                for order in self._pooled(left, folder):
                    tries = 0
                    yield order
            except BrokenProcessPool:
                if tries >= TRIES:
                    raise DatasetError(f"{folder}: the processes that collect ended {TRIES} times in a row") from None
            left = [order for order in left if not (folder / order.name).is_dir()]

    def _pooled(self, orders: Sequence[ShardOrder], folder: Path) -> Iterator[ShardOrder]:
        """Raises BrokenProcessPool if a process is killed."""
        context = multiprocessing.get_context("spawn")
        jobs = min(self._jobs, len(orders))
        with ProcessPoolExecutor(jobs, mp_context=context, initializer=_begin) as pool:
            futures = {pool.submit(collect_into, order, folder): order for order in orders}
            try:
                for future in as_completed(futures):
                    future.result()
                    yield futures[future]
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise


def _begin() -> None:
    """The process ends with the one that began it, however that ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
