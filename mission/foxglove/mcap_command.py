"""The command that makes an MCAP file of a kept log, or prints the layout: `honeyguide mcap`."""

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from mission.console.command_refusal import refuse
from mission.console.name_checks import check_file
from mission.console.terminal import loading

LAYOUT = Path(__file__).with_name("layout.json")


def mcap(
    log: Annotated[Path | None, typer.Argument(help="A ULog (.ulg) of a run, or PX4's.")] = None,
    output: Annotated[Path | None, typer.Argument(help="The file to write. Default: beside the log.")] = None,
    layout: Annotated[bool, typer.Option("--layout", help="Print Foxglove's layout for our channels.")] = False,
) -> None:
    """Write a kept log as an MCAP file, which Foxglove opens."""
    if layout:
        typer.echo(LAYOUT.read_text(encoding="utf-8"), nl=False)
        return
    if log is None:
        refuse("LOG: name a log (.ulg), or ask for --layout")
    check_file(log)
    if find_spec("foxglove") is None:
        refuse("mcap: comes with the extra 'foxglove' (docs/start/installing.md)")
    with loading(Console()):
        from mission.foxglove.convert import ConversionError, convert

    target = log.with_suffix(".mcap") if output is None else output
    try:
        count = convert(log, target)
    except ConversionError as error:
        refuse(str(error))
    typer.echo(f"{target}: {count} moments")
