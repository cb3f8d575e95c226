"""The commands that follow somebody: `honeyguide follow`, and the companion computer alone, `companion`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from autopilot.mavlink.transport.links import GROUND_STATION_PORT, OFFBOARD_PORT
from mission.console.command_refusal import learn_extra, refuse
from mission.console.name_checks import check_policy
from mission.console.terminal import busy


def companion(
    policy: Annotated[str, typer.Option(help="A policy of FollowMe: a file or a run's folder; or 'scripted'.")],
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
        bool, typer.Option("--engage", help="Take control once, as soon as everything is there.")
    ] = False,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="End after this much wall clock time.")] = None,
) -> None:
    """Fly a policy as a companion computer does: over MAVLink and the camera's stream, in its own process."""
    with learn_extra():
        if policy != "scripted":
            check_policy(policy)
        with busy(Console(), "loading the program"):
            from mission.follow.companion_process import CompanionError, CompanionOptions, run_companion

        try:
            typer.echo(run_companion(CompanionOptions(policy, link, camera, engage, seconds), Console()))
        except CompanionError as error:
            refuse(str(error))


def follow(
    policy: Annotated[
        str | None,
        typer.Option(help="A policy of FollowMe, or 'scripted'.", show_default="the shipped one, or else 'scripted'"),
    ] = None,
    owner: Annotated[str, typer.Option(help="How the owner moves: walk (to 2 m/s) or run (to 5 m/s).")] = "walk",
    seconds: Annotated[float, typer.Option(min=1.0, help="How long to follow; then it lands.")] = 60.0,
    speed: Annotated[str, typer.Option(help="Times real time, or 'max': lockstep, without network links.")] = "1",
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Seed of the owner's path, noise, turbulence.")] = 0,
    wind: Annotated[float, typer.Option(min=0.0, max=20.0, help="Wind speed [m/s], with turbulence and gusts.")] = 0.0,
    wind_from: Annotated[float, typer.Option(min=0.0, max=360.0, help="Where the wind comes from [deg].")] = 270.0,
    noise: Annotated[float, typer.Option(min=0.0, max=10.0, help="Scale of all sensor noise.")] = 1.0,
    world_seed: Annotated[int, typer.Option(min=0, help="Seed of hills and trees.")] = 1,
    trees: Annotated[float, typer.Option(min=0.0, max=1000.0, help="Trees per hectare.")] = 100.0,
    hills: Annotated[float, typer.Option(min=0.0, max=300.0, help="Height of the hills [m]; trained on 8.")] = 8.0,
    airframe: Annotated[str, typer.Option(help="Airframe name or TOML file; the policy was trained on x500.")] = "x500",
    dialect: Annotated[str, typer.Option(help="What ground stations take it for: px4 or ardupilot.")] = "px4",
    param: Annotated[
        list[str] | None, typer.Option(help="Sets a parameter of the flight controller: NAME=VALUE. Repeatable.")
    ] = None,
    view: Annotated[bool, typer.Option("--view", help="Show the flight on a live page in the browser.")] = False,
    view_port: Annotated[int, typer.Option(min=1, max=65535, help="HTTP port of the live page.")] = 8080,
    mp4: Annotated[bool, typer.Option("--mp4/--no-mp4", help="Film it afterwards: chase and onboard view.")] = True,
    gcs_port: Annotated[int, typer.Option(min=1, max=65535, help="UDP port of ground stations.")] = GROUND_STATION_PORT,
    api_port: Annotated[int, typer.Option(min=1, max=65535, help="UDP port of the offboard API.")] = OFFBOARD_PORT,
    host: Annotated[str, typer.Option(help="Address ground stations are sent to.")] = "127.0.0.1",
    run_folder: Annotated[Path | None, typer.Option(help="Where logs go. Default: runs/DATE.")] = None,
) -> None:
    """Let the drone follow somebody who walks through hills and trees."""
    with learn_extra():
        from mission.flight_options import FlightOptions, UserError
        from mission.follow.follow_options import FollowOptions, check_follow_options

        if owner not in ("walk", "run"):
            refuse(f"--owner {owner}: must be walk or run")
        flight = FlightOptions(
            plan=None, is_idle=True, once=False, speed=speed, seconds=None, seed=seed, wind_m_s=wind,
            wind_from_deg=wind_from, noise=noise, airframe=airframe, home=None, world_seed=world_seed,
            trees_per_ha=trees, hill_height_m=hills, has_walls=True, host=host, bind="", tcp_port=None,
            has_to_sign=False, gcs_port=gcs_port, api_port=api_port, run_folder=run_folder, has_view=view,
            view_port=view_port, dialect=dialect, parameters=tuple(param or ()),
        )  # fmt: skip
        options = FollowOptions(flight, "run" if owner == "run" else "walk", policy, seconds, mp4)
        try:
            check_follow_options(options)
            with busy(Console(), "loading the program"):
                from mission.follow.follow_session import follow_session
            code = follow_session(options)
        except UserError as error:
            refuse(str(error))
    raise typer.Exit(code)
