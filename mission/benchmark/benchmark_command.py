"""The command that judges policies by fixed flights: `honeyguide benchmark`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from mission.benchmark.benchmark import FIRST_SEED, TASKS
from mission.console.command_refusal import learn_extra, refuse
from mission.console.guard_options import guard_of
from mission.console.help_texts import GUARD_SETTING
from mission.console.terminal import loading


def benchmark(
    task: Annotated[str, typer.Argument(help=f"What is judged: {', '.join(TASKS)}.")],
    policy: Annotated[
        str | None,
        typer.Option(
            help="A policy of the task: name, file or run; .onnx file; module:Class; to follow 'scripted' too. "
            "Default: the one that ships."
        ),
    ] = None,
    condition: Annotated[list[str] | None, typer.Option(help="One of them; repeatable. Default: all.")] = None,
    flights: Annotated[int, typer.Option(min=1, help="Of each condition.")] = 60,
    jobs: Annotated[int, typer.Option(min=1, help="Processes at a time.")] = 2,
    seed: Annotated[int, typer.Option(min=1, help="Of the first flight; each next is 2 more.")] = FIRST_SEED,
    guard: Annotated[bool, typer.Option("--guard/--no-guard", help="The guard bounds the policy.")] = True,
    guard_setting: Annotated[list[str] | None, typer.Option(help=GUARD_SETTING)] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for table.md and flights.json.")] = None,
    record: Annotated[
        Path | None, typer.Option(help="Folder for each flight's logs and decisions, as dataset build takes them.")
    ] = None,
) -> None:
    """Fly a policy through standard and harder conditions, over MAVLink, and show how often it succeeds and hits."""
    if task not in TASKS:
        refuse(f"benchmark {task}: there are {', '.join(TASKS)}")
    with learn_extra():
        with loading(Console()):
            from mission.benchmark.benchmark import benchmark_of
            from mission.benchmark.session import BenchmarkOptions, benchmark_session, misses
            from mission.console.option_checks import UserError
            from policies.companion.pilot import PilotError

            names = benchmark_of(task).titles
        unknown = [name for name in condition or () if name not in names]
        if unknown:
            refuse(f"--condition {unknown[0]}: there are {', '.join(names)}")
        chosen = policy or TASKS[task][1]
        try:
            held = guard_of(guard, guard_setting or ())
            options = BenchmarkOptions(task, chosen, tuple(condition or ()), flights, jobs, seed, held, out, record)
            outcomes = benchmark_session(options)
        except (PilotError, UserError) as error:
            refuse(str(error))
        found = misses(task, outcomes)
        for text in found:
            typer.echo(f"miss: {text}")
        raise typer.Exit(1 if found else 0)
