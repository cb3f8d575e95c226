"""The command that shows finished flights: `honeyguide replay`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from mission.console.command_refusal import learn_extra, refuse
from mission.console.name_checks import check_run
from mission.console.terminal import loading


def replay(
    run: Annotated[Path, typer.Argument(help="The folder of a run.")],
    html: Annotated[Path | None, typer.Option(help="Write one HTML file that needs nothing else.")] = None,
    mp4: Annotated[Path | None, typer.Option(help="Write a film: from behind, with the onboard picture.")] = None,
    view_port: Annotated[int, typer.Option(min=1, max=65535, help="HTTP port of the page.")] = 8080,
) -> None:
    """Show a finished flight in the browser, or write it as an HTML file or a film."""
    check_run(run)
    with learn_extra():
        with loading(Console()):
            from mission.console.option_checks import UserError
            from mission.view.replay import ReplayOptions
            from mission.view.replay import replay as show

        try:
            show(ReplayOptions(run, html, mp4, view_port), Console())
        except UserError as error:
            refuse(str(error))
