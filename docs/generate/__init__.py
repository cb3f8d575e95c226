"""The pages of docs that come from the code, written by `python -m docs.generate`. A test keeps them current."""

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

from autopilot.ardupilot_only_params import ARDUPILOT_PARAMETERS
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT, ArduPilotDialect
from autopilot.mavlink.dialects.ardupilot_aliases import ALIASES, CONSTANTS
from autopilot.params import parameter_sections, parameter_table
from common.airframe import load_airframe
from common.params import Parameter
from docs.generate.conditions_page import conditions_text
from docs.generate.foxglove_page import foxglove_text
from docs.generate.guard_page import guard_text
from docs.generate.mavlink_page import mavlink_text
from docs.generate.tasks_page import tasks_text
from docs.generate.training_page import training_text
from docs.generate.world_page import world_text
from mission.campaign import schema as campaign_schema
from mission.flight import Flight, FlightConfig
from mission.scenario.schema import reference_text, schema_text
from mission.simulator.simulator_params import simulator_parameters
from sim.bodies.vehicles import class_of

REFERENCE = Path(__file__).parents[1] / "reference"
HEADER = """# Parameters

Written by `python -m docs.generate` from the declarations: do not edit.

Names are PX4's where the meaning is PX4's. Defaults are those of the x500; a source `airframe file` means that another
airframe brings its own. They are read and set over MAVLink (PARAM_*), by a ground station or by a
[script](../how-to/script.md); a value out of range is set to the nearest bound, and the vehicle says so. `make tune`
shows how the gains were designed.
"""

ARDUPILOT_HEADER = """## In the ArduPilot dialect alone

PX4 has nothing like them: a vehicle has them with [`--dialect ardupilot`](dialects.md).

"""

SIMULATOR_HEADER = """## The simulator, in the ArduPilot dialect

They change the flight's air, sensors, motors, battery and pace while it is flown, as those of ArduPilot's SITL do, and
are not kept for the next flight. The flight controller does not read them.

"""

ALIAS_HEADER = """## Names in the ArduPilot dialect

With [`--dialect ardupilot`](dialects.md) the vehicle has these names too. Those that stand for
nothing can only be read.

"""


OTHER_AIRFRAMES = ("rover", "plane")  # one of each class of vehicles besides the multirotor
OTHER_HEADER = """## {title}: control, flight modes, detectors

In the place of the multirotor's. Defaults are those of the {airframe}.

{own}
In the ArduPilot dialect it has the names of a {theirs}, in the place of a Copter's:

"""
ARDUPILOT_SHARED = frozenset(alias.name for alias in ALIASES)


def parameters_text() -> str:
    """The whole page."""
    x500 = parameter_table(load_airframe("x500")).declarations
    sections = [
        f"## {title}\n\n{_table(x500[item.name] for item in declared)}"
        for title, declared in parameter_sections().items()
    ]
    config = FlightConfig()
    simulator = simulator_parameters(load_airframe(config.airframe), config.home, config.wind_m_s, config.wind_from_deg)
    ardupilot = [ARDUPILOT_HEADER + _table(ARDUPILOT_PARAMETERS), SIMULATOR_HEADER + _table(simulator)]
    others = [_of_other_class(name) for name in OTHER_AIRFRAMES]
    return "\n".join([HEADER, *sections, *others, *ardupilot, ALIAS_HEADER + _alias_table(ARDUPILOT)])


def _of_other_class(airframe_name: str) -> str:
    """What another class has in the place of the multirotor's parameters, and ArduPilot's names of them."""
    airframe = load_airframe(airframe_name)
    vehicle = class_of(airframe).vehicle
    declarations = parameter_table(airframe, vehicle=vehicle).declarations
    own = _table(declarations[item.name] for item in vehicle.parameters)
    dialect = ARDUPILOT.of_vehicle(vehicle.modes, vehicle.ardupilot)
    shared = {*ARDUPILOT_SHARED, *(each.name for each in CONSTANTS)}
    title = vehicle.name.capitalize()
    return OTHER_HEADER.format(title=title, airframe=airframe_name, theirs=vehicle.ardupilot.name, own=own) + (
        _alias_table(dialect, declarations, shared)
    )


def _table(declarations: Iterable[Parameter]) -> str:
    rows = ["| name | default | range | unit | meaning | source |", "|---|---|---|---|---|---|"]
    for item in sorted(declarations, key=lambda parameter: parameter.name):
        bounds = f"{item.minimum:g} … {item.maximum:g}" if item.minimum < item.maximum else "constant"
        meaning = item.meaning.removesuffix("; constant")
        rows.append(f"| {item.name} | {item.default:g} | {bounds} | {item.unit} | {meaning} | {item.source} |")
    return "\n".join(rows) + "\n"


def generated_pages() -> dict[Path, str]:
    """The text of every generated page, by its path."""
    return {
        REFERENCE / "parameters.md": parameters_text(),
        REFERENCE / "mavlink.md": mavlink_text(Flight(FlightConfig()).server),
        REFERENCE / "training-config.md": training_text(),
        REFERENCE / "tasks.md": tasks_text(),
        REFERENCE / "follow-conditions.md": conditions_text(),
        REFERENCE / "guard-settings.md": guard_text(),
        REFERENCE / "world-file.md": world_text(),
        REFERENCE / "scenario-keys.md": reference_text(),
        REFERENCE / "scenario.schema.json": schema_text(),
        REFERENCE / "campaign-keys.md": campaign_schema.reference_text(),
        REFERENCE / "campaign.schema.json": campaign_schema.schema_text(),
        REFERENCE / "foxglove-channels.md": foxglove_text(),
    }


def _alias_table(
    dialect: ArduPilotDialect, known: Mapping[str, Parameter] | None = None, without: Collection[str] = ()
) -> str:
    known = parameter_table().declarations if known is None else known
    rows = ["| name | stands for | in units of | value |", "|---|---|---|---|"]
    lines = {}
    for constant in dialect.constants:
        lines[constant.name] = f"| {constant.name} | | | {constant.value:g}: {constant.meaning} |"
    for alias in dialect.aliases:
        if alias.of not in known:
            continue
        if alias.numbers is None:
            unit = f"1/{alias.scale:g} {known[alias.of].unit}" if alias.scale != 1.0 else known[alias.of].unit
            lines[alias.name] = f"| {alias.name} | {alias.of} | {unit} | |"
        else:
            numbers = ", ".join(f"{theirs} = {ours}" for ours, theirs in alias.numbers.items())
            lines[alias.name] = f"| {alias.name} | {alias.of} | | {numbers} |"
    return "\n".join([*rows, *(lines[name] for name in sorted(lines) if name not in without)]) + "\n"
