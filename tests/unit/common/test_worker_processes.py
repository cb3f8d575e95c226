"""Tasks done by processes: one that dies or hangs is lost alone, and nothing else is."""

import os
import signal
from collections import Counter

import pytest

from common import worker_processes
from common.clock import wall_sleep_s, wall_time_s
from common.worker_processes import WorkerProcesses


class Deeds:
    """Does what the tasks say."""

    def prepare(self, tasks):
        if "slow to start" in tasks:
            wall_sleep_s(2.0)

    def outcomes(self, tasks):
        return [self._outcome(task) for task in tasks]

    def _outcome(self, task):
        if task == "die":
            os.kill(os.getpid(), signal.SIGSEGV)
        if task == "exit":
            os._exit(3)
        if task == "leave a child":
            if os.fork() == 0:
                wall_sleep_s(30.0)
            os._exit(4)
        while task == "hang":
            pass
        return f"{task}: done"

    def lost(self, task, reason):
        return f"{task}: {reason}"


def outcomes(*tasks, jobs=2, task_max_s=30.0, chunk=1):
    processes = WorkerProcesses(Deeds(), jobs, task_max_s, chunk)
    try:
        return Counter(processes.done(tasks))
    finally:
        processes.close()


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        ("die", "its process died (signal 11, Segmentation fault)"),
        ("exit", "its process ended with exit code 3"),
        ("leave a child", "its process ended with exit code 4"),
    ],
)
@pytest.mark.parametrize("chunk", [1, 3])
def test_who_dies_is_lost_alone_and_the_others_are_done(bad, reason, chunk):
    found = outcomes("a", bad, "b", chunk=chunk)
    assert found == Counter([("a", "a: done"), (bad, f"{bad}: {reason}"), ("b", "b: done")])


def test_who_hangs_is_given_up_and_what_prepares_is_not():
    begun_s = wall_time_s()
    found = outcomes("hang", "slow to start", task_max_s=1.0)
    assert found == Counter(
        [("hang", "hang: hung: its process was ended after 1 s"), ("slow to start", "slow to start: done")]
    )
    assert wall_time_s() - begun_s < 20.0


def test_who_hangs_as_it_starts_is_given_up_after_the_time_for_that(monkeypatch):
    monkeypatch.setattr(worker_processes, "START_S", 0.5)
    (found,) = outcomes("slow to start")
    assert found == ("slow to start", "slow to start: hung: its process was ended after 0.5 s")


def test_no_process_outlives_its_close():
    processes = WorkerProcesses(Deeds(), 1, 60.0)
    found = processes.done(["a", "hang"])
    assert next(found) == ("a", "a: done")
    (worker,) = processes._workers
    processes.close()
    assert worker.process.exitcode == -signal.SIGKILL
