"""`python -m bench.follow [STAGE…]`: trains the stages of docs/results/follow.md from scratch and writes the page.

Stages that are done (results/follow/STAGE-SEED.json) are kept and stopped ones go on; `--again` trains them anew,
`--page` only writes the page, `--shipped` takes what the shipped page was made of (docs/results/follow.jsonl) as done.
Two processes go side by side, each on a core of its own; a stage waits for those it needs, and one that takes several
cores for all others to end.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from bench.cars.page import DOCS
from bench.follow.page import write_page
from bench.follow.result import Result, read, read_all, write, write_all
from bench.follow.run import policy_path, result_path
from bench.follow.stages import STAGES, Stage, in_order
from common.files import write_whole

RESULTS = Path("results/follow")
RUNS = DOCS / "follow.jsonl"
PRETRAINED = Path(__file__).parents[2] / "policies" / "pretrained"
QUICKER = {  # memory of images is kept, not given back after each use; threads that wait do not take a core
    "MALLOC_MMAP_THRESHOLD_": str(2**30),
    "MALLOC_TRIM_THRESHOLD_": str(2**32),
    "OMP_WAIT_POLICY": "passive",
}
console = Console(highlight=False)


@dataclass(frozen=True, slots=True)
class Job:
    """One process: a stage's training and judgement, or its flights."""

    stage: Stage
    seed: int
    is_flight: bool

    @property
    def name(self) -> str:
        return f"{self.stage.name}-{self.seed}{'-flown' if self.is_flight else ''}"

    @property
    def takes_all(self) -> bool:
        """Whether it is alone on the machine."""
        return self.stage.cores > 1 and not self.is_flight

    @property
    def is_done(self) -> bool:
        path = result_path(RESULTS, self.stage.name, self.seed)
        return path.exists() and (not self.is_flight or bool(read(path).cards(is_flown=True)))

    @property
    def is_ready(self) -> bool:
        before = (self.stage.name,) if self.is_flight else self.stage.before
        return all(result_path(RESULTS, name, self.seed).exists() for name in before)


def main(
    names: Annotated[list[str] | None, typer.Argument(help="Stages, with those they need; default: all.")] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Seeds of each.")] = 1,
    jobs: Annotated[int, typer.Option(min=1, help="Processes side by side, one core each.")] = 2,
    again: Annotated[bool, typer.Option("--again", help="Train the named stages anew.")] = False,
    page: Annotated[bool, typer.Option("--page", help="Train nothing, only write the page.")] = False,
    shipped: Annotated[bool, typer.Option("--shipped", help="Take the shipped page's results as done.")] = False,
) -> None:
    unknown = [name for name in names or () if name not in STAGES]
    if unknown:
        console.print(f"follow: no stage {unknown[0]}; there are {', '.join(STAGES)}", markup=False)
        raise typer.Exit(2)
    if shipped:
        for result in read_all(RUNS):
            path = result_path(RESULTS, result.stage, result.seed)
            if not path.exists():
                write(path, result)
    failed: list[str] = []
    if not page:
        if again:
            _forget(names or list(STAGES), seeds)
        failed = _run(_jobs(names or list(STAGES), seeds), jobs)
    there = results()
    path = write_page(there)
    write_all(RUNS, [result for runs in there.values() for result in runs])
    console.print(f"wrote {path}")
    _publish()
    for name in failed:
        console.print(f"[red]failed[/red] {name}: see {RESULTS / name}.log")
    raise typer.Exit(1 if failed else 0)


def results() -> dict[str, list[Result]]:
    """Every result there is, by stage and in order of seed."""
    found: dict[str, list[Result]] = {}
    for name in STAGES:
        paths = [path for path in RESULTS.glob(f"{name}-*.json") if path.stem.rsplit("-", 1)[0] == name]
        found[name] = sorted((read(path) for path in paths), key=lambda result: result.seed)
    return found


def _publish() -> None:
    """Puts the first seed's policies into policies/pretrained/, under the names of their recipes."""
    for stage in STAGES.values():
        trained = policy_path(RESULTS, stage.name, 1)
        if stage.ships and trained.exists():
            write_whole(PRETRAINED / f"{stage.recipe}.pt", trained.read_bytes())


def _jobs(names: Sequence[str], seeds: int) -> list[Job]:
    """What is left to do, in order."""
    whole = [
        Job(stage, seed, is_flight)
        for seed in range(1, seeds + 1)
        for stage in in_order(list(names))
        for is_flight in (False, True)
        if stage.flies or not is_flight
    ]
    return [job for job in whole if not job.is_done]


def _forget(names: Sequence[str], seeds: int) -> None:
    for name in names:
        for seed in range(1, seeds + 1):
            result_path(RESULTS, name, seed).unlink(missing_ok=True)
            shutil.rmtree(RESULTS / "runs" / f"{name}-{seed}", ignore_errors=True)


def _run(waiting: list[Job], count: int) -> list[str]:
    """Runs them, each in a process bound to a core; the names of those that failed or wait for such."""
    RESULTS.mkdir(parents=True, exist_ok=True)
    cores = sorted(os.sched_getaffinity(0))[:count]
    running: dict[int, tuple[Job, subprocess.Popen[bytes]]] = {}
    failed: list[str] = []
    while waiting or running:
        for core in cores:
            if core in running or any(job.takes_all for job, _ in running.values()):
                continue
            job = next((job for job in waiting if job.is_ready and not (job.takes_all and running)), None)
            if job is not None:
                waiting.remove(job)
                running[core] = job, _start(job, cores if job.takes_all else [core])
                console.print(f"{job.name}: begun")
        if not running:
            return failed + [job.name for job in waiting]
        core = _first_ended(running)
        job, process = running.pop(core)
        console.print(f"{job.name}: {'done' if process.returncode == 0 else 'failed'}")
        if process.returncode != 0:
            failed.append(job.name)
    return failed


def _start(job: Job, cores: Sequence[int]) -> subprocess.Popen[bytes]:
    module = "bench.follow.flights" if job.is_flight else "bench.follow.run"
    words = [job.stage.name, str(job.seed), str(RESULTS)]
    command = ["taskset", "-c", ",".join(map(str, cores)), sys.executable, "-m", module, *words]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", **QUICKER}
    with (RESULTS / f"{job.name}.log").open("ab") as log:
        return subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT, env=environment)


def _first_ended(running: dict[int, tuple[Job, "subprocess.Popen[bytes]"]]) -> int:
    """The core whose process ended."""
    cores = {process.pid: core for core, (_, process) in running.items()}
    pid, status = os.waitpid(-1, 0)
    running[cores[pid]][1].returncode = os.waitstatus_to_exitcode(status)
    return cores[pid]


if __name__ == "__main__":
    typer.run(main)
