"""Runs processes side by side, each bound to cores of its own, until all have ended; each writes a log.

In: jobs, of which the first that may begin does. Out: the names of those that failed, or wait for such.
"""

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import wait
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

_QUICKER = {  # memory of images is kept, not given back after each use; threads that wait do not take a core
    "MALLOC_MMAP_THRESHOLD_": str(2**30),
    "MALLOC_TRIM_THRESHOLD_": str(2**32),
    "OMP_WAIT_POLICY": "passive",
}


def _always() -> bool:
    return True


@dataclass(frozen=True, slots=True)
class Job:
    """One process, `python -m WORDS…`."""

    name: str
    words: tuple[str, ...]
    threads: int = 1  # of torch, unless it sets them itself
    takes_all: bool = False  # begins when no other runs, and gets all cores
    is_ready: Callable[[], bool] = _always  # whether what it needs is there


def run_side_by_side(jobs: Sequence[Job], folder: Path, count: int, console: Console) -> list[str]:
    """Runs at most `count` jobs at a time; the names of those that failed or were never ready.

    Args:
        jobs: all of them.
        folder: where JOB.log is written.
        count: at most, one core each.
        console: shows how many are done.
    """
    folder.mkdir(parents=True, exist_ok=True)
    cores = sorted(os.sched_getaffinity(0))[:count]
    waiting = list(jobs)
    running: dict[int, tuple[Job, subprocess.Popen[bytes]]] = {}
    failed: list[str] = []
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as progress:
        bar = progress.add_task("runs", total=len(waiting))
        while waiting or running:
            for core in cores:
                if core not in running and (job := _next(waiting, [job for job, _ in running.values()])):
                    waiting.remove(job)
                    running[core] = job, _start(job, folder, cores if job.takes_all else [core])
            if not running:
                return failed + [job.name for job in waiting]
            progress.update(bar, description=", ".join(job.name for job, _ in running.values()))
            core = _first_ended(running)
            job, process = running.pop(core)
            if process.returncode != 0:
                failed.append(job.name)
            progress.advance(bar)
    return failed


def _next(waiting: Sequence[Job], running: Sequence[Job]) -> Job | None:
    """The job that may begin beside those that run."""
    if any(job.takes_all for job in running):
        return None
    return next((job for job in waiting if not (job.takes_all and running) and job.is_ready()), None)


def _start(job: Job, folder: Path, cores: Sequence[int]) -> "subprocess.Popen[bytes]":
    command = ["taskset", "-c", ",".join(map(str, cores)), sys.executable, "-m", *job.words]
    environment = {**os.environ, **_QUICKER, "OMP_NUM_THREADS": str(job.threads)}
    with (folder / f"{job.name}.log").open("ab") as log:
        return subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT, env=environment)


def _first_ended(running: dict[int, tuple[Job, "subprocess.Popen[bytes]"]]) -> int:
    """The key of a process that has ended."""
    watched = {os.pidfd_open(process.pid): key for key, (_, process) in running.items()}
    key = watched[wait(watched)[0]]  # type: ignore[index]  # descriptors come back as they are given
    for descriptor in watched:
        os.close(descriptor)
    running[key][1].wait()
    return key
