"""`honeyguide benchmark follow`: flies a policy through every condition, shows the table and writes it."""

import json
import multiprocessing
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from common.files import write_whole
from mission.follow.benchmark.conditions import BY_NAME, CONDITIONS, FIRST_SEED, Condition
from mission.follow.benchmark.flights import Outcome, fly
from mission.follow.benchmark.pilots import any_pilot
from mission.follow.benchmark.table import COLUMNS, markdown, row
from policies.companion.guard.settings import GuardSettings
from policies.companion.skills.following import Pilot


@dataclass(frozen=True, slots=True)
class BenchmarkOptions:
    """What the command is given."""

    policy: str
    conditions: tuple[str, ...]  # none: all
    flights: int  # of each
    jobs: int
    seed: int = FIRST_SEED  # of the first flight; every second from there on
    has_guard: bool = True
    out: Path | None = None


@dataclass(frozen=True, slots=True)
class _Flight:
    policy: str
    condition: str
    seed: int
    has_guard: bool


def benchmark_session(options: BenchmarkOptions) -> dict[str, list[Outcome]]:
    """The outcomes by condition, shown and written.

    Raises:
        PilotError: no such policy.
    """
    any_pilot(options.policy)  # refused before anything is flown
    console = Console()
    names = options.conditions or tuple(condition.name for condition in CONDITIONS)
    outcomes: dict[str, list[Outcome]] = {name: [] for name in names}
    flights = [
        _Flight(options.policy, name, options.seed + 2 * k, options.has_guard)
        for name in names
        for k in range(options.flights)
    ]
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    spawned = multiprocessing.get_context("spawn")
    with Progress(*columns, console=console) as progress, ProcessPoolExecutor(options.jobs, spawned) as pool:
        bar = progress.add_task("flights", total=len(flights))
        for flight, outcome in zip(flights, pool.map(_flown, flights), strict=True):
            outcomes[flight.condition].append(outcome)
            progress.advance(bar)
    rows = [row(BY_NAME[name], outcomes[name]) for name in names]
    console.print(_shown(rows))
    if options.out is not None:
        _write(options.out, options, rows, outcomes)
        console.print(f"table and flights: {options.out}")
    return outcomes


def misses(outcomes: dict[str, list[Outcome]]) -> list[str]:
    """What fell short of the conditions' own bounds, a sentence each."""
    return [text for name, flown in outcomes.items() for text in _misses(BY_NAME[name], flown)]


def _misses(condition: Condition, outcomes: Sequence[Outcome]) -> list[str]:
    found = []
    band = sum(outcome.in_band for outcome in outcomes) / len(outcomes)
    if condition.least_in_band is not None and band < condition.least_in_band:
        found.append(f"{condition.title}: {band:.1%} of the time in the band, wanted {condition.least_in_band:.0%}")
    hits = sum(outcome.is_collided for outcome in outcomes)
    if hits:
        found.append(f"{condition.title}: {hits} of {len(outcomes)} flights touched somebody or something")
    nearest_m = min((o.nearest_hidden_m for o in outcomes if o.nearest_hidden_m == o.nearest_hidden_m), default=9.0)
    if condition.least_m is not None and nearest_m < condition.least_m:
        found.append(f"{condition.title}: {nearest_m:.2f} m from a hidden owner, wanted {condition.least_m:g}")
    return found


@cache
def _pilot(name: str) -> Pilot:
    return any_pilot(name)


def _flown(flight: _Flight) -> Outcome:
    """In a process of its own."""
    settings = GuardSettings(is_on=flight.has_guard)
    return fly(_pilot(flight.policy), BY_NAME[flight.condition], flight.seed, settings)


def _shown(rows: Sequence[tuple[str, ...]]) -> Table:
    table = Table(*COLUMNS)
    for cells in rows:
        table.add_row(*cells)
    return table


def _write(
    out: Path, options: BenchmarkOptions, rows: Sequence[tuple[str, ...]], outcomes: dict[str, list[Outcome]]
) -> None:
    out.mkdir(parents=True, exist_ok=True)
    write_whole(out / "table.md", markdown(rows).encode())
    flown = {name: [asdict(outcome) for outcome in found] for name, found in outcomes.items()}
    record = {"policy": options.policy, "has_guard": options.has_guard, "seed": options.seed, "flights": flown}
    write_whole(out / "flights.json", (json.dumps(record, indent=1) + "\n").encode())
