"""The flight that options of the command line describe; what is wrong with them gets one sentence."""

from pathlib import Path
from typing import Any, cast

from pydantic import ValidationError

from common.airframe import AirframeError, load_airframe
from common.params import ParameterError
from common.state_folder import StateFolder
from mission.console.model_command import first_fault
from mission.console.option_checks import UserError, home_of, is_world_file, parameter_of
from mission.flight_config import AIRFIELD, TREELESS_M, FlightConfig, OwnerConfig, flight_parameters
from mission.flight_settings import OURS, FlightOptions, FlightSettings, Pace
from mission.flight_state_folder import stored_home
from sim.bodies.vehicles import class_of
from sim.world.driving_worlds import CAR_PARK, COURSE
from sim.world.forest_world import FOREST, WALLED_FOREST
from sim.world.world import WorldConfig

FIELD_TREES_PER_HA = 60.0  # where an owner walks, if nothing else is asked for
FOREST_TREES_PER_HA = 400.0
FORESTS = {"forest": FOREST, "walled-forest": WALLED_FOREST}


def check_parameters(options: FlightOptions) -> None:
    """Refuses parameters that the vehicle does not have, or values that they cannot have, before kernels are loaded.

    Those of an outside autopilot are its own to judge.

    Raises:
        UserError: the options describe no flight.
    """
    config = flight_config(options, None)
    if options.board not in OURS:
        return
    try:
        flight_parameters(config, load_airframe(config.airframe))
    except (AirframeError, ParameterError) as error:
        raise UserError(str(error)) from error


def flight_config(options: FlightOptions, state: StateFolder | None) -> FlightConfig:
    """The flight that the options describe; home may be the one stored."""
    home = stored_home(state) if options.home is None else home_of(options.home)
    try:
        return FlightConfig(
            **{name: getattr(options, name) for name in FlightSettings.model_fields},
            home=home,
            parameters=dict(parameter_of(text) for text in options.parameters),
            owner=None if options.owner is None else OwnerConfig(pace=cast(Pace, options.owner)),
            world=_world(options),
            is_forest=options.world_kind in FORESTS or _follows_on_wheels(options),
        )
    except ValidationError as error:
        raise UserError(first_fault(error)) from error


def _follows_on_wheels(options: FlightOptions) -> bool:
    """Who follows on wheels sees by the scanner, too."""
    return options.owner is not None and class_of(load_airframe(options.airframe)).drives


def _world(options: FlightOptions) -> WorldConfig:
    """With an owner the world of training: its hills can be walked; to fly alone no trees near home."""
    if is_world_file(options):
        from mission.world.world_reader import read_world

        return read_world(Path(options.world_kind))
    numbers = {"trees_per_ha": options.trees_per_ha, "hill_height_m": options.hill_height_m}
    chosen: dict[str, Any] = {name: number for name, number in numbers.items() if number is not None}
    given: dict[str, Any] = {"seed": options.world_seed} | chosen
    if options.owner is not None:
        from policies.tasks.follow_me.world import FOLLOW_WORLD

        trees = FIELD_TREES_PER_HA if options.trees_per_ha is None else options.trees_per_ha
        return FOLLOW_WORLD.model_copy(update={"seed": options.world_seed, "trees_per_ha": trees})
    if options.world_kind in FORESTS:
        return FORESTS[options.world_kind].model_copy(update={"trees_per_ha": FOREST_TREES_PER_HA} | given)
    if options.world_kind != "hills":
        driven = {"course": COURSE, "car-park": CAR_PARK}[options.world_kind]
        return driven.model_copy(update={"seed": options.world_seed})
    if class_of(load_airframe(options.airframe)).needs_runway:
        return AIRFIELD.model_copy(update=given | {"has_walls": options.has_walls})
    return WorldConfig(**given, has_walls=options.has_walls, treeless_radius_m=TREELESS_M)
