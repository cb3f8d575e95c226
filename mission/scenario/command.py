"""The command that flies scenario files and judges them: `honeyguide test`. Light to import."""

import os
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from mission.console.command_refusal import learn_extra, refuse
from mission.console.terminal import loading

if TYPE_CHECKING:
    from mission.scenario.scenario_file import ScenarioFile

RUN_MAX_S = 1800.0  # wall clock: ten minutes of many vehicles or of a policy take minutes


def fly_scenarios(
    paths: Annotated[
        list[Path] | None, typer.Argument(help="Scenario files, or folders of *.scenario.yaml.", show_default=False)
    ] = None,
    ready: Annotated[bool, typer.Option("--ready", help="Those that ship, too.")] = False,
    seeds: Annotated[
        str | None, typer.Option(help="Fly each with these, as 1,2,3. Default: those of the scenario.")
    ] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes at a time. Default: one per core.")] = None,
    run_max: Annotated[
        float, typer.Option(min=1.0, help="A run that takes longer [s, wall clock] hangs, and has failed.")
    ] = RUN_MAX_S,
    junit: Annotated[Path | None, typer.Option(help="Write JUnit XML.")] = None,
    keep: Annotated[Path | None, typer.Option(help="Folder where runs that fail are kept, with logs.")] = None,
    keep_all: Annotated[bool, typer.Option("--keep-all", help="Keep those that pass, too.")] = False,
    mcap: Annotated[bool, typer.Option("--mcap", help="Kept runs have flight.mcap too, for Foxglove.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Show what failed only.")] = False,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON schema of scenario files, and end.")] = False,
) -> None:
    """Fly scenarios faster than real time and check what is asked of them: 0 passed, 1 failed, 2 wrong input."""
    from mission.console.option_checks import UserError

    if schema:
        from mission.scenario.schema import schema_text

        typer.echo(schema_text(), nl=False)
        return
    try:
        from mission.scenario.scenario_file import READY, ScenarioFile, find_files, read_scenario

        if keep is None and (keep_all or mcap):
            raise UserError(f"test: {'--keep-all' if keep_all else '--mcap'} needs --keep FOLDER")
        if mcap and find_spec("foxglove") is None:
            raise UserError("--mcap: comes with the extra 'foxglove' (docs/start/installing.md)")
        if not paths and not ready:
            raise UserError("test: name scenario files or folders, or add --ready")
        files = find_files([*(paths or ()), *([READY] if ready else [])])
        scenarios = _that_can_be_flown([ScenarioFile(path, read_scenario(path)) for path in files])
        chosen = None if seeds is None else _seeds(seeds)
        if junit is not None and not junit.resolve().parent.is_dir():
            raise UserError(f"--junit {junit}: no such folder")
        with learn_extra():
            with loading(Console(stderr=True)):
                from mission.scenario.flight.building import check_scenario
                from mission.scenario.one_run import planned_runs
                from mission.scenario.session import scenario_session

                for file in scenarios:
                    check_scenario(file.scenario, str(file.path))
            planned = planned_runs(scenarios, chosen, keep, keeps_all=keep_all, has_mcap=mcap)
            count = jobs or len(os.sched_getaffinity(0))
            _check_written(keep, junit)
            code = scenario_session(planned, count, run_max, junit=junit, is_quiet=quiet)
    except UserError as error:
        refuse(str(error))
    raise typer.Exit(code)


def _that_can_be_flown(files: list["ScenarioFile"]) -> list["ScenarioFile"]:
    """All but those that ship and need the extra `learn`, where it is not installed: they are named."""
    from mission.scenario.scenario_file import READY

    if find_spec("torch") is not None:
        return files
    left_out = [file for file in files if file.path.parent == READY and file.scenario.needs_learn]
    if left_out:
        names = ", ".join(file.scenario.name for file in left_out)
        typer.echo(f"left out, they need the extra 'learn' (docs/start/installing.md): {names}", err=True)
    return [file for file in files if file not in left_out]


def _check_written(keep: Path | None, junit: Path | None) -> None:
    """Refuses, before anything is flown, a folder and a file that cannot be written after it."""
    from common.files import part_path
    from mission.console.option_checks import UserError

    option = f"--keep {keep}"
    try:
        if keep is not None:
            keep.mkdir(parents=True, exist_ok=True)
            (keep / ".part").touch()
            (keep / ".part").unlink()
        option = f"--junit {junit}"
        if junit is not None:
            if junit.is_dir():
                raise UserError(f"{option}: is a folder")
            part_path(junit).touch()
            part_path(junit).unlink()
    except OSError as error:
        raise UserError(f"{option}: cannot be written: {error.strerror}") from error


def _seeds(text: str) -> tuple[int, ...]:
    from mission.console.option_checks import UserError
    from mission.scenario.scenario import SEED_MAX

    try:
        seeds = tuple(int(part) for part in text.split(","))
    except ValueError:
        seeds = (-1,)
    if not all(0 <= seed <= SEED_MAX for seed in seeds):
        raise UserError(f"--seeds {text}: must be whole numbers from 0, as 1,2,3")
    return seeds
