"""`honeyguide campaign`: flies a campaign, shows how far it is and what it has found, and writes it."""

import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from mission.campaign.campaign import Campaign
from mission.campaign.findings import (
    SUMMARY_FILE,
    WORST_FOLDER,
    Findings,
    findings_of,
    fraction_text,
    has_logs,
    write_summary,
)
from mission.campaign.flying import Flights, Note, Stopped, Workers
from mission.campaign.report.page import REPORT_FILE, write_report
from mission.campaign.run_store import RunStore
from mission.campaign.runs import Record
from mission.campaign.search.whole import fly_campaign
from mission.console.option_checks import UserError
from mission.console.terminal import busy, print_line

WIDTH = 150  # where there is no terminal
LINE_EVERY = 100  # runs, where there is no terminal


def identity_of(campaign: Campaign) -> dict[str, Any]:
    """What makes it the same campaign: all but how many samples it has and what is required of them."""
    given: dict[str, Any] = campaign.model_dump(mode="json", by_alias=True, exclude_unset=True)
    return {key: value for key, value in given.items() if key not in ("runs", "require", "about")}


def campaign_session(
    campaign: Campaign,
    folder: Path,
    make_workers: Callable[[], Workers],
    make_loggers: Callable[[Path], Workers],
    *,
    must_exist: bool = False,
) -> int:
    """Flies, shows and writes it; 0: done and what is required is met, 1: not.

    Args:
        campaign: with its scenario read.
        folder: where runs and report go.
        make_workers: who flies it.
        make_loggers: who flies the worst runs again, each with its logs in a folder of the folder that is given.
        must_exist: refuses a folder that holds no campaign.

    Raises:
        UserError: the folder cannot be used.
    """
    console = Console()
    if not console.is_terminal:
        console = Console(width=WIDTH)
    with RunStore(folder, identity_of(campaign), must_exist=must_exist) as store:
        kept = len(store.records)
        if kept:
            print_line(console, f"{folder}: {kept} runs are there already; it goes on")
        workers = make_workers()
        try:
            with _shown(console, campaign, kept) as note:
                samples, searches = fly_campaign(Flights(campaign, store, workers, note), campaign.runs)
        except KeyboardInterrupt:
            print_line(console, f"stopped by the user; {len(store.records)} runs are kept, the same command goes on")
            return 1
        except Stopped as stopped:
            print_line(console, f"{stopped}; {len(store.records)} runs are kept, the same command goes on")
            return 1
        except OSError as error:
            raise UserError(f"{folder}: cannot write there: {error.strerror}") from error
        finally:
            workers.close()
        findings = findings_of(campaign, samples, searches, folder)
        write_summary(findings, folder)
        write_report(findings, folder)
        try:
            _log_worst(findings, folder / WORST_FOLDER, make_loggers, console)
        except KeyboardInterrupt:
            print_line(console, "stopped by the user; some of the worst runs have no logs, the same command goes on")
            return 1
    _tell(findings, folder, console)
    return 0 if findings.is_met else 1


def _log_worst(findings: Findings, worst: Path, make_loggers: Callable[[Path], Workers], console: Console) -> None:
    """Flies the worst runs again with their logs; one whose process ended or hung would only do so again."""
    orders = [each.record.order for each in findings.worst if each.command and not each.record.is_lost]
    missing = [order for order in orders if not has_logs(worst / order.folder)]
    if not missing:
        return
    loggers = make_loggers(worst)
    try:
        with busy(console, f"flying the {len(missing)} worst again for their logs"):
            for record in loggers.fly(missing):
                if record.is_lost:
                    print_line(console, f"{record.phase} {record.number} has no logs: {record.error}")
    finally:
        loggers.close()


@contextmanager
def _shown(console: Console, campaign: Campaign, kept: int) -> Iterator[Note]:
    clocks = (TimeElapsedColumn(), TimeRemainingColumn())
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), *clocks)
    failed = count = 0
    with Progress(*columns, console=console, transient=True) as progress:
        bar = progress.add_task(campaign.name, total=max(campaign.runs, 1), completed=min(kept, campaign.runs))

        def note(record: Record) -> None:
            nonlocal failed, count
            count += 1
            failed += not record.passed
            is_sample = record.phase == "sample"
            progress.update(bar, description=f"{campaign.name}: {record.phase}, {failed} failed")
            if is_sample:
                progress.advance(bar)
            if not console.is_terminal and count % LINE_EVERY == 0:
                print_line(console, f"{count} runs flown, {failed} failed")

        yield note


def _tell(findings: Findings, folder: Path, console: Console) -> None:
    campaign = findings.campaign
    if findings.samples:
        met = (
            ""
            if campaign.success_min is None
            else f"; required: {campaign.require}, {'met' if findings.is_met else 'not met'}"
        )
        print_line(console, f"success {fraction_text(findings.success)}{met}")
    lost = [record for record in findings.samples if record.is_lost]
    for record in lost[:3]:
        print_line(console, f"run {record.number} was lost: {record.error}")
    if findings.sensitivities:
        console.print(_sensitivity_table(findings))
    for search in findings.searches:
        print_line(console, search.sentence)
    if findings.worst:
        console.print(_worst_table(findings))
        for each in findings.worst[:3]:
            if each.command:
                print_line(console, f"again: {each.command}")
        if any(has_logs(folder / WORST_FOLDER / each.record.order.folder) for each in findings.worst):
            print_line(console, f"their logs: honeyguide review {shlex.quote(str(folder))}")
    print_line(console, f"report: {folder / REPORT_FILE}; figures: {folder / SUMMARY_FILE}")


def _sensitivity_table(findings: Findings) -> Table:
    table = Table(
        "varied", "rank correlation with the least margin", "explained", "success from least to greatest value"
    )
    for each in findings.sensitivities:
        rho = "" if each.rank_correlation is None else f"{each.rank_correlation:+.2f}"
        success = " ".join(f"{b.success.value:.0%}" for b in each.bins)
        mark = "" if each.is_clear else " (chance)"
        table.add_row(escape(each.key), rho + mark, f"{each.explained:.0%}", success)
    return table


def _worst_table(findings: Findings) -> Table:
    table = Table("worst", "seed", "margin", "values", "failed")
    for each in findings.worst:
        record = each.record
        margin = "" if record.margin is None else f"{record.margin:.3g} {record.unit} ({record.check})"
        values = ", ".join(f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in record.values.items())
        failed = "; ".join(record.failures)
        table.add_row(
            f"{record.phase} {record.number}", str(record.seed), escape(margin), escape(values), escape(failed[:80])
        )
    return table
