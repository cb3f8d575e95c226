"""`honeyguide benchmark`: flies a policy through every condition of a task, shows the table and writes it."""

import json
import multiprocessing
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from common.files import write_whole
from common.pool_worker import end_with_parent
from mission.benchmark.benchmark import FIRST_SEED, Benchmark, benchmark_of
from mission.benchmark.kept_flight import KeptFlight
from mission.console.option_checks import UserError
from mission.console.terminal import print_line
from policies.companion.guard.settings import GuardSettings
from policies.companion.pilot import PilotError
from policies.learn.export.provenance import code_record


@dataclass(frozen=True, slots=True)
class BenchmarkOptions:
    """What the command is given."""

    task: str
    policy: str
    conditions: tuple[str, ...]  # none: all
    flights: int  # of each
    jobs: int
    seed: int = FIRST_SEED  # of the first flight; every second from there on
    guard: GuardSettings = field(default_factory=GuardSettings)
    out: Path | None = None
    record: Path | None = None  # folder of flights that are kept


@dataclass(frozen=True, slots=True)
class _Flight:
    task: str
    policy: str
    condition: str
    seed: int
    guard: GuardSettings
    folder: Path | None  # of its logs


def benchmark_session(options: BenchmarkOptions) -> dict[str, list[Any]]:
    """The outcomes by condition, shown and written.

    Raises:
        PilotError: no such policy, or one that fails in flight.
        UserError: what is to be recorded cannot be.
    """
    benchmark = benchmark_of(options.task)
    benchmark.load(options.policy)  # refused before anything is flown
    console = Console()
    names = tuple(dict.fromkeys(options.conditions)) or tuple(benchmark.titles)
    outcomes: dict[str, list[Any]] = {name: [] for name in names}
    flights = [
        _Flight(options.task, options.policy, name, seed, options.guard, _folder(options.record, name, seed))
        for name in names
        for seed in range(options.seed, options.seed + 2 * options.flights, 2)
    ]
    if options.out is not None:
        _make(options.out, "--out")
    _make_folders(flights)
    if options.seed % 2 == 0 and options.record is None:
        print_line(console, f"seed {options.seed}: even seeds are of worlds that trainings draw from")
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    spawned = multiprocessing.get_context("spawn")
    with (
        Progress(*columns, console=console) as progress,
        ProcessPoolExecutor(options.jobs, spawned, end_with_parent) as pool,
    ):
        bar = progress.add_task("flights", total=len(flights))
        for flight, outcome in zip(flights, pool.map(_flown, flights), strict=True):
            flown = outcomes[flight.condition]
            flown.append(outcome)
            progress.advance(bar)
            if options.out is not None and len(flown) == options.flights:  # whatever comes of the others
                _write(options.out, options, benchmark, {name: found for name, found in outcomes.items() if found})
    console.print(_shown(benchmark.columns, _rows(benchmark, outcomes)))
    if options.out is not None:
        console.print(f"table and flights: {options.out}")
    if options.record is not None:
        print_line(console, f"recorded: {options.record}; honeyguide dataset build takes it")
    return outcomes


def misses(task: str, outcomes: dict[str, list[Any]]) -> list[str]:
    """What fell short of what is wanted, a sentence each."""
    return _misses(benchmark_of(task), outcomes)


def _misses(benchmark: Benchmark, outcomes: dict[str, list[Any]]) -> list[str]:
    return [text for name, flown in outcomes.items() for text in benchmark.misses(name, flown)]


def _folder(record: Path | None, condition: str, seed: int) -> Path | None:
    return None if record is None else record / f"{condition}-seed{seed}"


def _make_folders(flights: Sequence[_Flight]) -> None:
    """Raises UserError if one is there already, or cannot be made."""
    folders = [flight.folder for flight in flights if flight.folder is not None]
    for folder in folders:
        if folder.exists():
            raise UserError(f"--record: {folder} is there already; name another folder")
    for folder in folders:
        _make(folder, "--record")


def _make(folder: Path, option: str) -> None:
    """Raises UserError if it cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{option} {error.filename}: cannot be made: {error.strerror}") from error


@cache
def _pilot(task: str, name: str) -> Any:
    return benchmark_of(task).load(name)


def _flown(flight: _Flight) -> Any:
    """In a process of its own."""
    pilot = _pilot(flight.task, flight.policy)
    kept = KeptFlight(flight.folder, flight.policy)
    try:
        return benchmark_of(flight.task).fly(pilot, flight.condition, flight.seed, flight.guard, kept)
    except PilotError as error:
        raise PilotError(f"{flight.condition}, seed {flight.seed}: {error}") from error
    finally:
        kept.close()


def _shown(columns: Sequence[str], rows: Sequence[tuple[str, ...]]) -> Table:
    table = Table(*columns)
    for cells in rows:
        table.add_row(*cells)
    return table


def markdown(columns: Sequence[str], rows: Sequence[tuple[str, ...]]) -> str:
    """The table for a page."""
    head = "| " + " | ".join(columns) + " |\n|" + "---|" * len(columns)
    return "\n".join([head, *("| " + " | ".join(cells) + " |" for cells in rows)]) + "\n"


def _rows(benchmark: Benchmark, outcomes: dict[str, list[Any]]) -> list[tuple[str, ...]]:
    return [benchmark.row(name, flown) for name, flown in outcomes.items()]


def _page(benchmark: Benchmark, outcomes: dict[str, list[Any]]) -> str:
    """The table, with the names of conditions that --condition takes, and below it what was missed."""
    missed = _misses(benchmark, outcomes)
    below = "".join(f"- {text}\n" for text in missed)
    named = zip(outcomes, _rows(benchmark, outcomes), strict=True)
    rows = [(f"{cells[0]}: `{name}`", *cells[1:]) for name, cells in named]
    return markdown(benchmark.columns, rows) + (f"\nMissed:\n\n{below}" if missed else "")


def _write(out: Path, options: BenchmarkOptions, benchmark: Benchmark, outcomes: dict[str, list[Any]]) -> None:
    write_whole(out / "table.md", _page(benchmark, outcomes).encode())
    flown = {name: [asdict(outcome) for outcome in found] for name, found in outcomes.items()}
    record = {name: getattr(options, name) for name in ("task", "policy", "seed")}
    record |= {"has_guard": options.guard.is_on, "guard_settings": options.guard.changed}
    record |= {"code": code_record(), "flights": flown}
    write_whole(out / "flights.json", (json.dumps(record, indent=1) + "\n").encode())
