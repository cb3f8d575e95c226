"""The command of a companion computer: `honeyguide companion`."""

from typing import Annotated

import typer
from rich.console import Console

from mission.refusal import learn_extra, refuse


def companion(
    policy: Annotated[str, typer.Option(help="A policy of FollowMe: a file or a run's folder; or 'scripted'.")],
    link: Annotated[str, typer.Option(help="Where the vehicle listens: udpout://HOST:PORT.")] = (
        "udpout://127.0.0.1:14580"
    ),
    camera: Annotated[str, typer.Option(help="Where the pictures come from: tcp://HOST:PORT.")] = (
        "tcp://127.0.0.1:14600"
    ),
    engage: Annotated[
        bool, typer.Option("--engage", help="Take control once, as soon as everything is there.")
    ] = False,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="End after this much wall clock time.")] = None,
) -> None:
    """Fly a policy as a companion computer does: over MAVLink and the camera's stream, in its own process."""
    with learn_extra():
        from mission.follow.companion import CompanionError, CompanionOptions, run_companion

        try:
            typer.echo(run_companion(CompanionOptions(policy, link, camera, engage, seconds), Console()))
        except CompanionError as error:
            refuse(str(error))
