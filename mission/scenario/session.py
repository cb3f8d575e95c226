"""`honeyguide test`: flies scenarios side by side in processes, shows their results and writes them."""

from collections.abc import Sequence
from math import isfinite
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from common.files import write_whole
from common.worker_processes import WorkerProcesses
from mission.console.option_checks import UserError
from mission.console.terminal import print_line
from mission.scenario.junit import junit_text
from mission.scenario.one_run import Flown, Planned, ScenarioRuns, failure_lines
from mission.scenario.result import CheckResult, ScenarioResult
from mission.scenario.scenario import Scenario

WIDTH = 150  # of the table where there is no terminal


def scenario_session(
    planned: Sequence[Planned], jobs: int, run_max_s: float, *, junit: Path | None = None, is_quiet: bool = False
) -> int:
    """Flies all, shows and writes the results; the exit code: 0 all passed, 1 some failed, 2 one cannot be flown.

    Args:
        planned: each run once.
        jobs: how many processes at a time.
        run_max_s: a run that takes longer by the wall clock hangs, and is given up.
        junit: written as JUnit XML.
        is_quiet: without the table.
    """
    console = Console()
    if not console.is_terminal:
        console = Console(width=WIDTH)
    try:
        flown = _flown(planned, jobs, run_max_s, console)
    except KeyboardInterrupt:
        print_line(console, "stopped by the user")
        return 1
    refusals = [each.refusal for each in flown if each.refusal]
    results = [each.result for each in flown if each.result is not None]
    if not is_quiet:
        console.print(_table(results))
    _tell(flown, console)
    if junit is not None:
        try:
            every = [each.result or run.refused(each.refusal) for run, each in zip(planned, flown, strict=True)]
            write_whole(junit, junit_text(every))
        except OSError as error:
            raise UserError(f"--junit {junit}: cannot be written: {error.strerror}") from error
        print_line(console, f"JUnit: {junit}")
    for refusal in refusals:
        print_line(console, f"cannot be flown: {refusal}")
    if refusals:
        return 2
    return 0 if all(result.passed for result in results) else 1


def _flown(planned: Sequence[Planned], jobs: int, run_max_s: float, console: Console) -> list[Flown]:
    """In the order in which they were planned."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    done: dict[tuple[str, int], Flown] = {}
    processes = WorkerProcesses[Planned, Flown](ScenarioRuns(), jobs, run_max_s)
    try:
        with Progress(*columns, console=console, transient=True) as progress:
            bar = progress.add_task("scenarios", total=len(planned))
            for each, flown in processes.done(sorted(planned, key=lambda each: -_weight(each.scenario))):
                done[each.key] = flown
                progress.advance(bar)
                is_passed = flown.result is not None and flown.result.passed
                if not is_passed or not console.is_terminal:
                    text = f"{each.scenario.name}, seed {each.seed}: {'passed' if is_passed else 'failed'}"
                    print_line(progress.console, f"{len(done)}/{len(planned)} {text}")
    finally:
        processes.close()
    return [done[each.key] for each in planned]


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
    """What failed, how it is flown again, what could not be kept, and the sum."""
    results = [each.result for each in flown if each.result is not None]
    for each in flown:
        if each.result is not None and not each.result.passed:
            for line in failure_lines(each):
                print_line(console, line)
        if each.note:
            print_line(console, each.note)
    passed, simulated_s = sum(result.passed for result in results), sum(result.simulated_s for result in results)
    print_line(console, f"{passed} of {len(flown)} passed, {simulated_s:.0f} simulated seconds")
