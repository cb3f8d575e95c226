"""The flight that options of the command line describe; what is wrong with them gets one sentence."""

from typing import Any, cast, get_args

from pydantic import ValidationError

from common.airframe import AirframeError, load_airframe
from common.geodesy import DEFAULT_HOME, GeoPoint
from common.params import ParameterError
from common.state_folder import StateFolder
from mission.console.model_command import first_fault
from mission.flight_config import TREELESS_M, FlightConfig, OwnerConfig, flight_parameters
from mission.flight_settings import FlightOptions, FlightSettings, Pace
from mission.flight_state_folder import stored_home
from mission.plan.plan_file import PlanError, read_plan
from sim.world.world import WorldConfig

HOME_MOST = (89.0, 180.0, 6000.0)  # latitude and longitude [deg], altitude [m]: highest airfields


class UserError(ValueError):
    """Something the user gave is wrong; the message is one sentence."""


def speed_of(text: str) -> float | None:
    """Times real time; None: as fast as possible."""
    if text == "max":
        return None
    try:
        speed = float(text)
    except ValueError:
        speed = -1.0
    if not 0.0 < speed <= 1000.0:
        raise UserError(f"--speed {text}: must be a number above 0, or 'max'")
    return speed


def check_end(options: FlightOptions, speed: float | None) -> None:
    """Refuses options that leave nothing to fly, or nothing to wait for."""
    if options.is_idle and options.plan is not None:
        raise UserError("--plan and --idle: choose one, to fly a plan or to wait for a ground station")
    if options.is_idle and options.once:
        raise UserError("--idle and --once: without a plan there is no mission to end with; use --seconds to end")
    check_owner(options)
    if options.is_idle and speed is None and options.seconds is None:
        raise UserError("--idle --speed max: nobody can connect, so give --seconds to say when it ends")


def check_owner(options: FlightOptions) -> None:
    """Refuses an owner who does not move as owners do."""
    if options.owner not in (None, *get_args(Pace)):
        raise UserError(f"--owner {options.owner}: must be walk or run")


def check_options(options: FlightOptions) -> None:
    """Refuses what can be seen to be wrong before ports, servers or kernels are loaded.

    Raises:
        UserError: an option, the plan, the airframe or a parameter is wrong.
    """
    check_end(options, speed_of(options.speed))
    try:
        if options.plan is not None:
            read_plan(options.plan)
        config = flight_config(options, None)
        flight_parameters(config, load_airframe(config.airframe))
    except (AirframeError, ParameterError, PlanError) as error:
        raise UserError(str(error)) from error


def flight_config(options: FlightOptions, state: StateFolder | None) -> FlightConfig:
    """The flight that the options describe; home may be the one stored."""
    home = stored_home(state) if options.home is None else _home(options.home)
    try:
        return FlightConfig(
            **{name: getattr(options, name) for name in FlightSettings.model_fields},
            home=home,
            parameters=dict(_parameter(text) for text in options.parameters),
            owner=None if options.owner is None else OwnerConfig(pace=cast(Pace, options.owner)),
            world=_world(options),
        )
    except ValidationError as error:
        raise UserError(first_fault(error)) from error


def _world(options: FlightOptions) -> WorldConfig:
    """With an owner the world of training: its hills can be walked; otherwise no trees near home."""
    given: dict[str, Any] = {"seed": options.world_seed, "trees_per_ha": options.trees_per_ha}
    if options.owner is not None:
        from policies.tasks.follow_me.world import FOLLOW_WORLD

        return FOLLOW_WORLD.model_copy(update=given)
    return WorldConfig(
        **given, hill_height_m=options.hill_height_m, has_walls=options.has_walls, treeless_radius_m=TREELESS_M
    )


def _parameter(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError as error:
        raise UserError(f"--param {text}: must be NAME=VALUE, with a number") from error


def _home(text: str) -> GeoPoint:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) == 2:
        values.append(DEFAULT_HOME.alt_m)
    if len(values) != 3 or not all(abs(value) <= most for value, most in zip(values, HOME_MOST, strict=True)):
        latitude, longitude, altitude = HOME_MOST
        raise UserError(
            f"--home {text}: must be latitude,longitude or latitude,longitude,altitude, with the latitude within "
            f"±{latitude:g}, the longitude within ±{longitude:g} and the altitude within ±{altitude:g} m"
        )
    return GeoPoint(*values)
