"""The command line: `honeyguide fly`, `estimate` and `picture`; the others come from *_commands.py.

A wrong argument, file or port gives one sentence on standard error and exit code 2; a mission that failed gives 1.
"""

from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from autopilot.mavlink.transport.links import GROUND_STATION_PORT, OFFBOARD_PORT
from common.geodesy import DEFAULT_HOME
from mission.console.command_refusal import refuse
from mission.console.name_checks import check_file
from mission.console.terminal import busy
from mission.follow import follow_commands
from mission.train import task_commands, training_commands
from mission.view import replay_command

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Fly a simulated drone and its flight controller over MAVLink.",
)
_HOME = f"{DEFAULT_HOME.lat_deg},{DEFAULT_HOME.lon_deg},{DEFAULT_HOME.alt_m:g}"


def main() -> None:
    """Entry point of the console command."""
    app()


def _print_version(is_asked: bool) -> None:
    if is_asked:
        typer.echo(f"honeyguide {version('honeyguide')}")
        raise typer.Exit


@app.callback()
def _root(
    _: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Fly a simulated drone and its flight controller over MAVLink."""


@app.command()
def fly(
    plan: Annotated[
        Path | None, typer.Option(help="A QGroundControl .plan or QGC WPL 110 file. Default: a tour of the hills.")
    ] = None,
    idle: Annotated[bool, typer.Option("--idle", help="Fly no plan: wait for a ground station.")] = False,
    once: Annotated[
        bool, typer.Option("--once", help="End with the mission; exit code 0 only if it succeeded.")
    ] = False,
    speed: Annotated[str, typer.Option(help="Times real time, or 'max': lockstep, without network links.")] = "1",
    seconds: Annotated[float | None, typer.Option(min=0.1, help="End after this much simulated time.")] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Seed of sensor noise and turbulence.")] = 0,
    wind: Annotated[float, typer.Option(min=0.0, max=20.0, help="Wind speed [m/s], with turbulence and gusts.")] = 0.0,
    wind_from: Annotated[float, typer.Option(min=0.0, max=360.0, help="Where the wind comes from [deg].")] = 270.0,
    noise: Annotated[float, typer.Option(min=0.0, max=10.0, help="Scale of all sensor noise.")] = 1.0,
    airframe: Annotated[str, typer.Option(help="Airframe name or TOML file.")] = "x500",
    home: Annotated[
        str | None, typer.Option(help="Latitude,longitude[,altitude AMSL].", show_default=f"{_HOME}, or as stored")
    ] = None,
    world_seed: Annotated[int, typer.Option(min=0, help="Seed of hills and trees.")] = 1,
    trees: Annotated[float, typer.Option(min=0.0, max=1000.0, help="Trees per hectare.")] = 60.0,
    hills: Annotated[float, typer.Option(min=0.0, max=300.0, help="Height of the hills [m].")] = 12.0,
    walls: Annotated[bool, typer.Option("--walls", help="Walls along the edges of the map.")] = False,
    dialect: Annotated[str, typer.Option(help="What ground stations take it for: px4 or ardupilot.")] = "px4",
    announce_components: Annotated[
        bool,
        typer.Option("--announce-components", help="ArduPilot's dialect: heartbeats of camera, gimbal and winch, too."),
    ] = False,
    host: Annotated[str, typer.Option(help="Address ground stations are sent to.")] = "127.0.0.1",
    bind: Annotated[str, typer.Option(help="Address the vehicle's ports are open at. Default: loopback.")] = "",
    tcp_port: Annotated[
        int | None, typer.Option(min=1, max=65535, help="TCP port for clients that connect; ArduPilot's is 5760.")
    ] = None,
    require_signing: Annotated[
        bool, typer.Option("--require-signing", help="Refuse unsigned messages on this machine's links too.")
    ] = False,
    gcs_port: Annotated[int, typer.Option(min=1, max=65535, help="UDP port of ground stations.")] = (
        GROUND_STATION_PORT
    ),
    api_port: Annotated[int, typer.Option(min=1, max=65535, help="UDP port of the offboard API.")] = OFFBOARD_PORT,
    stream_port: Annotated[
        int, typer.Option(min=0, max=65535, help="HTTP port of the camera's live picture; 0: none.")
    ] = 0,
    video_port: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=65534,
            help="UDP port of --host that the camera's video is sent to (H.264, RTP); 0: none.",
            show_default="5600, when a client starts the video",
        ),
    ] = None,
    view: Annotated[bool, typer.Option("--view", help="Show the flight on a live page in the browser.")] = False,
    view_port: Annotated[int, typer.Option(min=1, max=65535, help="HTTP port of the live page.")] = 8080,
    traffic: Annotated[int, typer.Option(min=0, max=50, help="Other aircraft that are heard by ADS-B.")] = 0,
    owner: Annotated[
        str | None, typer.Option(help="Somebody with a phone walks through the world: walk or run; see companion.")
    ] = None,
    image_port: Annotated[
        int, typer.Option(min=1, max=65535, help="TCP port of the pictures for a companion, with an owner.")
    ] = 14600,
    lidar: Annotated[bool, typer.Option("--lidar", help="Carry a ring of range finders that looks round.")] = False,
    param: Annotated[
        list[str] | None, typer.Option(help="Sets a parameter of the flight controller: NAME=VALUE. Repeatable.")
    ] = None,
    run_folder: Annotated[Path | None, typer.Option(help="Where logs go. Default: runs/DATE.")] = None,
    state: Annotated[
        Path | None, typer.Option(help="Folder for what outlives the run: parameters, mission, fence, files, logs.")
    ] = None,
) -> None:
    """Fly: world, vehicle, flight controller and MAVLink links, in real time or faster."""
    from mission.flight_options import FlightOptions, UserError, check_options

    options = FlightOptions(
        plan=plan, is_idle=idle, once=once, speed=speed, seconds=seconds, seed=seed, wind_m_s=wind,
        wind_from_deg=wind_from, noise=noise, airframe=airframe, home=home, world_seed=world_seed,
        trees_per_ha=trees, hill_height_m=hills, has_walls=walls, dialect=dialect, host=host, bind=bind,
        tcp_port=tcp_port, has_to_sign=require_signing, gcs_port=gcs_port, api_port=api_port,
        run_folder=run_folder, stream_port=stream_port, video_port=video_port,
        parameters=tuple(param or ()), state=state, traffic_count=traffic, has_lidar=lidar,
        has_view=view, view_port=view_port, owner=owner, image_port=image_port,
        announces_components=announce_components,
    )  # fmt: skip
    try:
        check_options(options)
        from mission.fly_session import fly_session

        exit_code = fly_session(options)
    except UserError as error:
        refuse(str(error))
    raise typer.Exit(exit_code)


@app.command()
def estimate(
    log: Annotated[Path, typer.Argument(help="A PX4 ULog (.ulg), or a sensor CSV (docs/how-to/estimate.md).")],
    output: Annotated[Path | None, typer.Option(help="Folder for the results. Default: beside the log.")] = None,
    param: Annotated[
        list[str] | None, typer.Option(help="Sets a parameter of the estimator: NAME=VALUE. Repeatable.")
    ] = None,
    ignore_velocity_flag: Annotated[
        bool,
        typer.Option("--ignore-velocity-flag", help="Use GNSS velocities that the receiver calls invalid, too."),
    ] = False,
) -> None:
    """Run the estimator alone over the sensors recorded in a log."""
    check_file(log)
    with busy(Console(), "loading the program"):
        from mission.estimate.estimate import EstimateError, estimate_log

    try:
        estimate_log(log, output, Console(), parameters=param or (), ignores_velocity_flag=ignore_velocity_flag)
    except EstimateError as error:
        refuse(str(error))


@app.command()
def picture(
    output: Annotated[Path, typer.Argument(help="The JPEG to write.")],
    north: Annotated[float, typer.Option(help="Place of the camera from home [m].")] = 0.0,
    east: Annotated[float, typer.Option(help="Place of the camera from home [m].")] = 0.0,
    up: Annotated[float, typer.Option(min=0.0, help="Height above the ground [m].")] = 20.0,
    yaw: Annotated[float, typer.Option(help="Where it looks, clockwise from north [deg].")] = 0.0,
    pitch: Annotated[float, typer.Option(min=-90.0, max=90.0, help="Up from the horizon [deg].")] = -10.0,
    fov: Annotated[float, typer.Option(min=5.0, max=150.0, help="Horizontal field of view [deg].")] = 80.0,
    size: Annotated[str, typer.Option(help="Width and height.")] = "1280x720",
    world_seed: Annotated[int, typer.Option(min=0, help="Seed of hills and trees.")] = 1,
    trees: Annotated[float, typer.Option(min=0.0, max=1000.0, help="Trees per hectare.")] = 60.0,
    hills: Annotated[float, typer.Option(min=0.0, max=300.0, help="Height of the hills [m].")] = 12.0,
) -> None:
    """Take a picture of the world from a place in it."""
    from mission.flight_config import TREELESS_M
    from mission.video.image_command import PictureError, Viewpoint, take_picture
    from sim.world.world import WorldConfig

    world = WorldConfig(seed=world_seed, trees_per_ha=trees, hill_height_m=hills, treeless_radius_m=TREELESS_M)
    try:
        take_picture(output, world, Viewpoint(north, east, up, yaw, pitch, fov), size)
    except PictureError as error:
        refuse(str(error))


for _command in (task_commands.demonstrate, task_commands.play, task_commands.drive):
    app.command()(_command)
app.command()(follow_commands.follow)
app.command()(follow_commands.companion)
app.command()(replay_command.replay)
app.command(context_settings={"allow_extra_args": True})(training_commands.train)
app.command(name="eval")(training_commands.evaluate)
app.command()(training_commands.export)
