"""`honeyguide test`: flies scenarios side by side in processes, shows their results and writes them."""

import multiprocessing
import shutil
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from common.files import write_whole
from common.pool_worker import end_with_parent
from mission.console.option_checks import UserError
from mission.console.terminal import print_line
from mission.scenario.junit import junit_text
from mission.scenario.keeping import keep_scenario, run_folder_of
from mission.scenario.result import CheckResult, ScenarioResult
from mission.scenario.runner import run_scenario
from mission.scenario.scenario import Scenario

WIDTH = 150  # of the table where there is no terminal


@dataclass(frozen=True, slots=True)
class Planned:
    """One run of one scenario."""

    scenario: Scenario
    file: str
    seed: int
    keep: Path | None
    """Folder for the runs that fail."""
    keeps_all: bool = False
    """And for those that pass."""
    has_mcap: bool = False
    """Those that are kept have an MCAP file beside each log."""


@dataclass(frozen=True, slots=True)
class Flown:
    """What came of it."""

    result: ScenarioResult | None
    refusal: str = ""
    """Why it could not be flown at all."""
    command: str = ""
    """That flies a kept run again."""


def fly(planned: Planned) -> Flown:
    """One run, in a process of its own or here."""
    try:
        folder = None if planned.keep is None else run_folder_of(planned.keep, planned.scenario, planned.seed)
        result = run_scenario(planned.scenario, planned.seed, folder=folder, file=planned.file)
    except UserError as error:
        return Flown(None, planned.scenario.refusal(error, planned.file))
    if folder is None:
        return Flown(result)
    if result.passed and not planned.keeps_all:
        shutil.rmtree(folder)
        return Flown(replace(result, folder="", ulogs=(), tlogs=()))
    if planned.has_mcap:
        from mission.foxglove.convert import convert

        for ulog in map(Path, result.ulogs):
            convert(ulog, ulog.with_suffix(".mcap"))
    return Flown(result, command=keep_scenario(folder, planned.scenario, planned.seed))


def scenario_session(
    planned: Sequence[Planned], jobs: int, *, junit: Path | None = None, is_quiet: bool = False
) -> int:
    """Flies all, shows and writes the results; the exit code: 0 all passed, 1 some failed, 2 one cannot be flown."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=WIDTH)
    try:
        flown = _flown(planned, min(jobs, len(planned)), console)
    except KeyboardInterrupt:
        print_line(console, "stopped by the user")
        return 1
    refusals = [each.refusal for each in flown if each.refusal]
    results = [each.result for each in flown if each.result is not None]
    if not is_quiet:
        console.print(_table(results))
    _tell(flown, console)
    if junit is not None:
        write_whole(junit, junit_text(results))
        print_line(console, f"JUnit: {junit}")
    for refusal in refusals:
        print_line(console, f"cannot be flown: {refusal}")
    if refusals:
        return 2
    return 0 if all(result.passed for result in results) else 1


def _flown(planned: Sequence[Planned], jobs: int, console: Console) -> list[Flown]:
    """In the order in which they were planned."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    done: dict[int, Flown] = {}
    with Progress(*columns, console=console, transient=True) as progress:
        bar = progress.add_task("scenarios", total=len(planned))

        def note(index: int, flown: Flown) -> None:
            done[index] = flown
            progress.advance(bar)
            is_passed = flown.result is not None and flown.result.passed
            if not is_passed or not console.is_terminal:
                text = (
                    f"{planned[index].scenario.name}, seed {planned[index].seed}: {'passed' if is_passed else 'failed'}"
                )
                print_line(progress.console, f"{len(done)}/{len(planned)} {text}")

        if jobs <= 1:
            for index, each in enumerate(planned):
                note(index, fly(each))
        else:
            with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), end_with_parent) as pool:
                order = sorted(range(len(planned)), key=lambda index: -_weight(planned[index].scenario))
                futures = {pool.submit(fly, planned[index]): index for index in order}
                try:
                    for future in as_completed(futures):
                        note(futures[future], future.result())
                except KeyboardInterrupt:
                    pool.shutdown(wait=False, cancel_futures=True)
                    raise
    return [done[index] for index in range(len(planned))]


def _weight(scenario: Scenario) -> int:
    """How much there is to do in it, roughly: who takes long begins first."""
    return len(scenario.fleet) + (20 if scenario.owner else 0) + (10 if scenario.fleet[0].policy else 0)


def _table(results: Sequence[ScenarioResult]) -> Table:
    table = Table("scenario", "seed", "check", "asked", "happened", "margin", "worst at")
    for result in results:
        title, seed = escape(result.name), str(result.seed)
        if result.error:
            table.add_row(title, seed, "[red]flown to its end[/]", "", escape(result.error), "", "")
            title = seed = ""
        for check in result.checks:
            table.add_row(title, seed, *_row(check))
            title = seed = ""
        table.add_section()
    return table


def _row(check: CheckResult) -> tuple[str, ...]:
    colour = "green" if check.passed else "red"
    margin = (
        f"{check.margin:.3g} {check.unit}".strip() if isfinite(check.margin) else "ok" if check.passed else "failed"
    )
    worst = f"{check.worst_s:.1f} s" if isfinite(check.worst_s) else ""
    return (
        f"[{colour}]{escape(check.name)}[/]",
        escape(check.asked),
        escape(check.happened),
        f"[{colour}]{margin}[/]",
        worst,
    )


def _tell(flown: Sequence[Flown], console: Console) -> None:
    """What failed, how it is flown again, and the sum."""
    results = [each.result for each in flown if each.result is not None]
    for each in flown:
        if each.result is not None and not each.result.passed:
            for line in failure_lines(each):
                print_line(console, line)
    passed, simulated_s = sum(result.passed for result in results), sum(result.simulated_s for result in results)
    print_line(console, f"{passed} of {len(flown)} passed, {simulated_s:.0f} simulated seconds")


def failure_lines(flown: Flown) -> list[str]:
    """What failed of a run, and how it is flown again."""
    result = flown.result
    if result is None:
        return [flown.refusal]
    kept = [f"  kept in {result.folder}; again: {flown.command}"] if flown.command else []
    done = [f"  {time_s:.1f} s {text}" for time_s, _, text in result.events]
    return [f"{result.name}, seed {result.seed}:", *(f"  {text}" for text in result.failures), *done, *kept]
