"""The commands that follow somebody: `honeyguide follow`, and the companion computer alone, `companion`."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from mission.console.command_refusal import learn_extra, refuse
from mission.console.guard_options import guard_of
from mission.console.help_texts import GUARD_SETTING
from mission.console.name_checks import check_policy
from mission.console.terminal import loading

if TYPE_CHECKING:
    from mission.flight_settings import FollowOptions


def companion(
    policy: Annotated[
        str,
        typer.Option(
            help="A policy of FollowMe, Navigate or Drive: a file or a run's folder; or 'scripted', a follower."
        ),
    ],
    link: Annotated[
        str,
        typer.Option(
            help="The vehicle: udpout://HOST:PORT, udpin://ADDRESS:PORT, tcp://HOST:PORT, serial://PATH:BAUD."
        ),
    ] = ("udpout://127.0.0.1:14580"),
    camera: Annotated[str, typer.Option(help="Where the pictures come from: tcp://HOST:PORT.")] = (
        "tcp://127.0.0.1:14600"
    ),
    engage: Annotated[
        bool,
        typer.Option(
            "--engage", help="Take control once, as soon as everything is there; to navigate or drive, at each goto."
        ),
    ] = False,
    by_sticks: Annotated[
        bool,
        typer.Option(
            "--by-sticks", help="Drive by MANUAL_CONTROL in mode Position: stock PX4's Offboard does not reverse."
        ),
    ] = False,
    follow: Annotated[
        bool, typer.Option("--follow", help="Go after the owner by a policy of Navigate, which else goes to gotos.")
    ] = False,
    guard: Annotated[
        bool, typer.Option("--guard/--no-guard", help="A guard that does not believe the policy bounds it.")
    ] = True,
    guard_setting: Annotated[list[str] | None, typer.Option(help=GUARD_SETTING)] = None,
    record: Annotated[
        Path | None, typer.Option(help="Keep each decision in this folder, for honeyguide dataset build.")
    ] = None,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="End after this much wall clock time.")] = None,
) -> None:
    """Fly a policy as a companion computer does: over MAVLink and the camera's stream, in its own process."""
    with learn_extra():
        if policy != "scripted":
            check_policy(policy)
        with loading(Console()):
            from mission.console.option_checks import UserError
            from mission.follow.companion_process import CompanionError, CompanionOptions, run_companion

        try:
            held = guard_of(guard, guard_setting or ())
            options = CompanionOptions(policy, link, camera, engage, seconds, held, by_sticks, follow, record)
            typer.echo(run_companion(options, Console()))
        except (CompanionError, UserError) as error:
            refuse(str(error))


def follow() -> Callable[..., None]:
    """Let the drone follow somebody who walks through hills and trees."""
    from mission.console.model_command import model_command
    from mission.flight_settings import FOLLOWED_WITH, FollowOptions

    return model_command(FollowOptions, _follow, names=FOLLOWED_WITH)


def _follow(options: "FollowOptions") -> int:
    with learn_extra():
        from mission.console.option_checks import UserError, check_owner, check_vehicle, speed_of
        from policies.companion.names import SCRIPTED

        try:
            check_owner(options)
            speed_of(options.speed)
            check_vehicle(options)
            if options.policy is not None and options.policy != SCRIPTED:
                check_policy(options.policy)
            from mission.flight_options import check_parameters

            check_parameters(options)
            with loading(Console()):
                from mission.follow.follow_session import follow_session
            return follow_session(options)
        except UserError as error:
            refuse(str(error))
