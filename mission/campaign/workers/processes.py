"""Runs flown in processes of this machine. One that ends or hangs takes its run with it, not the campaign.

In: orders. Out: records, in the order in which they are done.
"""

import multiprocessing
import signal
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from common.clock import wall_time_s
from mission.campaign.campaign import Campaign
from mission.campaign.runs import Order, Record, lost

LOOK_S = 1.0  # between looks for those that hang
START_S = 600.0  # a process that compiles kernels on a busy machine is given


def _work(campaign: Campaign, orders: "Connection[Order | None, Record]") -> None:
    """The life of a process: imports what flies, then flies what comes until nothing more does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the campaign ends it
    from mission.campaign.workers.fly_run import fly_run

    try:
        while (order := orders.recv()) is not None:
            orders.send(fly_run(campaign, order))
    except (EOFError, BrokenPipeError):  # the campaign is gone
        return


class _Worker:
    """One process and the run that it has."""

    def __init__(self, campaign: Campaign) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process: BaseProcess = context.Process(target=_work, args=(campaign, theirs), daemon=True)
        self.process.start()
        theirs.close()
        self.order: Order | None = None
        self.due_s = 0.0
        self._has_flown = False

    def give(self, order: Order, run_max_s: float) -> None:
        self.order = order
        self.due_s = wall_time_s() + run_max_s + (0.0 if self._has_flown else START_S)
        self.connection.send(order)

    def take(self) -> Record:
        """The record of its run.

        Raises:
            EOFError: the process has ended.
        """
        record: Record = self.connection.recv()
        self.order, self._has_flown = None, True
        return record

    def end(self) -> str:
        """Ends the process if it has not ended; how it ended, in words."""
        self.process.join(0.0 if self.process.exitcode is None else None)
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
    """

    def __init__(self, campaign: Campaign, jobs: int, run_max_s: float) -> None:
        self._campaign, self._jobs, self._run_max_s = campaign, jobs, run_max_s
        self._workers: list[_Worker] = []

    def fly(self, orders: Sequence[Order]) -> Iterator[Record]:
        """The record of each order, as they come."""
        waiting = list(reversed(orders))
        while waiting or any(worker.order is not None for worker in self._workers):
            while waiting and len(self._workers) < self._jobs:
                self._workers.append(_Worker(self._campaign))
            for worker in self._workers:
                if waiting and worker.order is None:
                    self._give(worker, waiting)
            busy = {worker.connection: worker for worker in self._workers if worker.order is not None}
            for ready in wait(list(busy), LOOK_S):
                yield self._take(busy[ready])  # type: ignore[index]
            for worker in [each for each in self._workers if each.order is not None]:
                if wall_time_s() > worker.due_s:
                    yield self._give_up(worker)

    def _give(self, worker: _Worker, waiting: list[Order]) -> None:
        try:
            worker.give(waiting[-1], self._run_max_s)
        except (BrokenPipeError, ConnectionResetError):  # it ended between two runs: none is lost
            worker.end()
            self._workers.remove(worker)
        else:
            waiting.pop()

    def _take(self, worker: _Worker) -> Record:
        order = worker.order
        assert order is not None
        try:
            return worker.take()
        except (EOFError, ConnectionResetError):
            self._workers.remove(worker)
            return lost(order, worker.end())

    def _give_up(self, worker: _Worker) -> Record:
        order = worker.order
        assert order is not None
        self._workers.remove(worker)
        worker.process.kill()
        worker.end()
        return lost(order, f"hung: its process was ended after {self._run_max_s:g} s")

    def close(self) -> None:
        """Ends all processes, whatever they do."""
        for worker in self._workers:
            worker.process.kill()
            worker.end()
        self._workers = []
