"""`python -m bench.cars [NAME…]`: trains every row of docs/results/cars.md from scratch and writes the page.

Runs that are done (results/cars/NAME-SEED.json) are kept; `--again` trains them anew, `--page` only writes the page,
`--shipped` takes the runs that the shipped page was made of (docs/results/cars.jsonl) as done. Two runs go side by
side, each on a core of its own.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from bench.cars.experiment import Experiment
from bench.cars.experiments import EXPERIMENTS, SECTIONS
from bench.cars.page import DOCS, write_page
from bench.cars.result import Result, read, read_all, write, write_all
from common.files import write_whole

RESULTS = Path("results/cars")
RUNS = DOCS / "cars.jsonl"
PRETRAINED = Path(__file__).parents[2] / "policies" / "pretrained"
console = Console(highlight=False)


def main(
    names: Annotated[list[str] | None, typer.Argument(help="Experiments; default: all.")] = None,
    seeds: Annotated[int | None, typer.Option(min=1, help="Seeds of each, instead of the page's.")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Runs side by side, one core each.")] = 2,
    again: Annotated[bool, typer.Option("--again", help="Train anew what is there.")] = False,
    page: Annotated[bool, typer.Option("--page", help="Train nothing, only write the page.")] = False,
    shipped: Annotated[bool, typer.Option("--shipped", help="Take the shipped page's runs as done.")] = False,
) -> None:
    unknown = [name for name in names or () if name not in EXPERIMENTS]
    if unknown:
        console.print(f"cars: no experiment {unknown[0]}; there are {', '.join(EXPERIMENTS)}", markup=False)
        raise typer.Exit(2)
    if shipped:
        for result in read_all(RUNS):
            path = RESULTS / f"{result.experiment}-{result.seed}.json"
            if not path.exists():
                write(path, result)
    chosen = [EXPERIMENTS[name] for name in names or EXPERIMENTS]
    failed = [] if page else _run([*_todo(chosen, seeds, again=again)], jobs)
    there = results()
    path = write_page(there)
    write_all(RUNS, [result for runs in there.values() for result in runs])
    console.print(f"wrote {path}")
    _publish()
    for name in failed:
        console.print(f"[red]failed[/red] {name}: see {RESULTS / name}.log")
    raise typer.Exit(1 if failed else 0)


def results() -> dict[str, list[Result]]:
    """Every run there is, by experiment and in order of seed."""
    found: dict[str, list[Result]] = {}
    for experiment in EXPERIMENTS.values():
        runs = [read(path) for path in RESULTS.glob(f"{experiment.name}-*.json") if _is_of(path, experiment.name)]
        found[experiment.name] = sorted(runs, key=lambda result: result.seed)
    return found


def _publish() -> None:
    """Puts the first seed's policies of the headline into policies/pretrained/."""
    for experiment in SECTIONS[0].experiments:
        trained = RESULTS / f"{experiment.name}-1.pt"
        if trained.exists():
            write_whole(PRETRAINED / f"{experiment.name}.pt", trained.read_bytes())


def _is_of(path: Path, name: str) -> bool:
    return path.stem.rsplit("-", 1)[0] == name


def _todo(chosen: list[Experiment], seeds: int | None, *, again: bool) -> Iterator[tuple[Experiment, int]]:
    """Longest first within a seed would finish sooner; in order, a stopped reproduction has whole rows."""
    for experiment in chosen:
        for seed in range(1, (seeds or experiment.seeds) + 1):
            if again or not (RESULTS / f"{experiment.name}-{seed}.json").exists():
                yield experiment, seed


def _run(todo: list[tuple[Experiment, int]], jobs: int) -> list[str]:
    """Runs them, each in a process bound to a core; returns the names of those that failed."""
    RESULTS.mkdir(parents=True, exist_ok=True)
    cores = sorted(os.sched_getaffinity(0))[:jobs]
    running: dict[int, tuple[str, subprocess.Popen[bytes]]] = {}
    failed: list[str] = []
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as progress:
        bar = progress.add_task("runs", total=len(todo))
        waiting = iter(todo)
        pending = next(waiting, None)
        while pending or running:
            for core in cores:
                if pending and core not in running:
                    running[core] = _start(*pending, core)
                    progress.update(bar, description=", ".join(name for name, _ in running.values()))
                    pending = next(waiting, None)
            name, process, core = _first_ended(running)
            del running[core]
            if process.returncode != 0:
                failed.append(name)
            progress.advance(bar)
    return failed


def _start(experiment: Experiment, seed: int, core: int) -> tuple[str, subprocess.Popen[bytes]]:
    name = f"{experiment.name}-{seed}"
    command = [
        "taskset",
        "-c",
        str(core),
        sys.executable,
        "-m",
        "bench.cars.run",
        experiment.name,
        str(seed),
        str(RESULTS / f"{name}.json"),
    ]
    environment = {**os.environ, "OMP_NUM_THREADS": str(experiment.threads)}
    with (RESULTS / f"{name}.log").open("wb") as log:
        process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT, env=environment)
    return name, process


def _first_ended(
    running: dict[int, tuple[str, "subprocess.Popen[bytes]"]],
) -> tuple[str, "subprocess.Popen[bytes]", int]:
    by_pid = {process.pid: (name, process, core) for core, (name, process) in running.items()}
    pid, status = os.waitpid(-1, 0)
    name, process, core = by_pid[pid]
    process.returncode = os.waitstatus_to_exitcode(status)
    return name, process, core


if __name__ == "__main__":
    typer.run(main)
