"""Tasks done by processes of this machine. One that ends or hangs takes its task with it, not the rest.

In: tasks, and who does them; both go to the processes pickled. Out: each task with its outcome, in the order in which
they are done. Of several tasks that were lost together each is done again alone, which finds the one that it was.
"""

import multiprocessing
import signal
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, Generic, Protocol, TypeVar

from common.clock import wall_time_s
from common.pool_worker import end_with_parent

LOOK_S = 1.0  # between looks for those that hang
START_S = 600.0  # a process that compiles kernels on a busy machine is given
_READY = "ready"

Task = TypeVar("Task")
Given_contra = TypeVar("Given_contra", contravariant=True)
Outcome = TypeVar("Outcome")


class Work(Protocol[Given_contra, Outcome]):
    """Who does tasks."""

    def prepare(self, tasks: Sequence[Given_contra]) -> None:
        """What comes before the tasks; its time is not counted as theirs."""

    def outcomes(self, tasks: Sequence[Given_contra]) -> list[Outcome]:
        """Does them, in a process; the outcome of each."""

    def lost(self, task: Given_contra, reason: str) -> Outcome:
        """The outcome of a task whose process ended or hung; not asked in that process."""


def _live(work: Work[Task, Outcome], connection: "Connection[Any, list[Task]]") -> None:
    """The life of a process: does what comes until nothing more does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who began it ends it
    end_with_parent()
    try:
        while True:
            tasks = connection.recv()
            work.prepare(tasks)
            connection.send(_READY)
            connection.send(work.outcomes(tasks))
    except (EOFError, BrokenPipeError, ConnectionResetError):  # who began it is gone
        return


class _Worker(Generic[Task, Outcome]):
    """One process and the tasks that it has."""

    def __init__(self, work: Work[Task, Outcome]) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process: BaseProcess = context.Process(target=_live, args=(work, theirs))
        self.process.start()
        theirs.close()
        self.tasks: list[Task] = []
        self.max_s = self.due_s = 0.0

    def give(self, tasks: list[Task]) -> None:
        """Raises OSError if the process has ended."""
        self.connection.send(tasks)
        self.tasks = tasks
        self._allow(START_S)

    def take(self, task_max_s: float) -> list[Outcome]:
        """The outcomes of its tasks; none yet: it begins with them.

        Raises:
            EOFError: the process has ended.
        """
        if not self.connection.poll():
            raise EOFError  # a child of it holds the connection open
        received = self.connection.recv()
        if received == _READY:
            self._allow(task_max_s * len(self.tasks))
            return []
        self.tasks = []
        outcomes: list[Outcome] = received
        return outcomes

    def _allow(self, max_s: float) -> None:
        """From now on it may take so long."""
        self.max_s, self.due_s = max_s, wall_time_s() + max_s

    def end(self) -> str:
        """Ends the process if it has not ended; how it ended, in words."""
        self.process.join(1.0)
        self.process.kill()
        self.process.join()
        self.connection.close()
        code = self.process.exitcode or 0
        if code < 0:
            return f"its process died (signal {-code}, {signal.strsignal(-code)})"
        return f"its process ended with exit code {code}"


class WorkerProcesses(Generic[Task, Outcome]):
    """Processes that do tasks.

    Args:
        work: who does them.
        jobs: how many processes at a time.
        task_max_s: a task that takes longer by the wall clock hangs, and is given up.
        chunk: how many tasks a process is given at a time.
    """

    def __init__(self, work: Work[Task, Outcome], jobs: int, task_max_s: float, chunk: int = 1) -> None:
        self._work, self._jobs, self._task_max_s, self._chunk = work, jobs, task_max_s, chunk
        self._workers: list[_Worker[Task, Outcome]] = []

    def done(self, tasks: Sequence[Task]) -> Iterator[tuple[Task, Outcome]]:
        """Each task with its outcome, as they come."""
        waiting = self._chunks(tasks)
        while waiting or any(worker.tasks for worker in self._workers):
            while len(self._workers) < min(self._jobs, len(waiting) + sum(bool(w.tasks) for w in self._workers)):
                self._workers.append(_Worker(self._work))
            for worker in list(self._workers):
                if waiting and not worker.tasks:
                    self._give(worker, waiting)
            busy = [worker for worker in self._workers if worker.tasks]
            ready = wait([worker.connection for worker in busy], LOOK_S)
            for worker in busy:
                if worker.connection in ready or not worker.process.is_alive():
                    yield from self._take(worker, waiting)
                elif wall_time_s() > worker.due_s:
                    yield from self._give_up(worker, waiting)

    def _chunks(self, tasks: Sequence[Task]) -> list[list[Task]]:
        """What processes are given at a time, the last of the list first; few tasks are divided among all."""
        size = max(1, min(self._chunk, -(-len(tasks) // self._jobs)))
        return [list(tasks[k : k + size]) for k in range(0, len(tasks), size)][::-1]

    def _give(self, worker: _Worker[Task, Outcome], waiting: list[list[Task]]) -> None:
        try:
            worker.give(waiting[-1])
        except OSError:  # it ended between two tasks: none is lost
            worker.end()
            self._workers.remove(worker)
        else:
            waiting.pop()

    def _take(self, worker: _Worker[Task, Outcome], waiting: list[list[Task]]) -> Iterator[tuple[Task, Outcome]]:
        tasks = worker.tasks
        try:
            outcomes = worker.take(self._task_max_s)
        except (EOFError, ConnectionResetError):
            self._workers.remove(worker)
            yield from self._lost(tasks, worker.end(), waiting)
        else:
            yield from zip(tasks if outcomes else (), outcomes, strict=True)

    def _give_up(self, worker: _Worker[Task, Outcome], waiting: list[list[Task]]) -> Iterator[tuple[Task, Outcome]]:
        tasks = worker.tasks
        self._workers.remove(worker)
        worker.process.kill()
        worker.end()
        yield from self._lost(tasks, f"hung: its process was ended after {worker.max_s:g} s", waiting)

    def _lost(self, tasks: list[Task], reason: str, waiting: list[list[Task]]) -> Iterator[tuple[Task, Outcome]]:
        if len(tasks) == 1:
            yield tasks[0], self._work.lost(tasks[0], reason)
        else:
            waiting.extend([task] for task in reversed(tasks))

    def close(self) -> None:
        """Ends all processes, whatever they do."""
        for worker in self._workers:
            worker.process.kill()
            worker.end()
        self._workers = []
