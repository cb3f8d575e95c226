"""The command that reviews flights by their logs: `honeyguide review`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from mission.console.command_refusal import refuse
from mission.console.terminal import loading


def review(
    logs: Annotated[
        list[Path], typer.Argument(help="A ULog of PX4 or ours, a run's folder, a folder of runs; two are compared.")
    ],
    output: Annotated[
        Path | None, typer.Option(help="The HTML file; of many flights a folder. Default: beside the log.")
    ] = None,
    open: Annotated[bool, typer.Option("--open", help="Show it in the browser.")] = False,  # noqa: A002  the name of the option
) -> None:
    """Review flights: one HTML file with map, replay, plots and health, which needs no network."""
    with loading(Console()):
        from mission.review.logged_flight import ReviewError
        from mission.review.review_session import ReviewOptions
        from mission.review.review_session import review as write_review

    try:
        write_review(ReviewOptions(logs, output, open), Console())
    except ReviewError as error:
        refuse(str(error))
