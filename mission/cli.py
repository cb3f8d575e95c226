"""The command line: `honeyguide fly`, `estimate` and `picture`; the others come from *_commands.py.

A wrong argument, file or port gives one sentence on standard error and exit code 2; a mission that failed gives 1.
"""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from mission.benchmark import benchmark_command
from mission.campaign import command as campaign_command
from mission.console.command_refusal import refuse
from mission.console.late_command import LateCommand
from mission.console.name_checks import check_file
from mission.console.terminal import loading
from mission.dataset import commands as dataset_commands
from mission.follow import follow_commands
from mission.foxglove import mcap_command
from mission.park import park_command
from mission.review import review_command
from mission.scenario import command as scenario_command
from mission.train import task_commands, training_commands
from mission.view import replay_command
from mission.world import world_command

if TYPE_CHECKING:
    from mission.flight_settings import FlightOptions

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Fly a simulated drone and its flight controller over MAVLink.",
)


def main() -> None:
    """Entry point of the console command."""
    app()


def _print_version(is_asked: bool) -> None:
    if is_asked:
        from importlib.metadata import version

        typer.echo(f"honeyguide {version('honeyguide')}")
        raise typer.Exit


@app.callback()
def _root(
    _: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Fly a simulated drone and its flight controller over MAVLink."""


@app.command(cls=LateCommand)
def fly() -> Callable[..., None]:
    """Fly: world, vehicle, flight controller and MAVLink links, in real time or faster."""
    from mission.console.model_command import model_command
    from mission.flight_settings import FlightOptions

    return model_command(FlightOptions, _fly)


def _fly(options: "FlightOptions") -> int:
    from mission.console.option_checks import UserError, check_options

    try:
        check_options(options)
        if options.vehicles is not None:
            from mission.fleet.fleet_options import check_fleet

            check_fleet(options)
            from mission.fleet.fleet_session import fly_fleet

            return fly_fleet(options)
        from mission.flight_options import check_parameters

        check_parameters(options)
        from mission.fly_session import fly_session

        return fly_session(options)
    except UserError as error:
        refuse(str(error))


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
    with loading(Console()):
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
    world: Annotated[Path | None, typer.Option(help="A world file, instead of hills and trees.")] = None,
    world_seed: Annotated[int, typer.Option(min=0, help="Seed of hills and trees.")] = 1,
    trees: Annotated[float, typer.Option(min=0.0, max=1000.0, help="Trees per hectare.")] = 60.0,
    hills: Annotated[float, typer.Option(min=0.0, max=300.0, help="Height of the hills [m].")] = 12.0,
) -> None:
    """Take a picture of the world from a place in it."""
    from mission.console.option_checks import UserError
    from mission.flight_config import TREELESS_M
    from mission.video.image_command import ImageError, Viewpoint, take_image
    from mission.world.world_reader import read_world
    from sim.world.world_config import WorldConfig

    try:
        if world is None:
            config = WorldConfig(seed=world_seed, trees_per_ha=trees, hill_height_m=hills, treeless_radius_m=TREELESS_M)
        else:
            config = read_world(world)
        take_image(output, config, Viewpoint(north, east, up, yaw, pitch, fov), size)
    except (ImageError, UserError) as error:
        refuse(str(error))


for _command in (task_commands.demonstrate, task_commands.play, task_commands.drive):
    app.command()(_command)
app.command(cls=LateCommand)(follow_commands.follow)
app.command()(follow_commands.companion)
app.command()(benchmark_command.benchmark)
app.command(cls=LateCommand)(park_command.park)
app.command()(replay_command.replay)
app.command()(world_command.world)
app.command()(review_command.review)
app.command(name="test")(scenario_command.fly_scenarios)
app.command(name="campaign")(campaign_command.fly_campaign_file)
app.command()(mcap_command.mcap)
app.command(context_settings={"allow_extra_args": True})(training_commands.train)
app.command(name="eval")(training_commands.evaluate)
app.add_typer(dataset_commands.app, name="dataset")
app.command()(training_commands.export)
app.command()(training_commands.card)
