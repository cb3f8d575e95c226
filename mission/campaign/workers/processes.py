"""Runs flown in processes of this machine. One that ends or hangs takes its run with it, not the campaign.

In: orders. Out: records, in the order in which they are done. A process has one run at a time, or a batch; of a batch
that is lost, each run is flown again alone, which finds the one that it was.
"""

import multiprocessing
import signal
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from common.clock import wall_time_s
from mission.campaign.campaign import Campaign
from mission.campaign.runs import Order, Record, lost

LOOK_S = 1.0  # between looks for those that hang
START_S = 600.0  # a process that compiles kernels on a busy machine is given


def _work(campaign: Campaign, logs: Path | None, chunks: "Connection[list[Record], list[Order]]") -> None:
    """The life of a process: imports what flies, then flies what comes until nothing more does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the campaign ends it
    from mission.campaign.workers.fly_run import fly_chunk

    try:
        while True:
            chunks.send(fly_chunk(campaign, chunks.recv(), logs))
    except (EOFError, BrokenPipeError, ConnectionResetError):  # the campaign is gone
        return


class _Worker:
    """One process and the runs that it has."""

    def __init__(self, campaign: Campaign, logs: Path | None) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process: BaseProcess = context.Process(target=_work, args=(campaign, logs, theirs), daemon=True)
        self.process.start()
        theirs.close()
        self.orders: list[Order] = []
        self.due_s = 0.0
        self._has_flown = False

    def give(self, orders: list[Order], run_max_s: float) -> None:
        """Raises OSError if the process has ended."""
        self.connection.send(orders)
        self.orders = orders
        self.due_s = wall_time_s() + run_max_s * len(orders) + (0.0 if self._has_flown else START_S)

    def take(self) -> list[Record]:
        """The records of its runs.

        Raises:
            EOFError: the process has ended.
        """
        records: list[Record] = self.connection.recv()
        self.orders, self._has_flown = [], True
        return records

    def end(self) -> str:
        """Ends the process if it has not ended; how it ended, in words."""
        self.process.join(1.0)
        code = self.process.exitcode
        if code is None:
            self.process.kill()
            self.process.join()
        self.connection.close()
        if code is not None and code < 0:
            return f"its process was ended by {signal.Signals(-code).name}"
        return f"its process ended with exit code {code}"


class Processes:
    """Processes that fly runs.

    Args:
        campaign: whose.
        jobs: how many at a time.
        run_max_s: a run that takes longer by the wall clock hangs, and is given up.
        batch: how many runs a process flies in a launch of the kernels; 1: each by itself, over MAVLink.
        logs: where each run has a folder with its logs; None: no run has.
    """

    def __init__(
        self, campaign: Campaign, jobs: int, run_max_s: float, batch: int = 1, logs: Path | None = None
    ) -> None:
        self._campaign, self._jobs, self._run_max_s, self._batch = campaign, jobs, run_max_s, batch
        self._logs = logs
        self._workers: list[_Worker] = []

    def fly(self, orders: Sequence[Order]) -> Iterator[Record]:
        """The record of each order, as they come."""
        waiting = self._chunks(orders)
        while waiting or any(worker.orders for worker in self._workers):
            while len(self._workers) < min(self._jobs, len(waiting) + sum(bool(w.orders) for w in self._workers)):
                self._workers.append(_Worker(self._campaign, self._logs))
            for worker in list(self._workers):
                if waiting and not worker.orders:
                    self._give(worker, waiting)
            busy: dict[Any, _Worker] = {worker.connection: worker for worker in self._workers if worker.orders}
            for ready in wait(list(busy), LOOK_S):
                yield from self._take(busy[ready], waiting)
            for worker in [each for each in self._workers if each.orders]:
                if wall_time_s() > worker.due_s:
                    yield from self._give_up(worker, waiting)

    def _chunks(self, orders: Sequence[Order]) -> list[list[Order]]:
        """What processes are given at a time, the last of the list first; few runs are divided among all."""
        size = max(1, min(self._batch, -(-len(orders) // self._jobs)))
        return [list(orders[k : k + size]) for k in range(0, len(orders), size)][::-1]

    def _give(self, worker: _Worker, waiting: list[list[Order]]) -> None:
        try:
            worker.give(waiting[-1], self._run_max_s)
        except OSError:  # it ended between two runs: none is lost
            worker.end()
            self._workers.remove(worker)
        else:
            waiting.pop()

    def _take(self, worker: _Worker, waiting: list[list[Order]]) -> Iterator[Record]:
        orders = worker.orders
        try:
            yield from worker.take()
        except (EOFError, ConnectionResetError):
            self._workers.remove(worker)
            yield from self._lost(orders, worker.end(), waiting)

    def _give_up(self, worker: _Worker, waiting: list[list[Order]]) -> Iterator[Record]:
        orders = worker.orders
        self._workers.remove(worker)
        worker.process.kill()
        worker.end()
        yield from self._lost(orders, f"hung: its process was ended after {self._run_max_s:g} s", waiting)

    def _lost(self, orders: list[Order], why: str, waiting: list[list[Order]]) -> Iterator[Record]:
        if len(orders) == 1:
            yield lost(orders[0], why)
        else:
            waiting.extend([order] for order in reversed(orders))

    def close(self) -> None:
        """Ends all processes, whatever they do."""
        for worker in self._workers:
            worker.process.kill()
            worker.end()
        self._workers = []
