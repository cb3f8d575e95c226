"""Prints the gains of an airframe's control law and their margins: `python -m autopilot.tuning [--airframe NAME]`.

Each class of vehicles has its model and its design rules in a `tuning.py` of its folder.
"""

from collections.abc import Mapping, Sequence
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from autopilot.control.margins import GAIN_REQUIRED_DB, PHASE_REQUIRED_DEG, Design, Margins
from autopilot.vehicles.multirotor import tuning as multirotor
from autopilot.vehicles.multirotor.params import CONTROL_PARAMETERS
from autopilot.vehicles.rover import tuning as rover
from autopilot.vehicles.rover.params import ROVER_PARAMETERS
from common.airframe import Airframe, AirframeError, load_airframe
from common.airframes.multirotor import MultirotorAirframe
from common.airframes.rover import RoverAirframe
from common.params import Parameter


def judged(airframe: Airframe) -> tuple[Design, Sequence[Parameter]]:
    """What the design tool of the airframe's class says of it, and the parameters that it speaks of.

    Raises:
        AirframeError: nobody designs the gains of its class.
    """
    if isinstance(airframe, MultirotorAirframe):
        return multirotor.judge(airframe), CONTROL_PARAMETERS
    if isinstance(airframe, RoverAirframe):
        return rover.judge(airframe), ROVER_PARAMETERS
    raise AirframeError(f"airframe '{airframe.name}': nobody designs the gains of a {airframe.vehicle}")


def _margin_table(airframe: Airframe, rows: list[Margins]) -> Table:
    table = Table(title=f"{airframe.name}: margins with the default gains")
    for heading in ("loop", "crossover\nrad/s", "gain\ndB", "phase\ndeg", "disk gain\ndB", "disk phase\ndeg", "enough"):
        table.add_column(heading, justify="left" if heading == "loop" else "right")
    for row in rows:
        figures = (row.crossover_rad_s, row.gain_db, row.phase_deg, row.disk_gain_db, row.disk_phase_deg)
        verdict = "yes" if row.is_sufficient else "[red]no[/red]"
        table.add_row(row.loop, *(f"{figure:.1f}" for figure in figures), verdict)
    return table


def _gain_table(airframe: Airframe, parameters: Sequence[Parameter], designed: Mapping[str, float]) -> Table:
    table = Table(title=f"{airframe.name}: gains")
    for heading in ("parameter", "default", "designed for this airframe"):
        table.add_column(heading, justify="left" if heading == "parameter" else "right")
    for item in parameters:
        if item.source.startswith("python -m autopilot.tuning"):
            table.add_row(item.name, f"{item.default:g}", f"{designed[item.field]:g}")
    return table


app = typer.Typer(add_completion=False)


@app.command()
def main(
    airframe: Annotated[str, typer.Option(help="Name of an airframe, or path of its TOML file.")] = "x500",
) -> None:
    """Prints each loop's margins and the gains the design rules give; exit code 1 if a margin is too small."""
    console = Console()
    try:
        frame = load_airframe(airframe)
        result, parameters = judged(frame)
    except AirframeError as error:
        console.print(str(error), style="red", highlight=False)
        raise typer.Exit(2) from error
    console.print(_margin_table(frame, result.margins))
    console.print(_gain_table(frame, parameters, result.gains))
    console.print(
        f"Enough is a gain margin of {GAIN_REQUIRED_DB:.0f} dB and a phase margin of {PHASE_REQUIRED_DEG:.0f} deg; "
        "nothing is required of the disk margins."
    )
    if not all(row.is_sufficient for row in result.margins):
        raise typer.Exit(1)


if __name__ == "__main__":
    app()
